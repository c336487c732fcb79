"""Volume and follower load of the cavity."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.cavity import cavity_volume, volume_gradient, volume_hessian


@pytest.fixture(scope="module")
def mesh():
    return left_ventricle(Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1))


def derivatives(nodes, endo):
    return volume_gradient(nodes, endo), volume_hessian(nodes, endo)


def shaken(mesh, seed=0, size=2e-5):
    return mesh.nodes + size * np.random.default_rng(seed).normal(size=mesh.nodes.shape)


def test_volume_of_a_half_sphere():
    sphere = Geometry(endo_radius_mm=2.0, endo_length_mm=2.0, wall_mm=1.0, apex_wall_mm=1.0, base_mm=0.0)
    mesh = left_ventricle(sphere)
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(2 / 3 * np.pi * 8e-9, rel=1e-4)


def test_gradient_is_the_derivative_of_the_volume(mesh):
    nodes, change = shaken(mesh), shaken(mesh, 1) - mesh.nodes
    gradient, _ = derivatives(nodes, mesh.endo)
    slope = sum(side * cavity_volume(nodes + side * 1e-2 * change, mesh.endo) for side in (1, -1)) / 2e-2
    assert np.sum(gradient * change[mesh.endo]) == pytest.approx(slope, rel=1e-9)


def test_hessian_is_the_derivative_of_the_gradient_and_symmetric(mesh):
    nodes, change = shaken(mesh), shaken(mesh, 1) - mesh.nodes
    _, hessian = derivatives(nodes, mesh.endo)
    ends = [derivatives(nodes + side * 1e-2 * change, mesh.endo)[0] for side in (1, -1)]
    slope = (ends[0] - ends[1]).reshape(len(mesh.endo), 18) / 2e-2
    predicted = np.einsum("frc,fc->fr", hessian, change[mesh.endo].reshape(len(mesh.endo), 18))
    np.testing.assert_allclose(predicted, slope, atol=1e-10 * np.abs(slope).max())
    np.testing.assert_array_equal(hessian, hessian.swapaxes(1, 2))
