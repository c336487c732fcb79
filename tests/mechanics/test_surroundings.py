"""Pericardium and elastic base against integrals known by hand, differences and the limits of their springs."""

import numpy as np
import pytest

from echotruth.config import Config, Geometry, Loop, Mechanics
from echotruth.loop.cycle import read_loop
from echotruth.mechanics.beat import beat, unloaded_wall
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.equilibrium import Load, PreviousState, State
from echotruth.mechanics.solver.stress_point import VOLUMETRIC
from echotruth.mechanics.solver.surroundings import axial, circumferential, normal, surface_matrix
from echotruth.mechanics.solver.wall import equilibrium
from echotruth.mechanics.twist import slice_rotation
from validation.heart import solved_heart
from validation.work import balance

INNER, RADIUS = 2e-3, 3e-3
COARSE = Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1)
ALONE = {
    "active": {"sheet_share": 0.0, "normal_share": 0.0},
    "pericardium": {"spring_kPa_per_mm": 0.0, "dashpot_kPa_s_per_mm": 0.0},
    "base": "radial_free",
}
"""A heart without surroundings whose fibres pull along themselves alone."""
EVERYTHING = {
    "active": {"sheet_share": 0.3, "normal_share": 0.2},
    "pericardium": {"spring_kPa_per_mm": 2.0, "dashpot_kPa_s_per_mm": 0.01},
    "base": "elastic",
    "elastic_base": {"axial_spring_kPa_per_mm": 20.0, "circumferential_spring_kPa_per_mm": 3.0},
}


def total_force(matrix, motion):
    """Work of a motion (n_facets, 6, 3) against springs that it stretches by itself."""
    motion = motion.reshape(-1, 18)
    return np.einsum("frs,fr,fs->", matrix, motion, motion)


def test_pericardium_pushes_back_by_the_normal_part_of_a_shift(half_sphere):
    """Over half a sphere the mean square of any component of the normal is a third: 2 pi R^2 / 3 in each direction."""
    matrix = surface_matrix(half_sphere, half_sphere.epi, normal)
    np.testing.assert_allclose(matrix, matrix.transpose(0, 2, 1), atol=1e-18)
    for axis in range(3):
        shift = np.tile(np.eye(3)[axis], (len(half_sphere.epi), 6, 1))
        assert total_force(matrix, shift) == pytest.approx(2 * np.pi * RADIUS**2 / 3, rel=1e-3)


def test_base_resists_axial_motion_by_its_area_and_turning_by_its_polar_moment(half_sphere):
    mesh = half_sphere
    rise = np.tile([0.0, 0.0, 1.0], (len(mesh.base), 6, 1))
    turn = np.cross([0.0, 0.0, 1.0], mesh.nodes[mesh.base])
    area, moment = np.pi * (RADIUS**2 - INNER**2), np.pi / 2 * (RADIUS**4 - INNER**4)
    assert total_force(surface_matrix(mesh, mesh.base, axial), rise) == pytest.approx(area, rel=1e-3)
    assert total_force(surface_matrix(mesh, mesh.base, circumferential), turn) == pytest.approx(moment, rel=1e-3)
    assert total_force(surface_matrix(mesh, mesh.base, axial), turn) == pytest.approx(0, abs=1e-20)
    assert total_force(surface_matrix(mesh, mesh.base, circumferential), rise) == pytest.approx(0, abs=1e-20)


def test_tangent_of_everything_together_is_the_derivative_of_the_forces(monkeypatch):
    """Central differences of the residual, with the pressure of each cell following the volume."""
    config = Config(geometry=COARSE, mechanics=Mechanics.model_validate(EVERYTHING | {"viscosity_Pa_s": 50.0}))
    wall = unloaded_wall(config, read_loop(config.loop))
    equations, rng, matrices = equilibrium(config, wall), np.random.default_rng(3), []
    monkeypatch.setattr(equations._solver, "factor", matrices.append)
    monkeypatch.setattr(equations, "solve", lambda right: right)
    n = equations.assembly.n_equations
    before, state, load = (
        State(2e-5 * rng.normal(size=n), 1e3 * rng.normal(size=len(wall.mesh.cells)), 1.1e3, 3e4),
        State(2e-5 * rng.normal(size=n), 1e3 * rng.normal(size=len(wall.mesh.cells)), 1.1e3, 3e4),
        Load(5e3, 4e-8),
    )
    equations.rest_at(before)
    equations.set_previous(PreviousState(before, 3e-3))
    equations.linearize(state, load, None)
    upper = matrices[0].toarray()
    tangent = np.triu(upper) + np.triu(upper, 1).T
    change, step = rng.normal(size=n), 1e-10
    gradient = equations._response.force[:, VOLUMETRIC]
    growth = np.sum(gradient * equations.assembly.of_cells(change), axis=1) / equations.unloaded_volume
    forces = [
        equations.residual(
            State(
                state.solution + side * step * change,
                state.cell_pressure + side * step * equations.law.bulk_modulus * growth,
                *(state.stiffness, state.tension),
            ),
            load,
            None,
        ).force
        for side in (1, -1)
    ]
    slope = (forces[0] - forces[1]) / (2 * step)
    assert np.abs(tangent @ change - slope).max() < 1e-5 * np.abs(slope).max()
    equations.close()


