"""Hearts driven by each of the prescribed quantities, diseased and healthy."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.config import Config, Geometry, Loop, Mechanics, Pathology
from echotruth.heart import Heart
from echotruth.loop.cycle import read_loop
from echotruth.mechanics.beat import beat
from echotruth.mechanics.derived import centroid_kinematics
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.cycle import solve
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
        return solve(equations, cycle, body.tissue.tension_scale, stiffness)
    finally:
        equations.close()


@pytest.fixture(scope="module")
def cycle():
    return read_loop(CONFIG.loop)


@pytest.fixture(scope="module")
def driven(cycle):
    return solved(cycle)


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


def test_heart_that_is_asked_for_more_than_muscle_bears_is_told_so():
    active = {"length_dependence": 2.0}
    config = CONFIG.model_copy(update={"loop": Loop(frames=20, esv_uL=6.0), "mechanics": Mechanics(active=active)})
    with pytest.raises(Diverged, match=r"T_Ca has risen to \d+ kPa, which no muscle bears: let the heart eject less"):
        solved(read_loop(config.loop), config)
