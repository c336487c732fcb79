"""Equilibrium of the heart under a cavity pressure, and its Newton corrections.

The unknowns are the displacements, the pressure of each cell and, if asked for, one
number more - the active tension or the stiffness - with the cavity volume as its
equation. That last pair borders the tangent: one factorization serves both
right-hand sides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from echotruth.mechanics import cavity, element
from echotruth.mechanics.assembly import Assembly
from echotruth.mechanics.sparse import factorization
from echotruth.tetrahedra import Mesh

Floats = NDArray[np.float64]
Unknown = Literal["stiffness", "tension"] | None


@dataclass(frozen=True)
class State:
    """What is solved for.

    Attributes
    ----------
    solution : ndarray of shape (n_equations,), m
    pressure : ndarray of shape (n_cells,), Pa
        Of the cells, positive in tension.
    stiffness, tension : float, Pa
        C and T_Ca.
    """

    solution: Floats
    pressure: Floats
    stiffness: float
    tension: float

    def moved(self, step: Correction, share: float, unknown: Unknown) -> State:
        """The state with a share of a correction added."""
        solution, pressure = self.solution + share * step.solution, self.pressure + share * step.pressure
        state = State(solution, pressure, self.stiffness, self.tension)
        return replace(state, **{unknown: getattr(self, unknown) + share * step.scalar}) if unknown else state


@dataclass(frozen=True)
class Correction:
    """Changes of the unknowns, in the units of `State`; the scalar is that of the stiffness or tension."""

    solution: Floats
    pressure: Floats
    scalar: float

    @property
    def size(self) -> float:
        """Root mean square of the change of the displacements, m."""
        return float(np.sqrt(np.mean(self.solution**2)))


@dataclass(frozen=True)
class Load:
    """What the heart must meet: cavity pressure (Pa), and volume (m^3) where a scalar is unknown."""

    pressure: float
    volume: float

    def toward(self, other: Load, share: float) -> Load:
        """The load at a share of the way to another."""
        pressure = self.pressure + share * (other.pressure - self.pressure)
        return Load(pressure, self.volume + share * (other.volume - self.volume))


@dataclass(frozen=True)
class Imbalance:
    """How far a state is from equilibrium.

    Attributes
    ----------
    force : ndarray of shape (n_equations,), N
    growth : ndarray of shape (n_cells,)
        J - 1 - p / kappa, the mean over each cell.
    volume : float, m^3
        Cavity volume less the one asked for.
    force_error, volume_error, growth_error : float
        Relative norms of the three: to the load of the blood, to the volume asked for and to one.
    """

    force: Floats
    growth: Floats
    volume: float
    force_error: float
    volume_error: float
    growth_error: float

    @property
    def error(self) -> float:
        """Sum of the relative norms."""
        return self.force_error + self.volume_error + self.growth_error


class Equilibrium:
    """The equations of one heart."""

    def __init__(self, mesh: Mesh, fibre_frames: Floats, law: element.Law, base: Literal["radial_free", "fixed"]):
        self.mesh, self.law = mesh, law
        self.assembly = Assembly(mesh, base)
        self.body = element.elements(mesh, fibre_frames, self.assembly.frames)
        self.unloaded = np.sum(self.body.weight, axis=1)
        self._cells = element.blocks(len(mesh.cells), with_tangent=True)
        self._facets = np.empty((len(mesh.endo), 6, 3)), np.empty((len(mesh.endo), 18, 18))
        self._solver = factorization()

    def close(self) -> None:
        """Give the memory of the factors back."""
        self._solver.close()

    def rest(self, stiffness: float) -> State:
        """The unloaded state."""
        return State(np.zeros(self.assembly.n_equations), np.zeros(len(self.mesh.cells)), stiffness, 0.0)

    def positions(self, state: State) -> Floats:
        """Deformed nodes, shape (n_nodes, 3), m."""
        return self.mesh.nodes + self.assembly.spread(state.solution)

    def volume(self, state: State) -> float:
        """Volume of the cavity, m^3."""
        return cavity.cavity_volume(self.positions(state), self.mesh.endo)

    def imbalance(self, state: State, load: Load, unknown: Unknown) -> Imbalance:
        """Residuals of a state under a load."""
        return self._imbalance(state, load, unknown, self._cells._replace(tangent=np.empty((0, element.PACKED))))

    # Far from a solution the exponential may overflow; the line search then goes back.
    @np.errstate(over="ignore", invalid="ignore")
    def _imbalance(self, state: State, load: Load, unknown: Unknown, out: element.Blocks) -> Imbalance:
        nodes = self.positions(state)
        scale = np.array([state.stiffness, state.tension])
        element.respond(nodes, self.body, self.law, scale, state.pressure, out)
        cavity.load(nodes, self.mesh.endo, *self._facets)
        self._gradient, self._hessian = self.assembly.turn(self.mesh.endo, *self._facets)
        blood = load.pressure * self.assembly.vector(self._gradient, group=1)
        whole = scale[0] * out.force[:, 0] + scale[1] * out.force[:, 1] + state.pressure[:, None] * out.force[:, 2]
        force = self.assembly.vector(whole) - blood
        growth = out.volume / self.unloaded - 1 - state.pressure / self.law.bulk_modulus
        volume = cavity.cavity_volume(nodes, self.mesh.endo) - load.volume if unknown else 0.0
        errors = norm(force) / norm(blood), abs(volume) / load.volume if unknown else 0.0
        return Imbalance(force, growth, volume, *errors, norm(growth) / np.sqrt(len(growth)))

    def linearize(self, state: State, load: Load, unknown: Unknown) -> Tangent:
        """Factor the tangent at a state."""
        self._imbalance(state, load, unknown, self._cells)
        matrix = self.assembly.matrix(self._cells.tangent, -load.pressure * self._hessian)
        self._solver.factor(matrix)
        return Tangent(self, unknown)

    def solve(self, right: Floats) -> Floats:
        """Solution for a right-hand side (n_equations,) with the factors of the last tangent."""
        return self._solver.solve(right[:, None])[:, 0]


class Tangent:
    """The factored tangent at one state, from which corrections of this and later states are had."""

    def __init__(self, equations: Equilibrium, unknown: Unknown) -> None:
        self._equations, self._bordered = equations, unknown is not None
        force = equations._cells.force
        self._growth = force[:, element.VOLUMETRIC].copy()
        if self._bordered:
            self._gradient = equations.assembly.vector(equations._gradient, group=1)
            part = element.PASSIVE if unknown == "stiffness" else element.ACTIVE
            self._response = equations.solve(-equations.assembly.vector(force[:, part]))
            self._compliance = float(np.sum(self._gradient * self._response))

    def correction(self, imbalance: Imbalance) -> Correction:
        """Newton correction of an imbalance."""
        heart = self._equations
        bulk = heart.law.bulk_modulus
        condensed = heart.assembly.vector(bulk * imbalance.growth[:, None] * self._growth)
        solution, scalar = heart.solve(-imbalance.force - condensed), 0.0
        if self._bordered:
            scalar = -(imbalance.volume + float(np.sum(self._gradient * solution))) / self._compliance
            solution += scalar * self._response
        growth = np.sum(self._growth * heart.assembly.of_cells(solution), axis=1) / heart.unloaded
        return Correction(solution, bulk * (imbalance.growth + growth), scalar)


def norm(vector: Floats) -> float:
    """Euclidean norm, summed on one thread."""
    with np.errstate(over="ignore"):  # a trial step may go anywhere; an infinite norm refuses it
        return float(np.sqrt(np.sum(vector**2)))
