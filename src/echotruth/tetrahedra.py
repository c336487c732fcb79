"""Quadratic tetrahedra: shape functions, interpolation and gradients.

Everything that moves with the wall - scatterers, pixels, tracked points - is a
material point, named by a tetrahedron and local coordinates in it, and carried
by the shape functions here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]

EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
"""Vertices beside each mid-edge node 4..9; the order is VTK's."""


@dataclass(frozen=True)
class Mesh:
    """A ventricle of quadratic (isoparametric) tetrahedra, unloaded.

    Attributes
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)
        Nodes of each tetrahedron: four vertices, then the middles of `EDGES`; positively oriented.
    endo, epi, base : ndarray of shape (n_facets, 6)
        Quadratic triangles of the boundary: three vertices, then the middles of edges 01, 12, 20;
        their normals point out of the wall.
    fibre, sheet : ndarray of shape (n_cells, 3), optional
        Directions of fibres and sheets that came with the mesh, of any length.
    """

    nodes: Floats
    cells: Integers
    endo: Integers
    epi: Integers
    base: Integers
    fibre: Floats | None = None
    sheet: Floats | None = None


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
    """Quadratic shape functions at local coordinates.

    Parameters
    ----------
    xi : ndarray of shape (n, 3)

    Returns
    -------
    ndarray of shape (n, 10)
        Zienkiewicz & Taylor, The Finite Element Method, vol. 1, section 6.
    """
    corner = _barycentric(xi)
    middle = 4 * corner[:, EDGES[:, 0]] * corner[:, EDGES[:, 1]]
    return np.hstack([corner * (2 * corner - 1), middle])


def shape_gradient(xi: Floats) -> Floats:
    """Derivatives of the shape functions by the local coordinates.

    Parameters
    ----------
    xi : ndarray of shape (n, 3)

    Returns
    -------
    ndarray of shape (n, 10, 3)
    """
    corner = _barycentric(xi)[..., None]
    slope = np.vstack([-np.ones(3), np.eye(3)])
    a, b = EDGES.T
    middle = 4 * (corner[:, a] * slope[b] + corner[:, b] * slope[a])
    return np.concatenate([(4 * corner - 1) * slope, middle], axis=1)


def _barycentric(xi: Floats) -> Floats:
    return np.column_stack([1 - xi.sum(axis=1), xi])


def interpolate(values: Floats, cells: Integers, points: MaterialPoints) -> Floats:
    """Nodal values carried to material points by the shape functions.

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
    return np.einsum("pa,pa...->p...", shape(points.xi), values[cells[points.cell]])


def gradient(values: Floats, positions: Floats, cells: Integers, points: MaterialPoints) -> Floats:
    """Gradient of nodal values by position at material points.

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
    inverse = np.linalg.inv(jacobian(positions, cells, points))
    slopes = shape_gradient(points.xi) @ inverse
    return np.einsum("pa...,pak->p...k", values[cells[points.cell]], slopes)


def jacobian(positions: Floats, cells: Integers, points: MaterialPoints) -> Floats:
    """Derivative of position by local coordinates at material points.

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
