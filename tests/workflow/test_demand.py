"""Time and memory that a job asks a cluster for are enough for what was measured, and not far more."""

from pathlib import Path

import numpy as np
import pytest

from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.mechanics.geometry import left_ventricle
from echotruth.workflow import demand, expected_cost

CONFIG = Path(__file__).parents[2] / "config"
# Largest wall-clock time, s, and memory, MB, of the records of finished repositories, on one core of a busy machine.
MECHANICS = {"mouse": (72, 830), "paper": (69, 827), "fimh25": (134, 3536)}
IMAGES = {"mouse": (155, 1017), "paper": (250, 1000), "fimh25": (165, 1308)}


@pytest.mark.parametrize("work, name, measured", [
    *((demand.mechanics, name, measured) for name, measured in MECHANICS.items()),
    *((demand.images, name, measured) for name, measured in IMAGES.items()),
])  # fmt: skip
def test_enough_is_asked_for_what_was_measured(work, name, measured):
    asked = work(load(CONFIG / f"{name}.yaml"))
    seconds, megabytes = measured
    assert 60 * asked.minutes > 2 * seconds
    assert 1.2 * megabytes < asked.megabytes < 2.5 * megabytes


@pytest.mark.parametrize("name", ["demo", "human"])
def test_volume_of_the_wall_is_that_of_its_mesh(name):
    geometry = load(CONFIG / f"{name}.yaml").geometry
    mesh = left_ventricle(geometry)
    corners = mesh.nodes[mesh.cells[:, :4]]
    volume = abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6 * 1e9
    assert expected_cost.wall_volume(geometry) == pytest.approx(volume, rel=0.05)


@pytest.mark.parametrize("change", [
    {"geometry": {"transmural_elements": 6}},
    {"loop": {"frames": 80}},
])  # fmt: skip
def test_larger_hearts_ask_for_more(change):
    small, large = (demand.mechanics(Config.model_validate(values)) for values in ({}, change))
    assert large.minutes > small.minutes and large.megabytes > small.megabytes


@pytest.mark.parametrize("change", [
    {"phantom": {"density_per_mm3": 8000}},
    {"loop": {"frames": 80}},
    {"bmode": {"size_px": 1024}},
    {"geometry": {"scale": 1.5}},
])  # fmt: skip
def test_larger_images_ask_for_more(change):
    small, large = (demand.images(Config.model_validate(values)) for values in ({}, change))
    assert large.minutes > small.minutes and large.megabytes > small.megabytes