@pytest.mark.slow
def test_pericardium_is_at_rest_at_end_diastole_and_takes_up_work_after_it():
    loop = Loop(frames=6)
    pericardium = {"spring_kPa_per_mm": 5.0, "dashpot_kPa_s_per_mm": 0.01}
    free, held = (
        beat(Config(geometry=COARSE, loop=loop, mechanics=Mechanics(pericardium=p, hold="base")))["mechanics"]
        for p in (ALONE["pericardium"], pericardium)
    )
    np.testing.assert_array_equal(held["displacement"][0], free["displacement"][0])
    assert held["stiffness"] == free["stiffness"]
    es = int(held["es_frame"])
    assert held["active_tension"][es] > 1.01 * free["active_tension"][es]
    mesh = left_ventricle(COARSE)
    unit = surface_matrix(mesh, mesh.epi, normal)
    motion = [total_force(unit, (one["displacement"][es] - one["displacement"][0])[mesh.epi]) for one in (held, free)]
    assert motion[0] < 0.97 * motion[1]


def test_pressure_does_the_work_that_wall_and_surroundings_take_up():
    """Virtual work of every frame, by energies written down anew, with every means at once."""
    mechanics = Mechanics.model_validate(EVERYTHING | {"viscosity_Pa_s": 20.0})
    solved = solved_heart(Config(geometry=COARSE, loop=Loop(frames=10), mechanics=mechanics))
    works = balance(solved)
    assert works.error < 1e-6
    share = np.abs(works.wall[:, 4]).max() / np.abs(works.blood).max()
    assert share > 0.01
    assert works.loop[5] > 0.0


@pytest.mark.slow
def test_a_dashpot_alone_delays_and_a_slow_beat_does_not_feel_it():
    """Its force falls as the rate: at a tenth of the heart rate the tension of the free heart comes back."""

    def tension(rate, dashpot):
        wall = Mechanics(
            pericardium={"spring_kPa_per_mm": 0.0, "dashpot_kPa_s_per_mm": dashpot},
            viscosity_Pa_s=0.0,
            active={"shortening_velocity_max_per_s": None},
        )
        config = Config(geometry=COARSE, loop=Loop(frames=6, heart_rate_per_min=rate), mechanics=wall)
        return beat(config)["mechanics"]["active_tension"]

    free, fast, slow = tension(500.0, 0.0), tension(500.0, 0.05), tension(50.0, 0.05)
    excess = np.abs(fast - free).max()
    assert excess > 0.02 * free.max()
    assert np.abs(slow - free).max() < 0.15 * excess


def base_motion(axial_spring, circumferential_spring):
    """Rotation of the inner less that of the outer rim of the base (rad), and the largest axial motion (m), at ES."""
    springs = {"axial_spring_kPa_per_mm": axial_spring, "circumferential_spring_kPa_per_mm": circumferential_spring}
    mechanics = Mechanics(base="elastic", elastic_base=springs, hold="base")
    mesh, heart = left_ventricle(COARSE), beat(Config(geometry=COARSE, loop=Loop(frames=6), mechanics=mechanics))
    displacement, es = heart["mechanics"]["displacement"], int(heart["mechanics"]["es_frame"])
    rims = (np.intersect1d(mesh.base, side) for side in (mesh.endo, mesh.epi))
    endo, epi = (slice_rotation((mesh.nodes + displacement[[0, es]])[:, rim, :2])[1] for rim in rims)
    moved = displacement[es] - displacement[0]
    return endo - epi, np.abs(moved[np.unique(mesh.base), 2]).max()


@pytest.mark.slow
def test_base_on_soft_springs_shears_and_lifts_and_on_stiff_ones_does_neither():
    """Nothing else resists turning: the springs balance each other, and the rims turn against one another."""
    (soft, lifted), (stiff, held) = base_motion(5.0, 0.5), base_motion(1e5, 1e4)
    assert abs(soft) > 5 * abs(stiff)
    assert lifted > 1000 * held
    assert lifted > 1e-5
