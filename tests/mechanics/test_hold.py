"""A solved heart that is moved as a whole keeps its shape, and stays where it is held."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from echotruth.config import Config, Geometry
from echotruth.mechanics.beat import beat
from echotruth.mechanics.geometry import epicardial_apex, left_ventricle
from echotruth.mechanics.hold import held
from echotruth.mechanics.solver.surroundings import circumferential, surface_matrix

MESH = left_ventricle(Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1))


def twisted(frames=4, bend=0.03):
    """A wall that twists by 10 deg towards its apex, which moves aside and to the base, more from frame to frame."""
    x, y, z = MESH.nodes.T
    depth, growth = z / z.min(), np.linspace(0, 1, frames)[:, None]
    turn = -np.radians(10) * depth * growth
    moved = np.stack(
        [
            x * np.cos(turn) - y * np.sin(turn) + bend * 1e-2 * depth * growth,
            x * np.sin(turn) + y * np.cos(turn),
            z * (1 - 0.15 * growth),
        ],
        axis=-1,
    )
    return moved - MESH.nodes


def test_a_held_heart_has_its_shape_and_its_apex_in_place():
    displacement = twisted()
    kept = held(MESH, displacement, "apex")
    apex = epicardial_apex(MESH)
    np.testing.assert_allclose(kept[:, apex], np.broadcast_to(kept[0, apex], (4, 3)), atol=1e-15)
    np.testing.assert_allclose(kept[0], displacement[0], atol=1e-15)
    for before, after in zip(MESH.nodes + displacement, MESH.nodes + kept, strict=True):
        pairs = np.random.default_rng(0).integers(len(before), size=(2, 500))
        ways = [np.linalg.norm(one[pairs[0]] - one[pairs[1]], axis=1) for one in (before, after)]
        np.testing.assert_allclose(*ways, atol=1e-14)
    assert np.ptp(kept[-1, np.unique(MESH.base), 2]) > 1e-4  # the base tilts
    np.testing.assert_array_equal(held(MESH, displacement, "base"), displacement)


def test_a_held_heart_does_not_know_how_it_was_turned_tilted_and_shifted_before():
    displacement = twisted()
    other = MESH.nodes + displacement
    for frame, vector in enumerate(0.2 * np.random.default_rng(1).normal(size=(3, 3)), 1):
        other[frame] = Rotation.from_rotvec(vector).apply(other[frame]) + 1e-3 * vector
    np.testing.assert_allclose(held(MESH, other - MESH.nodes, "apex"), held(MESH, displacement, "apex"), atol=1e-12)


def test_springs_around_a_held_heart_bear_no_torque_so_that_base_and_apex_turn_against_each_other():
    kept = held(MESH, twisted(bend=0.0), "apex")
    positions = MESH.nodes + kept[-1]
    start = np.arctan2(MESH.nodes[:, 1], MESH.nodes[:, 0])
    turn = np.angle(np.exp(1j * (np.arctan2(positions[:, 1], positions[:, 0]) - start)))
    z = MESH.nodes[:, 2] / MESH.nodes[:, 2].min()
    assert turn[z < 0.1].mean() > np.radians(2) and turn[(z > 0.8) & (z < 0.9)].mean() < -np.radians(3)
    torques = [abs(torque(motion)) for motion in (kept[-1], twisted(bend=0.0)[-1])]
    assert torques[0] < 5e-3 * torques[1]


@pytest.mark.slow
def test_what_is_held_changes_no_strain_and_no_tension():
    counts = {"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1}
    base, apex = (
        beat(Config(geometry=counts, loop={"frames": 6}, mechanics={"hold": one})) for one in ("base", "apex")
    )
    np.testing.assert_allclose(apex["kinematics"]["strain"], base["kinematics"]["strain"], atol=1e-6)
    np.testing.assert_array_equal(apex["mechanics"]["cell_tension"], base["mechanics"]["cell_tension"])
    assert np.ptp(apex["mechanics"]["displacement"] - base["mechanics"]["displacement"], axis=1).max() > 1e-5


def torque(displacement):
    """Of springs of one stiffness on the epicardium, along the way around the axis, m^4."""
    matrix = surface_matrix(MESH, MESH.epi, circumferential)
    arm = np.cross([0.0, 0.0, 1.0], MESH.nodes)
    ways = displacement[MESH.epi].reshape(-1, 18), arm[MESH.epi].reshape(-1, 18)
    return np.einsum("frs,fr,fs->", matrix, *ways)
