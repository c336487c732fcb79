"""Quadratic tetrahedron with one pressure, condensed.

Perturbed Lagrangian: the pressure p of a cell multiplies the growth of its volume,
int (J - 1) p - p^2 / (2 kappa), and is an unknown of its own; each Newton step
eliminates it within the cell (Simo & Hughes, Computational Inelasticity, section 7.3;
Bonet & Wood, Nonlinear Continuum Mechanics, section 8.6). One pressure keeps the mean
volume of a cell, not that of its points; a weak energy C local_bulk (J - 1)^2 / 2 beside it
keeps these near one, and vanishes as the mesh is refined.
Strains are taken in the fibre axes: the gradients of the shape functions are turned
into them once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.fibres import gradients
from echotruth.mechanics.solver import stress_point as point
from echotruth.mechanics.solver.stress_point import COMPILED, PASSIVE, VOLUMETRIC, WHOLE

DOFS = 30
"""Displacements of a cell, node by node."""

WIDTH = 32
"""Length of a row of its tangent, filled up for vector units."""

PACKED = DOFS * (DOFS + 1) // 2
"""Entries of the upper triangle of its tangent, row by row."""


class Elements(NamedTuple):
    """Cells with all that does not change.

    Attributes
    ----------
    cells : ndarray of shape (n_cells, 10)
    slope : ndarray of shape (n_cells, n_points, 10, 3), 1/m
        Gradients of the shape functions along the fibre axes.
    weight : ndarray of shape (n_cells, n_points), m^3
        Unloaded volume that each quadrature point stands for.
    frame : ndarray of shape (n_nodes, 3, 3)
        Rows: the directions of the displacements of a node.
    turned : ndarray of shape (n_nodes,), bool
        Whether these are not x, y, z.
    """

    cells: NDArray[np.int32]
    slope: Floats
    weight: Floats
    frame: Floats
    turned: NDArray[np.bool_]


class Law(NamedTuple):
    """Constants of the wall.

    Attributes
    ----------
    energy : numba CFunc
        Of the passive law, as given by `materials.compiled`.
    constants : ndarray
        Its numbers.
    active : ndarray of shape (2,)
        beta of the active law, and the power of the stretch by which the tension is divided.
    bulk_modulus : float, Pa
        Of the mean volume of each cell.
    local_bulk : float
        The same of the volume at each point, over C.
    viscosity : float, Pa s
    """

    energy: Any
    constants: Floats
    active: Floats
    bulk_modulus: float
    local_bulk: float = 0.0
    viscosity: float = 0.0


class Load(NamedTuple):
    """What scales the stresses of each cell.

    Attributes
    ----------
    stiffness, tension, pressure : ndarray of shape (n_cells,), Pa
        C, T_Ca and the pressure, positive in tension.
    viscosity : ndarray of shape (n_cells,), Pa
        Viscosity over the time since the state before.
    before : ndarray of shape (n_cells, n_points, 6)
        Right Cauchy-Green tensor of that state, in the fibre axes.
    """

    stiffness: Floats
    tension: Floats
    pressure: Floats
    viscosity: Floats
    before: Floats


class Blocks(NamedTuple):
    """Response of each cell.

    Attributes
    ----------
    force : ndarray of shape (n_cells, 4, 30), m^2
        Passive, active and volumetric force for a stiffness, tension and pressure of one, which are left out
        without a tangent, and the whole (N).
    volume : ndarray of shape (n_cells,), m^3
        Deformed volume; not a number where the cell is inside out.
    tangent : ndarray of shape (n_cells, 465) or (0, 465), N/m
        Upper triangle of the condensed tangent; left out if there is no room for it.
    """

    force: Floats
    volume: Floats
    tangent: Floats


def elements(mesh: Mesh, axes: Floats | None = None, frame: Floats | None = None) -> Elements:
    """Cells of a wall with fibres.

    Parameters
    ----------
    mesh : Mesh
    axes : ndarray of shape (n_cells, n_points, 3, 3), optional
        Rows f, s, n, or other axes of the material, at the points of `quadrature.tetrahedron`; x, y, z if not given.
    frame : ndarray of shape (n_nodes, 3, 3), optional
        Rows: the directions of the displacements of each node; x, y, z if not given.
    """
    xi, weight = tetrahedron()
    slope, volume = gradients(mesh, xi)
    if axes is not None:
        slope = np.einsum("cqai,cqji->cqaj", slope, axes)
    frame = np.tile(np.eye(3), (len(mesh.nodes), 1, 1)) if frame is None else frame
    turned = np.any(frame != np.eye(3), axis=(1, 2))
    return Elements(mesh.cells, np.ascontiguousarray(slope), volume * weight, frame, turned)


def blocks(n_cells: int, with_tangent: bool) -> Blocks:
    """Room for the response of cells."""
    tangent = np.empty((n_cells if with_tangent else 0, PACKED))
    return Blocks(np.empty((n_cells, 4, DOFS)), np.empty(n_cells), tangent)


@njit(**COMPILED)
def respond(nodes: Floats, body: Elements, law: Law, load: Load, out: Blocks) -> None:
    """Forces and tangents of all cells.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Deformed positions.
    body : Elements
    law : Law
    load : Load
    out : Blocks
        Filled.
    """
    with_tangent = out.tangent.shape[0] > 0
    x, ke, along, at = np.empty((10, 3)), np.empty((DOFS, WIDTH)), np.zeros((9, WIDTH)), point.room()
    for cell in range(body.cells.shape[0]):
        force = out.force[cell]
        force[:], out.volume[cell] = 0.0, 0.0
        if with_tangent:
            ke[:] = 0.0
        scale = load.stiffness[cell], load.tension[cell], load.pressure[cell], load.viscosity[cell]
        _gather(nodes, body.cells, cell, x)
        for q in range(body.weight.shape[1]):
            slope, weight = body.slope[cell, q], body.weight[cell, q]
            j = point.deform(x, slope, at.f, at.c)
            point.respond(j, law, scale, load.before[cell, q], at, with_tangent)
            point.add_force(at, slope, weight, force, PASSIVE if with_tangent else WHOLE)
            if with_tangent:
                point.moduli(at, weight)
                _add_tangent(at.modulus, slope, along, ke)
            out.volume[cell] += weight * j if j > 0 else np.nan
        if with_tangent:
            _add_condensed(force[VOLUMETRIC], law.bulk_modulus / np.sum(body.weight[cell]), ke)
        _turn_nodes(body, cell, force, ke, with_tangent)
        if with_tangent:
            _pack(ke, out.tangent[cell])


@njit(**COMPILED)
def stretch(nodes: Floats, body: Elements, c: Floats) -> Floats:
    """Fill C, (n_cells, n_points, 6), along the fibre axes, for nodes at (n_nodes, 3), m.

    Returns
    -------
    ndarray of shape (n_cells, n_points)
        J.
    """
    j, f, x = np.empty(body.weight.shape), np.empty((3, 3)), np.empty((10, 3))
    for cell in range(body.cells.shape[0]):
        _gather(nodes, body.cells, cell, x)
        for q in range(body.weight.shape[1]):
            j[cell, q] = point.deform(x, body.slope[cell, q], f, c[cell, q])
    return j


@njit(**COMPILED)
def _add_condensed(growth, factor, ke):
    """Add what the eliminated pressure leaves: the growth of the volume, squared."""
    for r in range(DOFS):
        for s in range(r, DOFS):
            ke[r, s] += factor * growth[r] * growth[s]


@njit(**COMPILED)
def _add_tangent(modulus, slope, along, ke):
    """Add the second derivatives of the energy by the displacements to all entries.

    dP/dF, a matrix over pairs (axis, material axis), stands between the gradients of the shape functions.
    """
    for r in range(9):
        for i in range(3):
            first, second, third = modulus[r, 3 * i], modulus[r, 3 * i + 1], modulus[r, 3 * i + 2]
            for a in range(10):
                along[r, 3 * a + i] = first * slope[a, 0] + second * slope[a, 1] + third * slope[a, 2]
    for a in range(10):
        x, y, z = slope[a, 0], slope[a, 1], slope[a, 2]
        for i in range(3):
            row, first, second, third = ke[3 * a + i], along[3 * i], along[3 * i + 1], along[3 * i + 2]
            for s in range(WIDTH):  # all of the row, of a length known beforehand: that is what vector units like
                row[s] += x * first[s] + y * second[s] + z * third[s]


@njit(**COMPILED)
def _gather(nodes, cells, cell, x):
    """Fill the positions (10, 3) of the nodes of a cell."""
    for a in range(10):
        for i in range(3):
            x[a, i] = nodes[cells[cell, a], i]


@njit(**COMPILED)
def _turn_nodes(body, cell, force, ke, with_tangent):
    """Turn the forces and the tangent of a cell to the directions of its nodes."""
    for a in range(10):
        if body.turned[body.cells[cell, a]]:
            frame = body.frame[body.cells[cell, a]]
            for part in range(4):
                _turn_force(a, frame, force[part])
            if with_tangent:
                _turn_tangent(a, frame, ke)


@njit(**COMPILED)
def _turn_force(a, frame, force):
    """Turn the force of node a to its own directions."""
    x, y, z = force[3 * a], force[3 * a + 1], force[3 * a + 2]
    for i in range(3):
        force[3 * a + i] = frame[i, 0] * x + frame[i, 1] * y + frame[i, 2] * z


@njit(**COMPILED)
def _turn_tangent(a, frame, ke):
    """Turn the tangent of node a to its own directions."""
    for r in range(DOFS):
        for s in range(r):
            ke[r, s] = ke[s, r]
    for s in range(DOFS):
        x, y, z = ke[3 * a, s], ke[3 * a + 1, s], ke[3 * a + 2, s]
        for i in range(3):
            ke[3 * a + i, s] = frame[i, 0] * x + frame[i, 1] * y + frame[i, 2] * z
    for r in range(DOFS):
        x, y, z = ke[r, 3 * a], ke[r, 3 * a + 1], ke[r, 3 * a + 2]
        for i in range(3):
            ke[r, 3 * a + i] = x * frame[i, 0] + y * frame[i, 1] + z * frame[i, 2]


@njit(**COMPILED)
def _pack(ke, packed):
    n = 0
    for r in range(DOFS):
        for s in range(r, DOFS):
            packed[n] = ke[r, s]
            n += 1
