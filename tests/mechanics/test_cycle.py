"""Hearts driven by each of the prescribed quantities, diseased and healthy, large and small, and those refused."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from echotruth.config import Config, Geometry, Loop, Mechanics, Pathology
from echotruth.config.building import configure
from echotruth.heart import Heart
from echotruth.loop.cycle import heart_cycle, read_loop
from echotruth.loop.phases import CONTRACTION, FILLING
from echotruth.mechanics.beat import beat, outputs
from echotruth.mechanics.derived import centroid_kinematics
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.physiology import measured_heart
from echotruth.mechanics.solver.cycle import filled_to_end_diastole, solve
from echotruth.mechanics.solver.newton import Diverged
from echotruth.mechanics.solver.wall import equilibrium, wall

COARSE = Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1)
ELASTIC = Mechanics(
    viscosity_Pa_s=0.0, pericardium={"dashpot_kPa_s_per_mm": 0.0}, active={"shortening_velocity_max_per_s": None}
)
CONFIG = Config(geometry=COARSE, loop=Loop(frames=12), mechanics=ELASTIC)


def solved(cycle, config=CONFIG, stiffness=None):
    body = wall(config, left_ventricle(config.geometry))
    equations = equilibrium(config, body)
    try:
        return solve(equations, cycle, body.tissue.tension_scale, stiffness)[0]
    finally:
        equations.close()


@pytest.fixture(scope="module")
def cycle():
    return read_loop(CONFIG.loop)


@pytest.fixture(scope="module")
def driven(cycle):
    return solved(cycle)


def test_beats_are_solved_one_after_the_other_and_the_first_is_that_of_a_clip_of_its_own(cycle, driven):
    beats = [{}, {"length": 0.8, "stroke": 0.7}, {"length": 1.2, "stroke": 1.1}]
    config = CONFIG.model_copy(update={"loop": Loop(frames=36, beats=beats)})
    arrays, starts = beat(config), config.loop.beat_starts
    mechanics, body = arrays["mechanics"], wall(CONFIG, left_ventricle(COARSE))
    np.testing.assert_allclose(mechanics["time"], np.arange(36) * cycle.time[1])
    assert starts == [0, 12, 22, 36]
    np.testing.assert_allclose(mechanics["volume"], heart_cycle(config).volume, rtol=1e-6)
    alone = outputs(CONFIG, body, driven, cycle)
    moved, expected = mechanics["displacement"], alone["mechanics"]["displacement"]
    largest = np.ptp(expected, axis=0).max()
    # Without viscosity the heart is at the end of each beat, and so at that of the clip, where it was at its beginning.
    np.testing.assert_allclose(moved[starts[1:-1]], moved[[0, 0]], rtol=0, atol=1e-4 * largest)
    np.testing.assert_allclose(moved[:12], expected, rtol=0, atol=1e-6 * largest)
    assert mechanics["es_frame"] == alone["mechanics"]["es_frame"]
    for start, end in pairwise(starts):
        phase = mechanics["phase"][start:end]
        assert phase[0] == CONTRACTION and phase[-1] == FILLING and np.count_nonzero(np.diff(phase)) == 3
    found, bounds = measured_heart(arrays, config)
    expected, its_bounds = measured_heart(alone, CONFIG)
    of_clip = ("volume_ratio_min", "twist_max_deg", "tension_min_kPa", "loop_error_max")
    for name in its_bounds.keys() - of_clip:
        assert bounds[name] == pytest.approx(its_bounds[name], rel=1e-5, abs=1e-7), name
    assert found["cardiac_output"] == pytest.approx(expected["cardiac_output"], rel=1e-6)
    assert found["twist"].shape == (36,) and found["volume_ratio_min"] < expected["volume_ratio_min"]


def test_volume_and_tension_give_back_the_pressure(cycle, driven):
    other = replace(cycle, prescribed="volume", pressure=None, tension=driven.active_tension)
    back = solved(other, stiffness=driven.stiffness)
    np.testing.assert_allclose(back.pressure, cycle.pressure, rtol=1e-4)
    assert np.all(np.isnan(back.pressure_target))
    difference = np.abs(back.displacement - driven.displacement).max()
    assert difference < 1e-4 * np.abs(driven.displacement).max()


def test_pressure_alone_fills_the_passive_heart_as_its_volume_does(cycle, driven):
    """Without tension the volume that bears a pressure is the only one."""
    none, pressure = np.zeros(4), cycle.pressure[0] * np.array([1.0, 1.5, 1.2, 0.5])
    slack = replace(cycle, time=cycle.time[:4], tension=none)
    filled = solved(replace(slack, prescribed="pressure", pressure=pressure, volume=None), stiffness=driven.stiffness)
    assert filled.volume[0] == pytest.approx(driven.volume[0], rel=1e-7)
    back = solved(replace(slack, prescribed="volume", pressure=None, volume=filled.volume), stiffness=driven.stiffness)
    np.testing.assert_allclose(back.pressure, pressure, rtol=1e-6)


@pytest.mark.slow
def test_viscosity_lets_a_wall_that_weakens_as_it_shortens_go_on(cycle):
    """With a tension that does not fall with length (beta = 0) no equilibrium neighbours that of early ejection."""
    constant = Mechanics(active={"length_dependence": 0.0})  # and the viscosity that stands by default
    config = CONFIG.model_copy(update={"mechanics": constant, "loop": Loop()})
    beta_zero = solved(read_loop(config.loop), config)
    np.testing.assert_allclose(beta_zero.volume, beta_zero.volume_target, rtol=1e-7)


def test_infarct_stretches_where_healthy_wall_shortens():
    diseased = CONFIG.model_copy(update={"pathology": Pathology(infarct={"segments": [7, 12], "stiffness_scale": 2.0})})
    arrays = beat(diseased)
    es = int(arrays["mechanics"]["es_frame"])
    fibre = centroid_kinematics(Heart.of(arrays, diseased), [es])["fibre_strain"][0, :, 0]
    region = arrays["pathology"]["region"]
    assert fibre[region == 1].mean() > 0
    assert fibre[region == 0].mean() < -0.08


@pytest.mark.slow
def test_heart_that_is_larger_by_a_factor_moves_alike():
    """What has a length apart from the shape, springs and dashpots over an area, is scaled too."""
    factor, support = 1.3, CONFIG.mechanics.pericardium
    soft = {key: value / factor for key, value in support.model_dump().items()}
    small = configure(CONFIG, loop={"frames": 6})
    large = configure(small, geometry={"scale": factor}, mechanics={"pericardium": soft})
    of_small, of_large = (beat(config)["mechanics"] for config in (small, large))
    np.testing.assert_allclose(of_large["volume"], factor**3 * of_small["volume"], rtol=1e-6)
    np.testing.assert_allclose(of_large["active_tension"], of_small["active_tension"], rtol=1e-4, atol=1.0)
    moved = factor * of_small["displacement"]
    np.testing.assert_allclose(of_large["displacement"], moved, rtol=0, atol=1e-5 * np.abs(moved).max())


@pytest.mark.parametrize("shape", [{"dilation": 1.2}, {"elongation": 0.8}, {"endo_radius_mm": 1.6, "scale": 0.7}, {}])
def test_default_loop_is_as_much_larger_as_the_cavity_of_the_mesh(shape):
    config = configure(CONFIG, geometry=shape)
    ratio = unloaded_volume(config) / unloaded_volume(CONFIG)
    # The mesh is made of quadratic elements, of which few go around and along the cavity.
    assert heart_cycle(config).edv == pytest.approx(ratio * read_loop(CONFIG.loop).edv, rel=5e-4)
    healthy = configure(config, loop={"kind": "circulation"})
    undilated = ratio / shape.get("dilation", 1.0) ** 3
    assert heart_cycle(healthy).edv == pytest.approx(undilated * read_loop(CONFIG.loop).edv, rel=5e-4)
    given = configure(config, loop={"edv_uL": 60.0, "esv_uL": 20.0})
    np.testing.assert_array_equal(heart_cycle(given).volume, read_loop(given.loop).volume)


def unloaded_volume(config):
    equations = equilibrium(config, wall(config, left_ventricle(config.geometry)))
    try:
        return equations.volume(equations.unloaded_state(0.0))
    finally:
        equations.close()


def filled(config):
    equations = equilibrium(config, wall(config, left_ventricle(config.geometry)))
    try:
        return filled_to_end_diastole(equations, heart_cycle(config))
    finally:
        equations.close()


def refusal(config):
    with pytest.raises(Diverged) as refused:
        beat(config)
    return str(refused.value)


def test_heart_that_cannot_be_filled_is_told_a_volume_and_a_size_that_work():
    small = configure(CONFIG, geometry={"scale": 1.3}, loop={"edv_uL": 50.0})
    told = refusal(small)
    volume, factor = map(float, re.search(r"edv_uL of ([\d.]+) or more, or ([\d.]+) of this", told).groups())
    assert "geometry.scale = 1.3 (0.88 to 1.12)" in told
    for remedy in ({"loop.edv_uL": volume}, {"geometry.scale": 1.3 * factor}):
        filled(configure(small, **remedy))


def test_wall_of_rubber_is_filled_and_one_too_soft_for_the_pressure_is_told_so():
    """Rubber gives way at a pressure in proportion to C, which in the human is above where the search for C starts."""
    rubber = configure(CONFIG, geometry={"preset": "human"}, mechanics={"material": {"law": "neo_hooke"}})
    assert filled(rubber).load.volume == pytest.approx(heart_cycle(rubber).edv, rel=1e-7)
    told = refusal(configure(rubber, mechanics={"material": {"stiffness_kPa": 1.0}}))
    assert "C = 1 kPa does not hold the end-diastolic 0.933 kPa: give a larger mechanics.material.stiffness_kPa" in told


@pytest.mark.slow
def test_heart_that_is_asked_for_more_than_muscle_bears_is_told_how_far_it_may_eject():
    active = {"length_dependence": 2.0}
    config = CONFIG.model_copy(update={"loop": Loop(frames=12, esv_uL=6.0), "mechanics": Mechanics(active=active)})
    told = refusal(config)
    assert re.search(r"asks for a T_Ca of \d+ kPa, and muscle bears 200: give loop\.esv_uL", told)
    (remaining,) = re.search(r"esv_uL of ([\d.]+) times", told).groups()
    borne = beat(configure(config, loop={"esv_uL": float(remaining) * heart_cycle(config).edv * 1e9}))["mechanics"]
    assert borne["active_tension"].max() < 200e3


@pytest.mark.slow
def test_muscle_that_works_against_itself_is_told_the_share_that_does_not():
    even = Config(
        geometry=COARSE, loop=Loop(frames=12), mechanics={"active": {"normal_share": 0.35, "sheet_share": 0.35}}
    )
    told = refusal(even)
    (share,) = re.search(r"normal_share of ([\d.]+) or less", told).groups()
    borne = beat(configure(even, mechanics={"active": {"normal_share": float(share)}}))["mechanics"]
    assert borne["active_tension"].max() < 200e3
