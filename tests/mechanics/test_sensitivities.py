"""Derivatives of the motion are those of hearts that were solved with other parameters."""

from functools import cache

import numpy as np
import pytest

import echotruth as et
from echotruth.config.loading import ConfigError
from echotruth.loop.cycle import read_loop

COARSE = {"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1}
# Changes so small that no step of the load is halved in one heart and not in the next.
HEART = et.configure(geometry=COARSE | {"wall_mm": 1.0}, loop={"frames": 8, "esp_mmHg": 100.0})
FILLED = et.configure(HEART, **{"mechanics.material.stiffness_kPa": 1.2})
INFARCT = et.configure(HEART, pathology={"infarct": {"segments": [8, 9], "tension_scale": 0.1}})
SCAR = et.configure(INFARCT, pathology={"infarct": {"taut_stiffness_kPa": 100.0, "thickness_scale": 0.8}})
SEGMENT = "mechanics.regional.contractility.8"


def differences(config, key, value, step, frames):
    """Central differences of displacement, strain, tension, C and volume."""
    arrays = [et.beat(et.configure(config, **{key: value + sign * step}), frames=frames).arrays for sign in (1, -1)]
    names = {"mechanics": ("displacement", "active_tension", "stiffness", "volume"), "kinematics": ("strain",)}
    return {
        name: (arrays[0][group][name].astype(float) - arrays[1][group][name]) / (2 * step)
        for group, inside in names.items()
        for name in inside
    }


LAWS = {
    SEGMENT: (1.0, 2e-3),
    "mechanics.regional.stiffness.8": (1.0, 2e-3),
    "mechanics.active.sheet_share": (0.32, 5e-4),
    "fibres.endo_deg": (80.0, 0.05),
    "geometry.wall_mm": (1.0, 5e-4),
    "loop.esp_mmHg": (100.0, 0.1),
}
"""Key to its value and step."""
SCARS = {
    "pathology.infarct.tension_scale": (INFARCT, 0.1, 5e-3),
    "pathology.infarct.stiffness_scale": (INFARCT, 20.0, 0.2),
    "pathology.infarct.taut_stiffness_kPa": (SCAR, 100.0, 0.5),
    "pathology.infarct.thickness_scale": (SCAR, 0.8, 2e-3),
}


@cache
def by_laws():
    return et.sensitivities(HEART, list(LAWS))


@cache
def with_scar(is_taut):
    """A heart with a scar, and its derivatives by what the scar has."""
    config = SCAR if is_taut else INFARCT
    return et.sensitivities(config, [key for key, (of, *_) in SCARS.items() if of is config])


def check(config, found, key, value, step):
    heart, by = found
    frames = by["frame"].values.tolist()
    for name, expected in differences(config, key, value, step, frames).items():
        found = by[name].sel(parameter=key).values
        size = np.linalg.norm(heart.arrays["mechanics"]["volume"]) if name == "volume" else np.linalg.norm(expected)
        assert np.linalg.norm(found - expected) <= 2e-3 * size + 1e-12, name


@pytest.mark.parametrize("key", [SEGMENT, *(pytest.param(key, marks=pytest.mark.slow) for key in list(LAWS)[1:])])
def test_laws_fibres_shape_and_loop(key):
    check(HEART, by_laws(), key, *LAWS[key])


@pytest.mark.slow
def test_stiffness_of_a_heart_that_is_filled_with_it():
    key = "mechanics.material.stiffness_kPa"
    check(FILLED, et.sensitivities(FILLED, key), key, 1.2, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("key", SCARS)
def test_heart_with_a_scar_fills_to_its_loop_as_its_derivatives_say(key):
    """Differences are those of hearts that were solved likewise: C of `beat` is that of the heart without the scar."""
    config, value, step = SCARS[key]
    heart, by = with_scar(config is SCAR)
    cycle = read_loop(config.loop)
    volume = heart.arrays["mechanics"]["volume"]
    np.testing.assert_allclose(volume, cycle.volume[: len(volume)], rtol=1e-4)
    others = [
        et.sensitivities(et.configure(config, **{key: value + sign * step}), SEGMENT)[0].arrays["mechanics"]
        for sign in (1, -1)
    ]
    for name in ("displacement", "active_tension", "stiffness"):
        expected = (others[0][name].astype(float) - others[1][name]) / (2 * step)
        found = by[name].sel(parameter=key).values
        assert np.linalg.norm(found - expected) <= 5e-3 * np.linalg.norm(expected), name


@pytest.mark.slow
def test_systole_alone_ends_as_the_whole_cycle_does():
    few = et.configure(HEART, loop={"frames": 10})
    whole, systole = et.beat(few), et.beat(few, frames=et.systole(few))
    assert len(systole.displacement) == whole.es + 1 and systole.es == whole.es
    np.testing.assert_array_equal(systole.displacement, whole.displacement[: whole.es + 1])
    with pytest.raises(ValueError, match=r"6 of 10 frames, of which only its arrays can be used"):
        et.image(systole)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ([], "parameters: name one key or more"),
        (
            "fibres.x",
            r"fibres.x: is no key by which a beat changes: give one of geometry, fibres, pathology, loop, mechanics",
        ),
        ("fibres", "fibres: is no key|fibres: no derivative can be taken"),
        ("loop.edv_uL", "loop.edv_uL = None: no derivative can be taken by it: give it a value"),
        ("mechanics.hold", "mechanics.hold = apex: no derivative can be taken by it: give a key"),
    ],
)
def test_what_is_no_parameter_is_refused(parameters, message):
    with pytest.raises(ConfigError, match=message):
        et.sensitivities(HEART, parameters)


@pytest.mark.parametrize(
    ("keys", "frames", "error", "message"),
    [
        ({"loop.kind": "circulation"}, None, ValueError, "loop.kind = circulation: only a measured"),
        ({"motion.kind": "rigid"}, None, ValueError, "motion.kind = rigid: only a beat"),
        ({}, [1, 2], ValueError, r"frames = \[1, 2\]: give 0 and frames after it, in their order, below 8"),
    ],
)
def test_hearts_of_which_no_derivative_can_be_taken_are_refused(keys, frames, error, message):
    with pytest.raises(error, match=message):
        et.sensitivities(et.configure(HEART, **keys), SEGMENT, frames)
