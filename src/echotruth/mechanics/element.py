"""Quadratic tetrahedron with one pressure, condensed.

Perturbed Lagrangian: the pressure p of a cell multiplies the growth of its volume,
int (J - 1) p - p^2 / (2 kappa), and is an unknown of its own; each Newton step
eliminates it within the cell (Simo & Hughes, Computational Inelasticity, section 7.3;
Bonet & Wood, Nonlinear Continuum Mechanics, section 8.6).
Strains are taken in the fibre axes: the gradients of the shape functions are turned
into them once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from echotruth.mechanics import material
from echotruth.mechanics.fibres import gradients
from echotruth.mechanics.quadrature import tetrahedron
from echotruth.tetrahedra import Mesh

Floats = NDArray[np.float64]

DOFS = 30
"""Displacements of a cell, node by node."""

PACKED = DOFS * (DOFS + 1) // 2
"""Entries of the upper triangle of its tangent, row by row."""

PASSIVE, ACTIVE, VOLUMETRIC = 0, 1, 2
"""Parts of the force: for a stiffness, an active tension and a pressure of one."""


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
    moduli : ndarray of shape (6,)
        As given by `material.moduli`.
    length_dependence : float
        beta of the active law.
    bulk_modulus : float, Pa
    """

    moduli: Floats
    length_dependence: float
    bulk_modulus: float


class Blocks(NamedTuple):
    """Response of each cell.

    Attributes
    ----------
    force : ndarray of shape (n_cells, 3, 30)
        Passive (m^2), active (m^2) and volumetric (m^2) force for a stiffness, tension and pressure of one.
    volume : ndarray of shape (n_cells,), m^3
        Deformed volume; not a number where the cell is inside out.
    tangent : ndarray of shape (n_cells, 465) or (0, 465), N/m
        Upper triangle of the condensed tangent; left out if there is no room for it.
    """

    force: Floats
    volume: Floats
    tangent: Floats


def elements(mesh: Mesh, fibre_frames: Floats, frame: Floats) -> Elements:
    """Cells of a wall with fibres.

    Parameters
    ----------
    mesh : Mesh
    fibre_frames : ndarray of shape (n_cells, n_points, 3, 3)
        Rows f, s, n at the points of `quadrature.tetrahedron`.
    frame : ndarray of shape (n_nodes, 3, 3)
        Rows: the directions of the displacements of each node.
    """
    xi, weight = tetrahedron()
    slope, volume = gradients(mesh, xi)
    slope = np.einsum("cqai,cqji->cqaj", slope, fibre_frames)
    turned = np.any(frame != np.eye(3), axis=(1, 2))
    return Elements(mesh.cells, np.ascontiguousarray(slope), volume * weight, frame, turned)


def blocks(n_cells: int, with_tangent: bool) -> Blocks:
    """Room for the response of cells."""
    tangent = np.empty((n_cells if with_tangent else 0, PACKED))
    return Blocks(np.empty((n_cells, 3, DOFS)), np.empty(n_cells), tangent)


@njit(cache=True, parallel=True, error_model="numpy")
def respond(nodes: Floats, body: Elements, law: Law, scale: Floats, pressure: Floats, out: Blocks) -> None:
    """Forces and tangents of all cells.

    Each cell writes to its own place, so the result does not depend on the number of threads.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Deformed positions.
    body : Elements
    law : Law
    scale : ndarray of shape (2,), Pa
        Stiffness C and active tension T_Ca.
    pressure : ndarray of shape (n_cells,), Pa
    out : Blocks
        Filled.
    """
    for cell in prange(body.cells.shape[0]):
        _cell(cell, nodes, body, law, scale, pressure[cell], out)


@njit(cache=True, error_model="numpy")
def _cell(cell, nodes, body, law, scale, pressure, out):
    nodes_of, force, with_tangent = body.cells[cell], out.force[cell], out.tangent.shape[0] > 0
    ke = np.zeros((DOFS, DOFS))
    stress, tangent, c, inverse = np.empty((3, 6)), np.empty((6, 6)), np.empty(6), np.empty(6)
    f, x, volume = np.empty((3, 3)), np.empty((10, 3)), 0.0
    for a in range(10):
        x[a] = nodes[nodes_of[a]]
    force[:] = 0.0
    for q in range(body.weight.shape[1]):
        slope, weight = body.slope[cell, q], body.weight[cell, q]
        j = _deform(x, slope, f, c)
        _stress(c, inverse, j, law, scale, pressure, stress, tangent)
        _add_force(f, slope, stress, weight, force)
        if with_tangent:
            total = scale[0] * stress[0] + scale[1] * stress[1] + pressure * stress[2]
            _add_tangent(f, slope, total, tangent, weight, ke)
        volume += weight * j if j > 0 else np.nan
    out.volume[cell] = volume
    if with_tangent:
        _add_condensed(force[VOLUMETRIC], law.bulk_modulus / np.sum(body.weight[cell]), ke)
    for a in range(10):
        if body.turned[nodes_of[a]]:
            _turn(a, body.frame[nodes_of[a]], force, ke)
    if with_tangent:
        _pack(ke, out.tangent[cell])


