"""The unloaded state fills to the image it was found from."""

import numpy as np
import pytest

from echotruth.config import Config, Geometry, Loop, Mechanics
from echotruth.mechanics.beat import beat
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver import unloaded
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.mechanics.solver.newton import Diverged

IMAGE = Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1, given_state="end_diastole")


def config(**loop):
    wall = Mechanics(material={"stiffness_kPa": 2.0})
    return Config(geometry=IMAGE, loop=Loop(frames=2, **loop), mechanics=wall)


@pytest.fixture(scope="module")
def imaged():
    return beat(config())


def test_heart_imaged_at_end_diastole_is_met_there(imaged):
    arrays, image = imaged, left_ventricle(IMAGE)
    geometry, mechanics = arrays["geometry"], arrays["mechanics"]
    filled = geometry["node_position"] + mechanics["displacement"][0]
    np.testing.assert_allclose(filled, image.nodes, atol=2e-6 * np.ptp(image.nodes))
    assert mechanics["volume"][0] == pytest.approx(cavity_volume(image.nodes, image.endo), rel=1e-5)
    assert cavity_volume(geometry["node_position"], geometry["endo"]) < 0.9 * mechanics["volume"][0]


def test_loop_is_scaled_to_the_image_and_keeps_its_ejection_fraction(imaged):
    volume = imaged["mechanics"]["volume_target"]
    unscaled = beat(Config(geometry=IMAGE.model_copy(update={"given_state": "unloaded"}), loop=Loop(frames=2)))[
        "mechanics"
    ]
    assert volume[1] / volume[0] == pytest.approx(unscaled["volume_target"][1] / unscaled["volume_target"][0])


def test_image_for_which_none_is_found_is_refused_in_one_sentence(monkeypatch):
    monkeypatch.setattr(unloaded, "_MAX_ITERATIONS", 2)
    with pytest.raises(Diverged, match=r"fills to the image at 0\.533 kPa: raise stiffness_kPa"):
        beat(config())
