"""Strain of motions whose strain is known."""

import numpy as np
import pytest

from echotruth.config import Fibres, Geometry
from echotruth.fem.volume import cell_volumes
from echotruth.mechanics import fibres, kinematics
from echotruth.mechanics.geometry import left_ventricle


@pytest.fixture(scope="module")
def wall():
    mesh = left_ventricle(Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1))
    depth = fibres.wall_depth(mesh)
    axes = fibres.wall_axes(mesh, depth, fibres.CENTROID)[:, 0]
    return mesh, axes, fibres.fibre_frames(mesh, depth, Fibres(), fibres.CENTROID)[:, 0]


def moved(mesh, *gradients):
    return np.stack([mesh.nodes @ gradient.T - mesh.nodes for gradient in gradients])


def turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_rotation_is_no_strain(wall):
    mesh, axes, frames = wall
    motion = kinematics.centroid_strains(mesh, moved(mesh, turn(0.4), turn(2.0)), axes, frames)
    for name, values in motion.items():
        np.testing.assert_allclose(values if "strain" in name else 0, 0, atol=1e-12)


def test_widening_is_circumferential_and_lengthening_longitudinal(wall):
    mesh, axes, frames = wall
    wide, long = 1.2, 0.9
    stretched = moved(mesh, np.diag([wide, wide, long]))
    strains = kinematics.centroid_strains(mesh, stretched, axes, frames)["strain_unloaded"][0]
    np.testing.assert_allclose(strains[:, 1], (wide**2 - 1) / 2, atol=1e-12)
    np.testing.assert_allclose(strains[:, [3, 5]], 0, atol=1e-12)
    slope = axes[:, 2, 2] ** 2
    expected = (wide**2 * (1 - slope) + long**2 * slope - 1) / 2
    np.testing.assert_allclose(strains[:, 2], expected, atol=1e-12)


def test_strain_since_ed_forgets_what_came_before(wall):
    mesh, axes, frames = wall
    before = np.array([[1.1, 0.1, 0], [0, 0.9, 0.2], [0, 0.1, 1.05]])
    after = np.diag([1.1, 1.0, 0.8]) @ before
    motion = kinematics.centroid_strains(mesh, moved(mesh, before, after), axes, frames)
    np.testing.assert_allclose(motion["strain"][0], 0, atol=1e-12)
    np.testing.assert_allclose(motion["strain"][1][:, :3].sum(axis=1), (1.21 + 1 + 0.64 - 3) / 2, atol=1e-12)
    np.testing.assert_allclose(motion["fibre_strain"][1][:, :3].sum(axis=1), (1.21 + 1 + 0.64 - 3) / 2, atol=1e-12)


def test_deformed_axes_stay_orthonormal_and_follow_the_material(wall):
    _, axes, frames = wall
    gradient = np.broadcast_to(np.array([[1.1, 0.1, 0], [0, 0.9, 0.2], [0, 0.1, 1.05]]), axes.shape)
    for deformed in (kinematics.deformed_wall_axes(axes, gradient), kinematics.deformed_fibre_frames(frames, gradient)):
        np.testing.assert_allclose(
            deformed @ deformed.swapaxes(-1, -2), np.broadcast_to(np.eye(3), axes.shape), atol=1e-12
        )
        np.testing.assert_allclose(np.linalg.det(deformed), 1)
    fibre = np.einsum("cij,cj->ci", gradient, frames[:, 0])
    followed = kinematics.deformed_fibre_frames(frames, gradient)[:, 0]
    np.testing.assert_allclose(np.cross(fibre, followed), 0, atol=1e-12)


def test_fibre_strain_is_the_change_of_length_along_the_fibre(wall):
    mesh, axes, frames = wall
    gradient = np.array([[1.1, 0.1, 0], [0, 0.9, 0.2], [0, 0.1, 1.05]])
    strains = kinematics.centroid_strains(mesh, moved(mesh, gradient), axes, frames)["fibre_strain_unloaded"][0]
    length = np.linalg.norm(frames[:, 0] @ gradient.T, axis=1)
    np.testing.assert_allclose(strains[:, 0], (length**2 - 1) / 2)
    sheet, normal = gradient @ frames[:, 1, :, None], gradient @ frames[:, 2, :, None]
    np.testing.assert_allclose(strains[:, 5], np.sum(sheet * normal, axis=(1, 2)) / 2, atol=1e-12)


def test_volume_ratio_of_a_scaled_wall(wall):
    mesh, _, _ = wall
    smallest, mean = kinematics.volume_ratios(mesh, moved(mesh, np.eye(3), 1.1 * np.eye(3)))
    np.testing.assert_allclose(smallest, [1, 1.331])
    np.testing.assert_allclose(mean, [1, 1.331])


def test_layers_add_up_to_the_wall(wall):
    mesh, _, _ = wall
    rng = np.random.default_rng(0)
    values, layer = rng.normal(size=(2, len(mesh.cells), 6)), rng.integers(1, 6, len(mesh.cells))
    weight = cell_volumes(mesh.nodes, mesh.cells)
    layers = kinematics.group_means(values, weight, layer, 6)
    assert np.isnan(layers[:, 5]).all()
    share = np.array([weight[layer == k].sum() for k in range(1, 6)]) / weight.sum()
    mean, sd = kinematics.weighted_mean_sd(values, weight)
    np.testing.assert_allclose(np.einsum("l,flc->fc", share, layers[:, :5]), mean)
    assert sd == pytest.approx(np.ones((2, 6)), abs=0.2)
