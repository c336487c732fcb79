"""Fibre directions by a Laplace-Dirichlet rule.

Laplace's equation between endocardium and epicardium gives the lines through the
wall; the share of the way along them is the wall depth, its gradient the wall
normal, and the helix angle a function of it (Bayer et al., Ann Biomed Eng 40
(2012) 2243).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, triu

from echotruth.config import Fibres
from echotruth.mechanics.quadrature import tetrahedron
from echotruth.mechanics.sparse import factorization
from echotruth.tetrahedra import Floats, Integers, Mesh, shape, shape_gradient

CENTROID = np.full((1, 3), 0.25)
"""Local coordinates of the centroid of a tetrahedron."""

NOWHERE = np.empty(0, dtype=np.int32)
"""No nodes."""


def wall_depth(mesh: Mesh) -> Floats:
    """Share of the way through the wall, along the field lines of Laplace's equation.

    On a tube or a sphere it is linear in the radius, where the potential itself is not.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    ndarray of shape (n_nodes,)
        L0 / (L0 + L1), with the lengths L0 to the endocardium (depth 0) and L1 to the epicardium
        (depth 1); Yezzi & Prince, IEEE Trans Med Imaging 22 (2003) 1332.
    """
    xi, weight = tetrahedron()
    slope, volume = gradients(mesh, xi)
    volume = volume * weight
    endo, epi = np.unique(mesh.endo), np.unique(mesh.epi)
    laplace = np.einsum("cqai,cqbi,cq->cab", slope, slope, volume)
    potential = _minimum(mesh, laplace, None, endo, epi)
    along = np.einsum("cqai,cqi->cqa", slope, unit(np.einsum("cqai,ca->cqi", slope, potential[mesh.cells])))
    # The length grows by one a metre along a field line: least squares of that.
    squares = np.einsum("cqa,cqb,cq->cab", along, along, volume)
    source = np.einsum("cqa,cq->ca", along, volume)
    inner, outer = _minimum(mesh, squares, source, endo), _minimum(mesh, squares, -source, epi)
    return np.clip(inner / (inner + outer), 0.0, 1.0)


def _minimum(mesh: Mesh, local: Floats, source: Floats | None, zero: Integers, one: Integers = NOWHERE) -> Floats:
    """Nodal values u that minimise u K u / 2 - u f and are 0 and 1 at given nodes; K, f cell by cell."""
    row, column = np.repeat(mesh.cells, 10, axis=1), np.tile(mesh.cells, 10)
    matrix = csr_matrix((local.ravel(), (row.ravel(), column.ravel())))
    right = np.zeros(len(mesh.nodes))
    if source is not None:
        right = np.bincount(mesh.cells.ravel(), source.ravel(), len(mesh.nodes))
    values = np.zeros(len(mesh.nodes))
    values[one] = 1.0
    free = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([zero, one]))
    solver = factorization()
    solver.factor(csr_matrix(triu(matrix[free][:, free])))
    values[free] = solver.solve((right - matrix @ values)[free, None])[:, 0]
    solver.close()
    return values


def gradients(mesh: Mesh, xi: Floats) -> tuple[Floats, Floats]:
    """Gradients of the shape functions in the unloaded wall.

    Parameters
    ----------
    mesh : Mesh
    xi : ndarray of shape (n_points, 3)
        Local coordinates, the same in every tetrahedron.

    Returns
    -------
    gradient : ndarray of shape (n_cells, n_points, 10, 3), 1/m
    volume : ndarray of shape (n_cells, n_points), m^3
        Determinant of the map from the reference tetrahedron.
    """
    local = shape_gradient(xi)
    jacobian = np.einsum("cai,qaj->cqij", mesh.nodes[mesh.cells], local)
    return np.einsum("qaj,cqji->cqai", local, np.linalg.inv(jacobian)), np.linalg.det(jacobian)


def wall_axes(mesh: Mesh, depth: Floats, xi: Floats) -> Floats:
    """Radial, circumferential and longitudinal axes of the unloaded wall.

    Parameters
    ----------
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
    xi : ndarray of shape (n_points, 3)
        Local coordinates, the same in every tetrahedron.

    Returns
    -------
    ndarray of shape (n_cells, n_points, 3, 3)
        Rows R (gradient of the depth), C = L x R and L (the long axis made orthogonal to R).
    """
    slope, _ = gradients(mesh, xi)
    return axes_about(np.einsum("cqai,ca->cqi", slope, depth[mesh.cells]))


def axes_about(normal: Floats) -> Floats:
    """Axes of a wall with a given normal.

    Parameters
    ----------
    normal : ndarray of shape (..., 3)
        Of any length.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Rows R, C and L.
    """
    radial = unit(normal)
    # C is orthogonal to the long axis, so that L lies in the plane of R and z.
    circumferential = unit(np.cross(np.array([0.0, 0.0, 1.0]), radial))
    return np.stack([radial, circumferential, np.cross(radial, circumferential)], axis=-2)


def unit(vector: Floats) -> Floats:
    """Vectors of length one along vectors of shape (..., 3)."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def helix_angle(fibres: Fibres, depth: Floats) -> Floats:
    """Helix angle at a wall depth.

    Parameters
    ----------
    fibres : Fibres
    depth : ndarray of any shape

    Returns
    -------
    ndarray of that shape, rad
        Linear in the depth; with `stepwise`, that of the middle of the layer.
    """
    angles = fibres.si()
    at = (layer(depth, fibres.layers) - 0.5) / fibres.layers if fibres.stepwise else depth
    return angles.endo + (angles.epi - angles.endo) * at


def layer(depth: Floats, layers: int) -> Integers:
    """Number of the layer, 1 at the endocardium, at depths (0 to 1) of any shape."""
    return np.clip(np.floor(depth * layers).astype(np.int32) + 1, 1, layers)


def fibre_frames(mesh: Mesh, depth: Floats, fibres: Fibres, xi: Floats) -> Floats:
    """Material axes of the unloaded wall.

    Parameters
    ----------
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
    fibres : Fibres
    xi : ndarray of shape (n_points, 3)
        Local coordinates, the same in every tetrahedron.

    Returns
    -------
    ndarray of shape (n_cells, n_points, 3, 3)
        Rows f = cos(a) C + sin(a) L, s = n x f and n = R, right-handed.
    """
    radial, circumferential, longitudinal = np.moveaxis(wall_axes(mesh, depth, xi), -2, 0)
    angle = helix_angle(fibres, at_points(mesh, depth, xi))[..., None]
    fibre = np.cos(angle) * circumferential + np.sin(angle) * longitudinal
    return np.stack([fibre, np.cross(radial, fibre), radial], axis=-2)


def angle_of(fibre: Floats, axes: Floats) -> Floats:
    """Helix angle read back from fibre directions.

    Parameters
    ----------
    fibre : ndarray of shape (..., 3)
    axes : ndarray of shape (..., 3, 3)
        Rows R, C and L.

    Returns
    -------
    ndarray of shape (...), rad
        Between -pi/2 and pi/2: a fibre has no head.
    """
    around, along = (np.sum(fibre * axes[..., i, :], axis=-1) for i in (1, 2))
    return np.arctan2(along * np.where(around < 0, -1.0, 1.0), np.abs(around))


def at_points(mesh: Mesh, values: Floats, xi: Floats) -> Floats:
    """Nodal values, shape (n_nodes,), at local coordinates (n_points, 3) of each cell: (n_cells, n_points)."""
    return np.einsum("qa,ca->cq", shape(xi), values[mesh.cells])
