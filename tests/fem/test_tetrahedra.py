"""Quadratic tetrahedra: shape functions, interpolation and gradients against polynomials."""

import numpy as np
import pytest

from echotruth.fem.tetrahedra import EDGES, MaterialPoints, gradient, interpolate, shape, shape_gradient


@pytest.fixture(scope="module")
def points(coarse_mesh):
    random = np.random.default_rng(1)
    n = 500
    xi = np.diff(np.sort(random.random((n, 3)), axis=1), prepend=0.0, axis=1)
    return MaterialPoints(random.integers(0, len(coarse_mesh.cells), n).astype(np.int32), xi)


@pytest.mark.parametrize("dimensions, edges", [(3, EDGES), (2, EDGES[:3])])
def test_shape_functions_are_one_at_their_node_and_zero_at_the_others(dimensions, edges):
    corners = np.vstack([np.zeros(dimensions), np.eye(dimensions)])
    nodes = np.vstack([corners, corners[edges].mean(axis=1)])
    assert np.allclose(shape(nodes), np.eye(len(nodes)), atol=1e-14)


@pytest.mark.parametrize("dimensions", [3, 2])
def test_gradients_are_those_of_the_shape_functions(points, dimensions):
    step, xi = 1e-6, points.xi[:, :dimensions]
    for axis, unit in enumerate(np.eye(dimensions)):
        slope = (shape(xi + step * unit) - shape(xi - step * unit)) / (2 * step)
        assert np.allclose(slope, shape_gradient(xi)[..., axis], atol=1e-8)


def test_a_linear_field_is_interpolated_exactly_though_the_cells_are_curved(coarse_mesh, points):
    position = interpolate(coarse_mesh.nodes, coarse_mesh.cells, points)
    matrix, shift = np.array([[1.0, 2, 3], [0, -1, 4], [2, 0, 1]]), np.array([1e-3, 0, 0])
    field = interpolate(coarse_mesh.nodes @ matrix.T + shift, coarse_mesh.cells, points)
    assert np.allclose(field, position @ matrix.T + shift, atol=1e-17)


def test_the_gradient_of_an_affine_motion_is_its_matrix(coarse_mesh, points):
    matrix = np.array([[1.1, 0.2, 0], [-0.1, 0.9, 0.3], [0, 0.1, 1.2]])
    moved = coarse_mesh.nodes @ matrix.T
    assert np.allclose(gradient(moved, coarse_mesh.nodes, coarse_mesh.cells, points), matrix, atol=1e-12)
    assert np.allclose(gradient(coarse_mesh.nodes, moved, coarse_mesh.cells, points), np.linalg.inv(matrix), atol=1e-12)


def test_values_of_any_shape_are_interpolated_by_the_shape_functions(coarse_mesh, points):
    random = np.random.default_rng(2)
    for shape_of_one in ((), (2,), (3, 4)):
        values = random.standard_normal((len(coarse_mesh.nodes), *shape_of_one))
        expected = np.einsum("pa,pa...->p...", shape(points.xi), values[coarse_mesh.cells[points.cell]])
        assert np.allclose(interpolate(values, coarse_mesh.cells, points), expected, rtol=0, atol=1e-14)


def test_the_gradient_of_a_field_is_its_derivative_along_any_direction(coarse_mesh, points):
    # Of squares and products, which curved cells do not hold exactly: what is interpolated is differentiated.
    x, y, z = coarse_mesh.nodes.T
    values, step = np.stack([x * y, y * z - x**2], axis=-1), 1e-6
    gradients = gradient(values, coarse_mesh.nodes, coarse_mesh.cells, points)
    for axis in np.eye(3):
        ends = [MaterialPoints(points.cell, points.xi + sign * step * axis) for sign in (-1, 1)]
        positions, fields = (
            [interpolate(nodal, coarse_mesh.cells, end) for end in ends] for nodal in (coarse_mesh.nodes, values)
        )
        along = np.einsum("pki,pi->pk", gradients, positions[1] - positions[0])
        assert np.allclose(along, fields[1] - fields[0], rtol=1e-6, atol=1e-6 * np.abs(along).max())
