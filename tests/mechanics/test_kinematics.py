"""Axes, volumes and means of motions whose strain is known."""

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


def test_volume_ratio_of_a_scaled_wall(wall):
    mesh, _, _ = wall
    smallest, mean, rms_change = kinematics.volume_ratios(mesh, moved(mesh, np.eye(3), 1.1 * np.eye(3)))
    np.testing.assert_allclose(smallest, [1, 1.331])
    np.testing.assert_allclose(mean, [1, 1.331])
    np.testing.assert_allclose(rms_change, [0, 0.331], atol=1e-12)


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
