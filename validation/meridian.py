"""An axisymmetric solver for bodies of revolution, independent of the solver that it verifies.

Positions and motion - radial, circumferential and axial - depend on two parameters in the meridian plane, so that a
shell that twists is solved with quadrilaterals: quadratic in the motion, linear and discontinuous in the pressure that
keeps the volume exactly (Boffi, Brezzi & Fortin 2013, section 8.6.3). The stress comes from the energy by a complex
step, its derivative from differences of the stress.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

from echotruth.fem.tetrahedra import Floats
from validation.energies import ConstitutiveModel, first_piola_kirchhoff

Map = Callable[[Floats], Floats]
_GAUSS, _WEIGHT = np.polynomial.legendre.leggauss(3)

_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


class NoConvergence(ArithmeticError):
    """A load at which Newton's method does not converge."""


@dataclass(frozen=True)
class State:
    """Motion and pressure.

    Attributes
    ----------
    motion : ndarray of shape (n_nodes, 3), m
        Radial, circumferential and axial, in the directions that a node has unloaded.
    pressure : ndarray of shape (n_cells, 3), Pa
        Coefficients of 1, xi and eta, positive in tension.
    """

    motion: Floats
    pressure: Floats


class AxisymmetricBody:
    """The equations of a body of revolution.

    Parameters
    ----------
    counts : tuple of int
        Quadrilaterals through the wall and along it.
    position : callable
        Map of two parameters (..., 2), from 0 to 1, to radius and height (..., 2), m. The cavity is where the first is
        0, the axis where the second is 0, the base where it is 1.
    axes : callable
        Map of parameters to fibre axes (..., 3, 3): rows f, s, n in the radial, circumferential and axial direction.
    model : ConstitutiveModel
    """

    def __init__(self, counts: tuple[int, int], position: Map, axes: Map, model: ConstitutiveModel) -> None:
        across, along = (2 * n + 1 for n in counts)
        grid = np.stack(np.meshgrid(np.arange(across), np.arange(along), indexing="ij"), axis=-1).reshape(-1, 2)
        self.parameters = grid / (2 * np.array(counts))
        self.nodes = position(self.parameters)
        first = 2 * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 1, 2)
        offsets = np.stack(np.meshgrid(range(3), range(3), indexing="ij"), axis=-1).reshape(1, 9, 2)
        self.cells = np.ravel_multi_index(tuple(np.moveaxis(first + offsets, -1, 0)), (across, along))
        self.inner = np.arange(along)[np.arange(3) + 2 * np.arange(counts[1])[:, None]]
        self.model = replace(model, bulk=0.0, pointwise_bulk_ratio=0.0)
        self._set_shape_functions(axes)
        axis, base = self.parameters[:, 1] == 0, self.parameters[:, 1] == 1
        free = np.ones((len(self.nodes), 3), dtype=bool)
        free[axis] = [False, False, True]
        free[base] = False
        self.free = np.concatenate([free.ravel(), np.ones(3 * len(self.cells), dtype=bool)])

    def _set_shape_functions(self, axes: Map) -> None:
        """Shape functions, volumes and the map from motion to deformation gradient at the points of the cells."""
        xi = np.stack(np.meshgrid(_GAUSS, _GAUSS, indexing="ij"), axis=-1).reshape(-1, 2)
        weight = np.outer(_WEIGHT, _WEIGHT).ravel()
        (a, da), (b, db) = (_quadratic(xi[:, k]) for k in (0, 1))
        value = np.einsum("qi,qj->qij", a, b).reshape(9, 9)
        slope = np.stack([np.einsum("qi,qj->qij", da, b), np.einsum("qi,qj->qij", a, db)], axis=-1).reshape(9, 9, 2)
        jacobian = np.einsum("caj,qak->cqjk", self.nodes[self.cells], slope)
        slope = np.einsum("qak,cqkj->cqaj", slope, np.linalg.inv(jacobian))
        radius = np.einsum("qa,ca->cq", value, self.nodes[self.cells, 0])
        self.volume = 2 * np.pi * radius * weight * np.abs(np.linalg.det(jacobian))
        self.axes = axes(np.einsum("qa,cai->cqi", value, self.parameters[self.cells]))
        around = value / radius[..., None]
        self.gradient = np.zeros((*radius.shape, 3, 3, 9, 3))
        for i in range(3):
            self.gradient[:, :, i, 0, :, i], self.gradient[:, :, i, 2, :, i] = slope[..., 0], slope[..., 1]
        self.gradient[:, :, 0, 1, :, 1], self.gradient[:, :, 1, 1, :, 0] = -around, around
        self.gradient = self.gradient.reshape(*radius.shape, 9, 27)
        self.modes = np.column_stack([np.ones(9), xi])

    def unloaded_state(self) -> State:
        """The unloaded state."""
        return State(np.zeros((len(self.nodes), 3)), np.zeros((len(self.cells), 3)))

    def solve(self, pressure: float, tension: float, steps: int) -> State:
        """Equilibrium at a pressure of the cavity and an active tension, Pa, raised together in equal steps at first.

        Raises
        ------
        NoConvergence
            If even short steps fail.
        """
        state, done, step = self.unloaded_state(), 0.0, 1.0 / steps
        while done < 1:
            fraction = min(done + step, 1.0)
            try:
                state = self._newton(state, fraction * pressure, fraction * tension)
            except NoConvergence:
                step /= 2
                if step < 1e-3:
                    raise
                continue
            done = fraction
        return state

    # A Newton step that goes too far may overflow; a shorter step of the load is then taken.
    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def _newton(self, state: State, pressure: float, tension: float) -> State:
        first = 0.0
        for _ in range(15):
            force, tangent = self._system(state, pressure, tension)
            if not np.isfinite(force).all():
                break
            step = np.zeros(len(force))
            step[self.free] = splu(tangent).solve(-force[self.free])
            motion, inner = np.split(step, [self.nodes.size + len(self.nodes)])
            state = State(state.motion + motion.reshape(-1, 3), state.pressure + inner.reshape(-1, 3))
            size = float(np.linalg.norm(motion))
            first = first or size
            if not np.isfinite(size) or size > 10 * first:
                break
            if size < 1e-9 * np.linalg.norm(state.motion):
                return state
        raise NoConvergence(f"at {pressure:g} Pa")

    def deformation(self, motion: Floats) -> Floats:
        """Deformation gradient, (n_cells, 9, 3, 3), rows and columns radial, circumferential and axial."""
        change = np.einsum("cqrs,cs->cqr", self.gradient, motion[self.cells].reshape(-1, 27))
        return change.reshape(*change.shape[:2], 3, 3) + np.eye(3)

    def _system(self, state: State, pressure: float, tension: float) -> tuple[Floats, csc_matrix]:
        """Residual of all unknowns, and its derivative by those that are free."""
        f = self.deformation(state.motion)
        p = np.einsum("qm,cm->cq", self.modes, state.pressure)
        cofactor = np.einsum("ikm,jln,cqkl,cqmn->cqij", _LEVI_CIVITA, _LEVI_CIVITA, f, f) / 2
        second = np.einsum("ikm,jln,cqmn->cqijkl", _LEVI_CIVITA, _LEVI_CIVITA, f)
        stress, modulus = self._stress(f, replace(self.model, tension=tension))
        stress = (stress + p[..., None, None] * cofactor).reshape(*p.shape, 9)
        modulus = modulus + (p[..., None, None, None, None] * second).reshape(*p.shape, 9, 9)
        weighted = self.gradient * self.volume[..., None, None]
        force = np.einsum("cqrs,cqr->cs", weighted, stress)
        dilatation = np.einsum("cqij,cqij->cq", cofactor, f) / 3 - 1
        stiffness = np.einsum("cqrs,cqrt,cqtu->csu", weighted, modulus, self.gradient, optimize=True)
        mixed = np.einsum("cqrs,cqr,qm->csm", weighted, cofactor.reshape(*p.shape, 9), self.modes, optimize=True)
        dV, d2V = self._cavity(state.motion)
        return self._assemble(force, dilatation, stiffness, mixed, -pressure * dV, -pressure * d2V)

    def _stress(self, f: Floats, model: ConstitutiveModel) -> tuple[Floats, Floats]:
        """First Piola-Kirchhoff stress (n_cells, 9, 3, 3), Pa, of the energy, and its derivative (n_cells, 9, 9, 9)."""

        def stress(f: Floats) -> Floats:
            return first_piola_kirchhoff(f @ np.swapaxes(self.axes, -1, -2), model.density) @ self.axes

        found, modulus, step = stress(f), np.empty((*f.shape[:2], 9, 9)), 1e-7
        for r in range(9):
            change = step * np.eye(9)[r].reshape(3, 3)
            modulus[..., r] = ((stress(f + change) - found) / step).reshape(*f.shape[:2], 9)
        return found, modulus

    def _cavity(self, motion: Floats) -> tuple[Floats, Floats]:
        """First and second derivative of the volume of the cavity, int pi r^2 dz, edge by edge."""
        value, slope = _quadratic(_GAUSS)
        positions = (motion + np.insert(self.nodes, 1, 0.0, axis=1))[self.inner]
        x, y, _ = np.einsum("qa,eai->ieq", value, positions)
        rise = np.einsum("qa,ea->eq", slope, positions[..., 2])
        first = np.empty((len(positions), 3, 3))
        first[..., 0] = np.einsum("q,eq,qa->ea", _WEIGHT, 2 * x * rise, value)
        first[..., 1] = np.einsum("q,eq,qa->ea", _WEIGHT, 2 * y * rise, value)
        first[..., 2] = np.einsum("q,eq,qa->ea", _WEIGHT, x**2 + y**2, slope)
        second = np.zeros((len(positions), 3, 3, 3, 3))
        for i, coordinate in ((0, x), (1, y)):
            second[:, :, i, :, i] = np.einsum("q,eq,qa,qb->eab", _WEIGHT, 2 * rise, value, value)
            second[:, :, i, :, 2] = np.einsum("q,eq,qa,qb->eab", _WEIGHT, 2 * coordinate, value, slope)
            second[:, :, 2, :, i] = np.swapaxes(second[:, :, i, :, 2], 1, 2)
        return np.pi * first.reshape(-1, 9), np.pi * second.reshape(-1, 9, 9)

    def _assemble(
        self, force, dilatation, stiffness, mixed, cavity_force, cavity_stiffness
    ) -> tuple[Floats, csc_matrix]:
        n, m = 3 * len(self.nodes), 3 * len(self.cells)
        of_cell = (3 * self.cells[..., None] + np.arange(3)).reshape(-1, 27)
        of_edge = (3 * self.inner[..., None] + np.arange(3)).reshape(-1, 9)
        of_mode = n + np.arange(m).reshape(-1, 3)
        total = np.zeros(n + m)
        np.add.at(total, of_cell, force)
        np.add.at(total, of_edge, cavity_force)
        total[n:] = np.einsum("cq,cq,qm->cm", dilatation, self.volume, self.modes).ravel()
        blocks = [
            (of_cell, of_cell, stiffness),
            (of_edge, of_edge, cavity_stiffness),
            (of_cell, of_mode, mixed),
            (of_mode, of_cell, np.swapaxes(mixed, 1, 2)),
        ]
        rows = np.concatenate([np.repeat(row, column.shape[1], axis=1).ravel() for row, column, _ in blocks])
        columns = np.concatenate([np.tile(column, row.shape[1]).ravel() for row, column, _ in blocks])
        entries = np.concatenate([block.ravel() for *_, block in blocks])
        matrix = coo_matrix((entries, (rows, columns)), shape=(n + m, n + m)).tocsc()
        return total, matrix[self.free][:, self.free]


def _quadratic(xi: Floats) -> tuple[Floats, Floats]:
    """Quadratic shape functions of an edge from -1 to 1 and their derivatives, each (n, 3)."""
    value = np.column_stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2])
    return value, np.column_stack([xi - 0.5, -2 * xi, xi + 0.5])
