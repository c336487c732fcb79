"""Fibre directions by a Laplace-Dirichlet rule, or those of the mesh.

Laplace's equation between endocardium and epicardium gives the lines through the
wall; the share of the way along them is the wall depth, its gradient the wall
normal, and the helix, transverse and sheet angles functions of it. Helix and sheet
angle are alpha and beta of Bayer et al., Ann Biomed Eng 40 (2012) 2243; docs/conventions.md
says where the two rules part.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, triu

from echotruth.config import Fibres
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.sparse import factorization
from echotruth.fem.tetrahedra import Floats, Integers, Mesh, shape, shape_gradient
from echotruth.mechanics import angles, disarray

CENTROID = np.full((1, 3), 0.25)
"""Local coordinates of the centroid of a tetrahedron."""

NOWHERE = np.empty(0, dtype=np.int32)
"""No nodes."""


class FibreError(ValueError):
    """Fibres that are not to be had."""


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
    along = np.einsum("cqai,cqi->cqa", slope, unit(_growth(mesh, potential, slope)))
    # The length grows by one a metre along a field line: least squares of that.
    squares = np.einsum("cqa,cqb,cq->cab", along, along, volume)
    source = np.einsum("cqa,cq->ca", along, volume)
    inner, outer = _minimum(mesh, squares, source, endo), _minimum(mesh, squares, -source, epi)
    whole = inner + outer
    return np.clip(np.divide(inner, whole, out=potential, where=whole > 0), 0.0, 1.0)


def _minimum(mesh: Mesh, local: Floats, source: Floats | None, zero: Integers, one: Integers = NOWHERE) -> Floats:
    """Nodal values u that minimise u K u / 2 - u f and are 0 and 1 at given nodes; K, f cell by cell."""
    row, column = np.repeat(mesh.cells, 10, axis=1), np.tile(mesh.cells, 10)
    matrix = csr_matrix((local.ravel(), (row.ravel(), column.ravel())), (len(mesh.nodes), len(mesh.nodes)))
    right = np.zeros(len(mesh.nodes))
    if source is not None:
        right = np.bincount(mesh.cells.ravel(), source.ravel(), len(mesh.nodes))
    values = np.zeros(len(mesh.nodes))
    values[one] = 1.0
    free = np.setdiff1d(mesh.cells, np.concatenate([zero, one]))
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
    return axes_about(_growth(mesh, depth, gradients(mesh, xi)[0]))


def _growth(mesh: Mesh, values: Floats, slope: Floats) -> Floats:
    """Gradient of nodal values where the shape functions have the gradients (n_cells, n_points, 10, 3)."""
    growth = np.einsum("cqai,ca->cqi", slope, values[mesh.cells])
    size = np.linalg.norm(growth, axis=-1)
    flat = size < 1e-6 * np.median(size)
    if flat.any():
        # A cell with all its nodes on one side of the wall has no gradient: that of its neighbours stands in.
        share = np.repeat(growth.mean(axis=1), 10, axis=0)
        nodes = mesh.cells.ravel()
        near = np.stack([np.bincount(nodes, part, len(mesh.nodes)) for part in share.T], axis=-1)
        growth[flat] = near[mesh.cells].mean(axis=1)[np.nonzero(flat)[0]]
    return growth


def axes_about(normal: Floats) -> Floats:
    """Axes of a wall with a given normal.

    Parameters
    ----------
    normal : ndarray of shape (..., 3)
        Of any length. Along the long axis, where no direction is circumferential, C is y; where there is
        no normal, R is x.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Rows R, C and L.
    """
    x, y, z = np.eye(3)
    radial = unit(_or(normal, x))
    # C is orthogonal to the long axis, so that L lies in the plane of R and z.
    circumferential = unit(_or(np.cross(z, radial), y))
    return np.stack([radial, circumferential, np.cross(radial, circumferential)], axis=-2)


def _or(vector: Floats, other: Floats) -> Floats:
    """Vectors of shape (..., 3), or another one in place of those of length zero."""
    return np.where(np.linalg.norm(vector, axis=-1, keepdims=True) == 0, other, vector)


def unit(vector: Floats) -> Floats:
    """Vectors of length one along vectors of shape (..., 3)."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def angles_at(fibres: Fibres, depth: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles of the rule at a wall depth.

    Parameters
    ----------
    fibres : Fibres
    depth : ndarray of any shape

    Returns
    -------
    helix, transverse, sheet : ndarray of that shape, rad
        Linear in the depth; with `stepwise`, those of the middle of the layer.
    """
    si = fibres.si()
    at = (layer(depth, fibres.layers) - 0.5) / fibres.layers if fibres.stepwise else depth
    ends = ((si.endo, si.epi), (si.transverse_endo, si.transverse_epi), (si.sheet_endo, si.sheet_epi))
    helix, transverse, sheet = (endo + (epi - endo) * at for endo, epi in ends)
    return helix, transverse, sheet


def layer(depth: Floats, layers: int) -> Integers:
    """Number of the layer, 1 at the endocardium, at depths (0 to 1) of any shape."""
    return np.clip(np.floor(depth * layers).astype(np.int32) + 1, 1, layers)


def fibre_frames(mesh: Mesh, depth: Floats, fibres: Fibres, xi: Floats, seed: int = 0) -> Floats:
    """Material axes of the unloaded wall.

    Parameters
    ----------
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
    fibres : Fibres
    xi : ndarray of shape (n_points, 3)
        Local coordinates, the same in every tetrahedron.
    seed : int, optional
        Start of the random draws of the disarray.

    Returns
    -------
    ndarray of shape (n_cells, n_points, 3, 3)
        Rows f (fibre), s (sheet) and n = f x s (normal of the sheet), right-handed.

    Raises
    ------
    FibreError
        If the directions are to come with the mesh and do not.
    """
    axes = wall_axes(mesh, depth, xi)
    if fibres.source == "file":
        frames = np.repeat(_given(mesh, wall_axes(mesh, depth, CENTROID)[:, 0, 0])[:, None], len(xi), axis=1)
    else:
        frames = angles.frames(axes, *angles_at(fibres, at_points(mesh, depth, xi)))
    settings = fibres.si()
    if settings.disarray:
        places = np.einsum("qa,cai->cqi", shape(xi), mesh.nodes[mesh.cells])
        turn = settings.disarray * disarray.field(places, settings.disarray_length, seed)
        frames = disarray.turned(frames, axes[..., 0, :], turn)
    return frames


def _given(mesh: Mesh, normal: Floats) -> Floats:
    """Frames (n_cells, 3, 3) of the directions that came with the mesh; without sheets, they lie in the wall."""
    if mesh.fibre is None:
        remedy = "name them in the file, or set fibres.source to rule"
        raise FibreError(f"fibres.source = file: the mesh carries no fibre directions: {remedy}.")
    fibre = mesh.fibre / _length(mesh.fibre, "fibre direction")
    sheet = np.cross(normal, fibre) if mesh.sheet is None else mesh.sheet
    across = sheet - np.sum(sheet * fibre, axis=-1, keepdims=True) * fibre
    across /= _length(across, "sheet direction across its fibre")
    # The third axis is made, not read: a left-handed frame turns the sign of det F.
    return np.stack([fibre, across, np.cross(fibre, across)], axis=-2)


def _length(vectors: Floats, name: str) -> Floats:
    """Lengths (n_cells, 1) of the vectors of the cells, all of which must have one."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    lost = np.count_nonzero(~(length > 1e-6))
    if lost:
        remedy = "mend the file, or set fibres.source to rule"
        raise FibreError(f"fibres.source = file: {lost} of {len(vectors)} cells have no {name}: {remedy}.")
    return length


def at_points(mesh: Mesh, values: Floats, xi: Floats) -> Floats:
    """Nodal values, shape (n_nodes,), at local coordinates (n_points, 3) of each cell: (n_cells, n_points)."""
    return np.einsum("qa,ca->cq", shape(xi), values[mesh.cells])
