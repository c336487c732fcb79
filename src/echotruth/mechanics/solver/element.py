"""Quadratic tetrahedron with one pressure, condensed.

Perturbed Lagrangian: with W the energy of the wall and p the pressure of a cell, an unknown of its own, a cell has the
energy int W + (J - 1) p - p^2 / (2 kappa). Each Newton step eliminates p within the cell, which adds kappa / V G G^T to
the tangent, with G = dv/du the gradient of the deformed volume and V the unloaded volume (Simo & Hughes, Computational
Inelasticity, section 7.3; Bonet & Wood, Nonlinear Continuum Mechanics, section 8.6). One pressure keeps the mean
volume of a cell, not that of its points; a weak energy C pointwise_bulk_ratio (J - 1)^2 / 2 keeps these near one, and
vanishes as the mesh is refined. Strains are taken in the fibre axes, into which dN/dX, the gradients of the shape
functions, are turned once.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.fibres import material_gradients
from echotruth.mechanics.solver import stress_point as point
from echotruth.mechanics.solver.active_stress import ActiveLaw
from echotruth.mechanics.solver.stress_point import COMPILED, PASSIVE, TOTAL, VOLUMETRIC
from echotruth.threads import share

DOFS = 30
"""Displacements of a cell, node by node."""

WIDTH = 32
"""Length of a row of its tangent, padded for vector units."""

PACKED = DOFS * (DOFS + 1) // 2
"""Entries of the upper triangle of its tangent, row by row."""


class Elements(NamedTuple):
    """Cells and their constants.

    Attributes
    ----------
    cells : ndarray of shape (n_cells, 10)
    dN_dX : ndarray of shape (n_cells, n_points, 10, 3), 1/m
        Gradients of the shape functions along the fibre axes.
    weight : ndarray of shape (n_cells, n_points), m^3
        Unloaded volume of each quadrature point.
    directions : ndarray of shape (n_nodes, 3, 3)
        Rows: directions of the displacements of a node.
    rotated : ndarray of shape (n_nodes,), bool
        Whether these are not x, y, z.
    """

    cells: NDArray[np.int32]
    dN_dX: Floats
    weight: Floats
    directions: Floats
    rotated: NDArray[np.bool_]


class WallLaw(NamedTuple):
    """Laws of the wall with their constants.

    Attributes
    ----------
    energy : numba CFunc
        Energy of the passive law, from `materials.compiled`.
    constants : ndarray
        Constants of the passive law.
    active : ActiveLaw
        Constants of the active stress.
    bulk_modulus : float, Pa
        kappa, of the mean volume of each cell.
    pointwise_bulk_ratio : float
        Pointwise bulk modulus divided by C, of this law.
    viscosity : float, Pa s
    cross_fibre : ndarray of shape (2,)
        Shares of the active tension that act along sheet and normal too.
    """

    energy: Any
    constants: Floats
    active: ActiveLaw
    bulk_modulus: float
    pointwise_bulk_ratio: float = 0.0
    viscosity: float = 0.0
    cross_fibre: Floats = np.zeros(2)


class CellState(NamedTuple):
    """Factors of the stresses of each cell.

    Attributes
    ----------
    stiffness, tension, pressure : ndarray of shape (n_cells,), Pa
        C, T_Ca and the pressure, positive in tension.
    rate : float, 1/s
        One over the time since the previous state; 0 at rest.
    previous_c : ndarray of shape (n_cells, n_points, 6)
        Right Cauchy-Green tensor of that state, in the fibre axes; ignored at rest.
    taut : ndarray of shape (n_cells,), Pa
        Stiffness from end-diastole on, of scars.
    taut_c : ndarray of shape (n_cells, n_points, 6)
        Right Cauchy-Green tensor of end-diastole; ignored where nothing is taut.
    """

    stiffness: Floats
    tension: Floats
    pressure: Floats
    rate: float
    previous_c: Floats
    taut: Floats
    taut_c: Floats


class Response(NamedTuple):
    """Forces, volume and tangent of each cell.

    Attributes
    ----------
    force : ndarray of shape (n_cells, 4, 30), m^2
        `PASSIVE`, `ACTIVE` and `VOLUMETRIC` force for a stiffness, tension and pressure of one, computed only
        with a tangent, and the `TOTAL` (N).
    volume : ndarray of shape (n_cells,), m^3
        Deformed volume; not a number where the cell is inside out.
    tangent : ndarray of shape (n_cells, 465) or (0, 465), N/m
        Upper triangle of the condensed tangent; (0, 465) if it is not wanted.
    """

    force: Floats
    volume: Floats
    tangent: Floats


def build_elements(mesh: Mesh, axes: Floats | None = None, directions: Floats | None = None) -> Elements:
    """Cells of a wall with fibres.

    Parameters
    ----------
    mesh : Mesh
    axes : ndarray of shape (n_cells, n_points, 3, 3), optional
        Rows f, s, n, or other axes of the material, at the points of `quadrature.tetrahedron`; x, y, z if not given.
    directions : ndarray of shape (n_nodes, 3, 3), optional
        Rows: directions of the displacements of each node; x, y, z if not given.
    """
    xi, weight = tetrahedron()
    dN_dX, volume = material_gradients(mesh, xi)
    if axes is not None:
        dN_dX = np.einsum("cqai,cqji->cqaj", dN_dX, axes)
    directions = np.tile(np.eye(3), (len(mesh.nodes), 1, 1)) if directions is None else directions
    rotated = np.any(directions != np.eye(3), axis=(1, 2))
    return Elements(mesh.cells, np.ascontiguousarray(dN_dX), volume * weight, directions, rotated)


def allocate_response(n_cells: int, with_tangent: bool) -> Response:
    """Uninitialized response."""
    tangent = np.empty((n_cells if with_tangent else 0, PACKED))
    return Response(np.empty((n_cells, 4, DOFS)), np.empty(n_cells), tangent)


def evaluate(nodes: Floats, elements: Elements, law: WallLaw, state: CellState, out: Response) -> None:
    """Evaluate forces, volumes and tangents of all cells.

    Threads share the cells; see :func:`echotruth.threads.share`.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Deformed positions.
    elements : Elements
    law : WallLaw
    state : CellState
    out : Response
        Filled.
    """
    share(partial(_evaluate_cells, nodes, elements, law, state, out), len(elements.cells))


@njit(nogil=True, **COMPILED)
def _evaluate_cells(nodes, elements, law, state, out, bounds):
    """Evaluate the cells from the first of the `bounds` to the one before the second."""
    with_tangent = out.tangent.shape[0] > 0
    x, ke, dP_du, work = np.empty((10, 3)), np.empty((DOFS, WIDTH)), np.zeros((9, WIDTH)), point.allocate()
    for cell in range(*bounds):
        force = out.force[cell]
        force[:], out.volume[cell] = 0.0, 0.0
        if with_tangent:
            ke[:] = 0.0
        scale = state.stiffness[cell], state.tension[cell], state.pressure[cell], state.rate, state.taut[cell]
        _gather(nodes, elements.cells, cell, x)
        for q in range(elements.weight.shape[1]):
            dN_dX, weight = elements.dN_dX[cell, q], elements.weight[cell, q]
            j = point.deform(x, dN_dX, work.f, work.c)
            point.evaluate(j, law, scale, state.previous_c[cell, q], state.taut_c[cell, q], work, with_tangent)
            point.add_force(work, dN_dX, weight, force, PASSIVE if with_tangent else TOTAL)
            if with_tangent:
                point.linearize(work, weight)
                _add_tangent(work.dP_dF, dN_dX, dP_du, ke)
            out.volume[cell] += weight * j if j > 0 else np.nan
        if with_tangent:
            _add_condensed(force[VOLUMETRIC], law.bulk_modulus / np.sum(elements.weight[cell]), ke)
        _rotate_nodes(elements, cell, force, ke, with_tangent)
        if with_tangent:
            _pack(ke, out.tangent[cell])


@njit(**COMPILED)
def right_cauchy_green(nodes: Floats, elements: Elements, c: Floats) -> Floats:
    """Fill C = F^T F, (n_cells, n_points, 6), along the fibre axes, for nodes at (n_nodes, 3), m.

    Returns
    -------
    ndarray of shape (n_cells, n_points)
        J.
    """
    j, f, x = np.empty(elements.weight.shape), np.empty((3, 3)), np.empty((10, 3))
    for cell in range(elements.cells.shape[0]):
        _gather(nodes, elements.cells, cell, x)
        for q in range(elements.weight.shape[1]):
            j[cell, q] = point.deform(x, elements.dN_dX[cell, q], f, c[cell, q])
    return j


def fibre_stretch(nodes: Floats, elements: Elements) -> Floats:
    """Mean stretch along the fibres over the points of each cell, (n_cells,), for nodes at (n_nodes, 3), m."""
    c = np.empty((*elements.weight.shape, 6))
    right_cauchy_green(nodes, elements, c)
    return np.sqrt(c[..., 0]).mean(axis=1)


@njit(**COMPILED)
def _add_condensed(gradient, factor, ke):
    """Add `factor` G G^T of the eliminated pressure."""
    for r in range(DOFS):
        for s in range(r, DOFS):
            ke[r, s] += factor * gradient[r] * gradient[s]


@njit(**COMPILED)
def _add_tangent(dP_dF, dN_dX, dP_du, ke):
    """Add dN_a/dX_J dP_iJ/dF_kL dN_b/dX_L to all entries ke[3 a + i, 3 b + k]; `dP_du` is a work array."""
    for r in range(9):
        for i in range(3):
            first, second, third = dP_dF[r, 3 * i], dP_dF[r, 3 * i + 1], dP_dF[r, 3 * i + 2]
            for a in range(10):
                dP_du[r, 3 * a + i] = first * dN_dX[a, 0] + second * dN_dX[a, 1] + third * dN_dX[a, 2]
    for a in range(10):
        x, y, z = dN_dX[a, 0], dN_dX[a, 1], dN_dX[a, 2]
        for i in range(3):
            row, first, second, third = ke[3 * a + i], dP_du[3 * i], dP_du[3 * i + 1], dP_du[3 * i + 2]
            for s in range(WIDTH):  # the whole row, of a length known to the compiler, so that it is vectorized
                row[s] += x * first[s] + y * second[s] + z * third[s]


@njit(**COMPILED)
def _gather(nodes, cells, cell, x):
    """Fill the positions x (10, 3) of the nodes of a cell."""
    for a in range(10):
        for i in range(3):
            x[a, i] = nodes[cells[cell, a], i]


@njit(**COMPILED)
def _rotate_nodes(elements, cell, force, ke, with_tangent):
    """Rotate the forces and the tangent of a cell to the directions of its nodes."""
    for a in range(10):
        if elements.rotated[elements.cells[cell, a]]:
            directions = elements.directions[elements.cells[cell, a]]
            for part in range(4):
                _rotate_force(a, directions, force[part])
            if with_tangent:
                _rotate_tangent(a, directions, ke)


@njit(**COMPILED)
def _rotate_force(a, directions, force):
    """Rotate the force of node a to its directions."""
    x, y, z = force[3 * a], force[3 * a + 1], force[3 * a + 2]
    for i in range(3):
        force[3 * a + i] = directions[i, 0] * x + directions[i, 1] * y + directions[i, 2] * z


@njit(**COMPILED)
def _rotate_tangent(a, directions, ke):
    """Rotate the tangent of node a to its directions."""
    for r in range(DOFS):
        for s in range(r):
            ke[r, s] = ke[s, r]
    for s in range(DOFS):
        x, y, z = ke[3 * a, s], ke[3 * a + 1, s], ke[3 * a + 2, s]
        for i in range(3):
            ke[3 * a + i, s] = directions[i, 0] * x + directions[i, 1] * y + directions[i, 2] * z
    for r in range(DOFS):
        x, y, z = ke[r, 3 * a], ke[r, 3 * a + 1], ke[r, 3 * a + 2]
        for i in range(3):
            ke[r, 3 * a + i] = x * directions[i, 0] + y * directions[i, 1] + z * directions[i, 2]


@njit(**COMPILED)
def _pack(ke, packed):
    n = 0
    for r in range(DOFS):
        for s in range(r, DOFS):
            packed[n] = ke[r, s]
            n += 1
