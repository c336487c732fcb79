"""Quadratic tetrahedra: shape functions, interpolation and gradients.

Everything that moves with the wall - scatterers, pixels, tracked points - is a
material point, given by a tetrahedron and local coordinates xi in it; the shape functions N
carry it to x(xi) = sum_a N_a(xi) x_a.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.kernels import kernels

Integers = NDArray[np.int32]

EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
"""Vertices of the edge of each mid-edge node 4..9, in VTK's order."""

_VERTEX_XI = np.vstack([np.zeros(3), np.eye(3)])
NODE_XI = np.vstack([_VERTEX_XI, _VERTEX_XI[EDGES].mean(axis=1)])
"""Local coordinates of the nodes of a tetrahedron."""

PARTS = np.array(
    [(0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3), (4, 9, 5, 6), (4, 9, 6, 7), (4, 9, 7, 8), (4, 9, 8, 5)]
)
"""Nodes of the eight straight tetrahedra of a quadratic one: four at its corners, and four around the line 49."""


@dataclass(frozen=True)
class Mesh:
    """A ventricle of quadratic (isoparametric) tetrahedra, unloaded.

    Attributes
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)
        Nodes of each tetrahedron: four vertices, then the mid-edge nodes of `EDGES`; positively oriented.
    endo, epi, base : ndarray of shape (n_facets, 6)
        Quadratic triangles of the boundary: three vertices, then the mid-edge nodes of 01, 12, 20;
        their normals point out of the wall.
    fibre, sheet : ndarray of shape (n_cells, 3), optional
        Directions of fibres and sheets that came with the mesh, of any length.
    right_endo : ndarray of shape (n_facets, 6)
        Triangles of the endocardium of a right ventricle; none in a left ventricle alone.
    """

    nodes: Floats
    cells: Integers
    endo: Integers
    epi: Integers
    base: Integers
    fibre: Floats | None = None
    sheet: Floats | None = None
    right_endo: Integers = field(default_factory=lambda: np.empty((0, 6), np.int32))


@dataclass(frozen=True)
class MaterialPoints:
    """Points fixed in the material.

    Attributes
    ----------
    cell : ndarray of shape (n,)
        Tetrahedron of each point; -1 is outside the mesh.
    xi : ndarray of shape (n, 3)
        Local coordinates in the tetrahedron with corners 000, 100, 010, 001.
    """

    cell: Integers
    xi: Floats

    def __len__(self) -> int:
        return len(self.cell)


def shape(xi: Floats) -> Floats:
    """Quadratic shape functions of a tetrahedron, or of a triangle.

    With barycentric coordinates L: N_a = L_a (2 L_a - 1) of a vertex, 4 L_a L_b of the node between a and b.

    Parameters
    ----------
    xi : ndarray of shape (n, 3), or (n, 2) in a triangle
        Local coordinates.

    Returns
    -------
    ndarray of shape (n, 10), or (n, 6)
        Zienkiewicz & Taylor, The Finite Element Method, vol. 1, section 6.
    """
    corner, (a, b) = _barycentric(xi), _edges(xi)
    return np.hstack([corner * (2 * corner - 1), 4 * corner[:, a] * corner[:, b]])


def shape_gradient(xi: Floats) -> Floats:
    """dN/dxi, derivatives of the shape functions by the local coordinates.

    Parameters
    ----------
    xi : ndarray of shape (n, 3), or (n, 2) in a triangle

    Returns
    -------
    ndarray of shape (n, 10, 3), or (n, 6, 2)
    """
    corner, (a, b) = _barycentric(xi)[..., None], _edges(xi)
    dcorner_dxi = np.vstack([-np.ones(xi.shape[1]), np.eye(xi.shape[1])])
    middle = 4 * (corner[:, a] * dcorner_dxi[b] + corner[:, b] * dcorner_dxi[a])
    return np.concatenate([(4 * corner - 1) * dcorner_dxi, middle], axis=1)


def _barycentric(xi: Floats) -> Floats:
    return np.column_stack([1 - xi.sum(axis=1), xi])


def _edges(xi: Floats) -> NDArray[np.int_]:
    """Vertices (2, n) of the edges of a tetrahedron, or of a triangle, which has the first three of them."""
    return EDGES[: 3 * (xi.shape[1] - 1)].T


def interpolate(values: Floats, cells: Integers, points: MaterialPoints) -> Floats:
    """Nodal values interpolated to material points by the shape functions.

    Parameters
    ----------
    values : ndarray of shape (n_nodes, ...)
    cells : ndarray of shape (n_cells, 10)
    points : MaterialPoints of length n
        All inside the mesh.

    Returns
    -------
    ndarray of shape (n, ...), in the unit of `values`
    """
    columns = np.ascontiguousarray(values, float).reshape(len(values), -1)
    return kernels().interpolate(columns, *_contiguous(cells, points)).reshape(len(points), *values.shape[1:])


def gradient(values: Floats, positions: Floats, cells: Integers, points: MaterialPoints) -> Floats:
    """Gradient of nodal values by position at material points, dv/dx = dv/dxi (dx/dxi)^-1.

    Parameters
    ----------
    values : ndarray of shape (n_nodes, ...)
    positions : ndarray of shape (n_nodes, 3), m
        Of the nodes in the state by which to differentiate.
    cells : ndarray of shape (n_cells, 10)
    points : MaterialPoints of length n

    Returns
    -------
    ndarray of shape (n, ..., 3), unit of `values` per metre
        The deformation gradient, where `values` are the nodes' deformed positions.
    """
    columns = np.ascontiguousarray(values, float).reshape(len(values), -1)
    gradients = kernels().gradient(columns, np.ascontiguousarray(positions, float), *_contiguous(cells, points))
    return gradients.reshape(len(points), *values.shape[1:], 3)


def jacobian(positions: Floats, cells: Integers, points: MaterialPoints) -> Floats:
    """dx/dxi, derivative of position by local coordinates, at material points.

    Parameters
    ----------
    positions : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)
    points : MaterialPoints of length n

    Returns
    -------
    ndarray of shape (n, 3, 3), m
        Its determinant is the volume of tissue per volume of local coordinates.
    """
    return np.swapaxes(positions[cells[points.cell]], 1, 2) @ shape_gradient(points.xi)


def _contiguous(cells: Integers, points: MaterialPoints) -> tuple[Integers, Integers, Floats]:
    """Cells, and cell and local coordinates of points, each of one type, so that kernels are compiled once."""
    cell = np.ascontiguousarray(points.cell, np.int32)
    return np.ascontiguousarray(cells, np.int32), cell, np.ascontiguousarray(points.xi, float)


def straight_triangles(facets: Integers) -> Integers:
    """Split each quadratic triangle (n, 6) into four straight ones (4 n, 3), through the middles of its edges."""
    return facets[:, [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]].reshape(-1, 3)
