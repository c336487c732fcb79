"""Wall depth, wall axes and fibre frames, by a Laplace-Dirichlet rule or from the mesh file.

Laplace's equation between endocardium and epicardium gives the field lines through the wall. The relative distance
along them is the wall depth, its gradient the wall normal, and helix, transverse and sheet angles are functions of it.
Helix and sheet angle are alpha and beta of Bayer et al., Ann Biomed Eng 40 (2012) 2243; docs/conventions.md says where
the two rules differ.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Fibres
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Integers, Mesh, shape, shape_gradient
from echotruth.heart import in_right_wall
from echotruth.mechanics import angles, disarray
from echotruth.units import deg, mm

CENTROID = np.full((1, 3), 0.25)
"""Local coordinates of the centroid of a tetrahedron."""


class FibreError(ValueError):
    """Raised if the mesh lacks the fibre directions that the configuration asks for."""


def wall_depth(mesh: Mesh) -> Floats:
    """Relative distance through the wall, along the field lines of Laplace's equation.

    On a tube or a sphere it is linear in the radius, where the potential itself is not. Where there is a right
    ventricle, its free wall is taken off, and what is laid bare counts as epicardium of the left one; through the free
    wall the depth goes from 1 to 2.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    ndarray of shape (n_nodes,)
        L0 / (L0 + L1), with the lengths L0 to the endocardium (depth 0) and L1 to the epicardium
        (depth 1); Yezzi & Prince, IEEE Trans Med Imaging 22 (2003) 1332. In the free wall of the right ventricle it
        is one more.
    """
    endo, epi, right_endo = map(np.unique, (mesh.endo, mesh.epi, mesh.right_endo))
    if not len(right_endo):
        return _depth_between(mesh, endo, epi)
    is_right = _right_free_wall(mesh, endo, epi, right_endo)
    left, right = (replace(mesh, cells=mesh.cells[cells]) for cells in (~is_right, is_right))
    shared = np.intersect1d(left.cells, right.cells)
    depth = _depth_between(left, endo, np.unique(np.concatenate([epi, right_endo, shared])))
    apart = np.setdiff1d(right.cells, shared)
    depth[apart] = 1 + _depth_between(right, right_endo, epi)[apart]
    return depth


def _right_free_wall(mesh: Mesh, endo: Integers, epi: Integers, right_endo: Integers) -> NDArray[np.bool_]:
    """Cells of the free wall of a right ventricle, (n_cells,), given the nodes of the three surfaces.

    Every wall lies between two of the surfaces. Of the three potentials that are 1 at one of them and 0 at the two
    others, that of the third surface is the smallest there.
    """
    xi, weight = tetrahedron()
    dN_dX, volume = material_gradients(mesh, xi)
    laplace = np.einsum("cqai,cqbi,cq->cab", dN_dX, dN_dX, volume * weight)
    of_left = _minimize(mesh, laplace, None, np.concatenate([epi, right_endo]), endo)
    of_right = _minimize(mesh, laplace, None, np.concatenate([epi, endo]), right_endo)
    left, right = (values[mesh.cells].mean(axis=1) for values in (of_left, of_right))
    return (left < right) & (left < 1 - left - right)


def _depth_between(mesh: Mesh, endo: Integers, epi: Integers) -> Floats:
    """Wall depth (n_nodes,) between nodes of depth 0 and nodes of depth 1."""
    xi, weight = tetrahedron()
    dN_dX, volume = material_gradients(mesh, xi)
    volume = volume * weight
    laplace = np.einsum("cqai,cqbi,cq->cab", dN_dX, dN_dX, volume)
    potential = _minimize(mesh, laplace, None, endo, epi)
    dN_ds = np.einsum("cqai,cqi->cqa", dN_dX, unit(_gradient(mesh, potential, dN_dX)))
    # The length L grows by one per metre of field line: least squares of dL/ds - 1, towards either side.
    matrix = np.einsum("cqa,cqb,cq->cab", dN_ds, dN_ds, volume)
    source = np.einsum("cqa,cq->ca", dN_ds, volume)
    to_endo, to_epi = _minimize(mesh, matrix, source, endo), _minimize(mesh, matrix, -source, epi)
    thickness = to_endo + to_epi
    return np.clip(np.divide(to_endo, thickness, out=potential, where=thickness > 0), 0.0, 1.0)


def _minimize(mesh: Mesh, k: Floats, f: Floats | None, zero: Integers, one: Integers | None = None) -> Floats:
    """Nodal values u that minimise u K u / 2 - u f and are 0 and 1 at given nodes; K, f cell by cell."""
    from scipy.sparse import csr_matrix, triu  # whoever reads a heart needs none

    from echotruth.fem.sparse import factorization

    n_nodes = len(mesh.nodes)
    row, column = np.repeat(mesh.cells, 10, axis=1), np.tile(mesh.cells, 10)
    matrix = csr_matrix((k.ravel(), (row.ravel(), column.ravel())), (n_nodes, n_nodes))
    right = np.zeros(n_nodes) if f is None else np.bincount(mesh.cells.ravel(), f.ravel(), n_nodes)
    values, fixed = np.zeros(n_nodes), zero
    if one is not None:
        values[one], fixed = 1.0, np.concatenate([zero, one])
    free = np.setdiff1d(mesh.cells, fixed)
    solver = factorization()
    solver.factor(csr_matrix(triu(matrix[free][:, free])))
    values[free] = solver.solve((right - matrix @ values)[free, None])[:, 0]
    solver.close()
    return values


def material_gradients(mesh: Mesh, xi: Floats) -> tuple[Floats, Floats]:
    """Gradients of the shape functions by the position X in the unloaded wall.

    Parameters
    ----------
    mesh : Mesh
    xi : ndarray of shape (n_points, 3)
        Local coordinates, the same in every tetrahedron.

    Returns
    -------
    dN_dX : ndarray of shape (n_cells, n_points, 10, 3), 1/m
    volume : ndarray of shape (n_cells, n_points), m^3
        Determinant of dX/dxi.
    """
    dN_dxi = shape_gradient(xi)
    jacobian = np.einsum("cai,qaj->cqij", mesh.nodes[mesh.cells], dN_dxi)
    return np.einsum("qaj,cqji->cqai", dN_dxi, np.linalg.inv(jacobian)), np.linalg.det(jacobian)


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
    return axes_from_normal(_gradient(mesh, depth, material_gradients(mesh, xi)[0]))


def _gradient(mesh: Mesh, values: Floats, dN_dX: Floats) -> Floats:
    """Gradient (n_cells, n_points, 3) of nodal values."""
    gradient = np.einsum("cqai,ca->cqi", dN_dX, values[mesh.cells])
    norm = np.linalg.norm(gradient, axis=-1)
    flat = norm < 1e-6 * np.median(norm)
    if flat.any():
        # A cell with all its nodes on one side of the wall has no gradient: it takes that of its neighbours.
        of_cell = np.repeat(gradient.mean(axis=1), 10, axis=0)
        nodes = mesh.cells.ravel()
        of_node = np.stack([np.bincount(nodes, part, len(mesh.nodes)) for part in of_cell.T], axis=-1)
        gradient[flat] = of_node[mesh.cells].mean(axis=1)[np.nonzero(flat)[0]]
    return gradient


def axes_from_normal(normal: Floats) -> Floats:
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
    radial = unit(_unless_zero(normal, x))
    # C is orthogonal to the long axis, so that L lies in the plane of R and z.
    circumferential = unit(_unless_zero(np.cross(z, radial), y))
    return np.stack([radial, circumferential, np.cross(radial, circumferential)], axis=-2)


def _unless_zero(vector: Floats, substitute: Floats) -> Floats:
    """Vectors of shape (..., 3), with a substitute for those of length zero."""
    return np.where(np.linalg.norm(vector, axis=-1, keepdims=True) == 0, substitute, vector)


def unit(vector: Floats) -> Floats:
    """Vectors of shape (..., 3) divided by their lengths."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def rule_angles(fibres: Fibres, depth: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles of the rule at a wall depth.

    Parameters
    ----------
    fibres : Fibres
    depth : ndarray of any shape

    Returns
    -------
    helix, transverse, sheet : ndarray of that shape, rad
        endo + (epi - endo) depth; with `stepwise`, with the depth of the middle of the layer.
    """
    at = (layer(depth, fibres.layers) - 0.5) / fibres.layers if fibres.stepwise else depth
    ends = (
        (fibres.endo_deg, fibres.epi_deg),
        (fibres.transverse_endo_deg, fibres.transverse_epi_deg),
        (fibres.sheet_endo_deg, fibres.sheet_epi_deg),
    )
    helix, transverse, sheet = (endo * deg + (epi * deg - endo * deg) * at for endo, epi in ends)
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
        Seed of the random angles of the disarray.

    Returns
    -------
    ndarray of shape (n_cells, n_points, 3, 3)
        Rows f (fibre), s (sheet) and n = f x s (normal of the sheet), right-handed.

    Raises
    ------
    FibreError
        If the directions are to come from the mesh file and it lacks them.
    """
    axes = wall_axes(mesh, depth, xi)
    if fibres.source == "file":
        of_cell = _frames_of_file(mesh, wall_axes(mesh, depth, CENTROID)[:, 0, 0])
        frames = np.repeat(of_cell[:, None], len(xi), axis=1)
    else:
        # The free wall of a right ventricle has the angles of the left one.
        through = interpolate_in_cells(mesh, depth, xi) - in_right_wall(depth, mesh.cells)[:, None]
        frames = angles.frames_from_angles(axes, *rule_angles(fibres, through))
    if fibres.disarray_deg:
        positions = np.einsum("qa,cai->cqi", shape(xi), mesh.nodes[mesh.cells])
        field = disarray.random_field(positions, fibres.disarray_length_mm * mm, seed)
        frames = disarray.rotate(frames, axes[..., 0, :], fibres.disarray_deg * deg * field)
    return frames


