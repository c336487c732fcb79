"""Time and memory that a job asks a cluster for are enough for what was measured, and not far more."""

import json
from pathlib import Path

import pytest

from echotruth.config import Config
from echotruth.config.loading import load, validate
from echotruth.workflow.resources import megabytes, minutes

ROOT = Path(__file__).parents[2]
MEASURED = json.loads((Path(__file__).parent / "measured_costs.json").read_text())


def configuration(name) -> Config:
    given = MEASURED[name]["config"]
    return load(ROOT / f"config/{given}.yaml") if isinstance(given, str) else validate(given, name)


@pytest.mark.parametrize("rule", ["mechanics", "phantom", "rf", "truth", "bmode", "tracking"])
@pytest.mark.parametrize("name", MEASURED)
def test_enough_is_asked_for_what_was_measured(rule, name):
    config, measured = configuration(name), MEASURED[name]["stages"][rule]
    job = rule, config, next(iter(config.views)), max(config.bmode.sizes)
    took = measured["memory_MB"]
    assert took < megabytes(*job) < max(4 * took, 1000)
    # Of all image sizes, in the mean over the jobs.
    assert 60 * minutes(*job) > 2 * measured["cpu_seconds"] / measured["jobs"]


@pytest.mark.parametrize("rule, change", [
    ("mechanics", {"geometry": {"transmural_elements": 6}}),
    ("mechanics", {"loop": {"frames": 120}}),
    ("rf", {"phantom": {"density_per_mm3": 8000}}),
    ("rf", {"rf": {"keep": ["channels"]}}),
    ("tracking", {"loop": {"frames": 120}}),
])  # fmt: skip
def test_larger_work_asks_for_more(rule, change):
    small, large = (Config.model_validate(values) for values in ({}, change))
    assert megabytes(rule, small, "mid", 512) < megabytes(rule, large, "mid", 512)
    assert minutes(rule, small, "mid", 512) <= minutes(rule, large, "mid", 512)


def test_a_mesh_of_many_cells_asks_for_more_time():
    small, large = (Config.model_validate({"geometry": {"transmural_elements": number}}) for number in (3, 12))
    assert minutes("mechanics", small) < minutes("mechanics", large)