@njit(cache=True, error_model="numpy")
def _add_condensed(growth, factor, ke):
    """Add what the eliminated pressure leaves: the growth of the volume, squared."""
    for r in range(DOFS):
        for s in range(r, DOFS):
            ke[r, s] += factor * growth[r] * growth[s]


@njit(cache=True, error_model="numpy")
def _deform(x, slope, f, c):
    """Fill the deformation gradient (3, 3) and C (6,); returns det F, which is negative inside out."""
    for i in range(3):
        for k in range(3):
            total = 0.0
            for a in range(10):
                total += x[a, i] * slope[a, k]
            f[i, k] = total
    for k in range(6):
        p, q = material.PAIRS[k, 0], material.PAIRS[k, 1]
        c[k] = f[0, p] * f[0, q] + f[1, p] * f[1, q] + f[2, p] * f[2, q]
    return (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )


@njit(cache=True, error_model="numpy")
def _stress(c, inverse, j, law, scale, pressure, stress, tangent):
    """Fill the parts of the stress (3, 6), each for a factor of one, and the whole tangent (6, 6)."""
    material.invert(c, inverse)
    material.passive(c, inverse, abs(j), law.moduli, stress[0], tangent)
    tangent *= scale[0]
    stress[1:] = 0.0
    stress[1, 0], slope = material.active(c[0], law.length_dependence)
    tangent[0, 0] += scale[1] * slope
    material.volumetric(inverse, j, pressure, stress[2], tangent)


@njit(cache=True, error_model="numpy")
def _add_force(f, slope, stress, weight, force):
    for part in range(3):
        first = np.empty((3, 3))
        for i in range(3):
            for k in range(3):
                first[i, k] = weight * (
                    f[i, 0] * material.entry(stress[part], 0, k)
                    + f[i, 1] * material.entry(stress[part], 1, k)
                    + f[i, 2] * material.entry(stress[part], 2, k)
                )
        for a in range(10):
            for i in range(3):
                force[part, 3 * a + i] += (
                    first[i, 0] * slope[a, 0] + first[i, 1] * slope[a, 1] + first[i, 2] * slope[a, 2]
                )


@njit(cache=True, error_model="numpy")
def _add_tangent(f, slope, stress, tangent, weight, ke):
    """Add B^T D B, and the geometric part, to the upper triangle."""
    b, db = np.empty((6, DOFS)), np.zeros((6, DOFS))
    _strain_rates(f, slope, b)
    for k in range(6):
        for m in range(6):
            factor = weight * tangent[k, m]
            for s in range(DOFS):
                db[k, s] += factor * b[m, s]
    for r in range(DOFS):
        for k in range(6):
            factor = b[k, r]
            for s in range(r, DOFS):
                ke[r, s] += factor * db[k, s]
    _add_geometric(slope, stress, weight, ke)


@njit(cache=True, error_model="numpy")
def _add_geometric(slope, stress, weight, ke):
    """Add slope . S slope of every two nodes to the diagonals of their blocks."""
    along = np.empty(3)
    for a in range(10):
        for k in range(3):
            along[k] = weight * (
                material.entry(stress, k, 0) * slope[a, 0]
                + material.entry(stress, k, 1) * slope[a, 1]
                + material.entry(stress, k, 2) * slope[a, 2]
            )
        for d in range(a, 10):
            geometric = along[0] * slope[d, 0] + along[1] * slope[d, 1] + along[2] * slope[d, 2]
            for i in range(3):
                ke[3 * a + i, 3 * d + i] += geometric


@njit(cache=True, error_model="numpy")
def _strain_rates(f, slope, b):
    """Fill B (6, 30): Green-Lagrange strain, shear doubled, of a unit displacement of each node."""
    for k in range(6):
        p, q = material.PAIRS[k, 0], material.PAIRS[k, 1]
        twice = 0.0 if p == q else 1.0
        for a in range(10):
            for i in range(3):
                b[k, 3 * a + i] = f[i, p] * slope[a, q] + twice * f[i, q] * slope[a, p]


@njit(cache=True, error_model="numpy")
def _turn(a, frame, force, ke):
    """Turn the forces and the tangent of node a to its own directions."""
    for r in range(DOFS):
        for s in range(r):
            ke[r, s] = ke[s, r]
    rows = frame @ np.ascontiguousarray(ke[3 * a : 3 * a + 3])
    rows[:, 3 * a : 3 * a + 3] = np.ascontiguousarray(rows[:, 3 * a : 3 * a + 3]) @ frame.T
    ke[3 * a : 3 * a + 3] = rows
    ke[:, 3 * a : 3 * a + 3] = rows.T
    force[:, 3 * a : 3 * a + 3] = np.ascontiguousarray(force[:, 3 * a : 3 * a + 3]) @ frame.T


@njit(cache=True, error_model="numpy")
def _pack(ke, packed):
    n = 0
    for r in range(DOFS):
        for s in range(r, DOFS):
            packed[n] = ke[r, s]
            n += 1