def _frames_of_file(mesh: Mesh, normal: Floats) -> Floats:
    """Frames (n_cells, 3, 3) of the directions of the mesh file; without sheets, they lie in the wall."""
    if mesh.fibre is None:
        remedy = "name them with geometry.fibre, or set fibres.source to rule"
        raise FibreError(f"fibres.source = file: the mesh has no fibre directions: {remedy}.")
    fibre = mesh.fibre / _nonzero_lengths(mesh.fibre, "fibre direction")
    sheet = np.cross(normal, fibre) if mesh.sheet is None else mesh.sheet
    orthogonal = sheet - np.sum(sheet * fibre, axis=-1, keepdims=True) * fibre
    orthogonal /= _nonzero_lengths(orthogonal, "sheet direction across the fibre")
    # The third axis is computed, not read: a left-handed frame turns the sign of det F.
    return np.stack([fibre, orthogonal, np.cross(fibre, orthogonal)], axis=-2)


def _nonzero_lengths(vectors: Floats, name: str) -> Floats:
    """Lengths (n_cells, 1) of the vectors of the cells, none of which may be zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    missing = np.count_nonzero(~(length > 1e-6))
    if missing:
        remedy = "repair the file, or set fibres.source to rule"
        raise FibreError(f"fibres.source = file: {missing} of {len(vectors)} cells have no {name}: {remedy}.")
    return length


def interpolate_in_cells(mesh: Mesh, values: Floats, xi: Floats) -> Floats:
    """Nodal values, shape (n_nodes,), at local coordinates (n_points, 3) of each cell: (n_cells, n_points)."""
    return np.einsum("qa,ca->cq", shape(xi), values[mesh.cells])
