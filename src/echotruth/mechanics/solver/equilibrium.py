"""Equilibrium of the heart under a cavity pressure, and its Newton corrections.

The unknowns are the displacements, the pressure of each cell and, if asked for, one
number more - the active tension, the stiffness or the cavity pressure - with the cavity
volume as its equation. That last pair borders the tangent: one factorization serves both
right-hand sides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.sparse import factorization
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.solver import cavity, element
from echotruth.mechanics.solver import stress_point as point
from echotruth.mechanics.solver.assembly import CELLS, ENDO, EPI, Assembly
from echotruth.mechanics.solver.support import Support, springs

Unknown = Literal["stiffness", "tension", "cavity_pressure"] | None


@dataclass(frozen=True)
class State:
    """What is solved for.

    Attributes
    ----------
    solution : ndarray of shape (n_equations,), m
    pressure : ndarray of shape (n_cells,), Pa
        Of the cells, positive in tension.
    stiffness, tension, cavity_pressure : float, Pa
        C, T_Ca and the pressure of the blood.
    """

    solution: Floats
    pressure: Floats
    stiffness: float
    tension: float = 0.0
    cavity_pressure: float = 0.0

    def moved(self, step: Correction, share: float, unknown: Unknown) -> State:
        """The state with a share of a correction added."""
        solution, pressure = self.solution + share * step.solution, self.pressure + share * step.pressure
        state = replace(self, solution=solution, pressure=pressure)
        return replace(state, **{unknown: getattr(self, unknown) + share * step.scalar}) if unknown else state


@dataclass(frozen=True)
class Correction:
    """Changes of the unknowns, in the units of `State`; the scalar is that of the one number more."""

    solution: Floats
    pressure: Floats
    scalar: float

    @property
    def size(self) -> float:
        """Norm of the change of the displacements, m."""
        return norm(self.solution)

    def along(self, other: Correction) -> float:
        """Part of another that lies in this one, by the displacements."""
        return float(np.sum(self.solution * other.solution) / np.sum(other.solution**2))

    def plus(self, factor: float, other: Correction) -> Correction:
        """This and a multiple of another."""
        changes = (getattr(self, name) + factor * getattr(other, name) for name in ("solution", "pressure", "scalar"))
        return Correction(*changes)


@dataclass(frozen=True)
class Load:
    """What the heart must meet.

    Attributes
    ----------
    pressure : float, Pa
        In the cavity; of no account where it is solved.
    volume : float, m^3
        Of the cavity; of no account where no number more is solved.
    share : ndarray of shape (n_cells,), or 1
        Part of the state's tension that each cell bears.
    tension : ndarray of shape (n_cells,), or float, Pa
        Tension of each cell beside that.
    moved : float
        Part of the displacement that the support imposes.
    time : float, s
        When: the wall is viscous between two times.
    """

    pressure: float
    volume: float
    share: Floats | float = 1.0
    tension: Floats | float = 0.0
    moved: float = 0.0
    time: float = 0.0

    def toward(self, other: Load, share: float) -> Load:
        """The load at a share of the way to another."""
        names = ("pressure", "volume", "share", "tension", "moved", "time")
        pairs = ((getattr(self, name), getattr(other, name)) for name in names)
        return Load(*(first + share * (last - first) for first, last in pairs))


@dataclass(frozen=True)
class Past:
    """The state before, against which the wall is viscous, and the time since, s."""

    state: State
    time: float
    moved: float = 0.0


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
        Relative norms of the three: to the forces on the nodes, to the volume asked for and to one.
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

    @property
    def worst(self) -> float:
        """Largest of the relative norms."""
        return max(self.force_error, self.volume_error, self.growth_error)


class Equilibrium:
    """The equations of one heart.

    Parameters
    ----------
    mesh : Mesh
        Unloaded.
    fibre_frames : ndarray of shape (n_cells, n_points, 3, 3)
        Rows f, s, n at the points of `quadrature.tetrahedron`.
    law : element.Law
    support : Support
    stiffness_scale : ndarray of shape (n_cells,), optional
        Factor of the stiffness of each cell.
    """

    def __init__(
        self,
        mesh: Mesh,
        fibre_frames: Floats,
        law: element.Law,
        support: Support,
        stiffness_scale: Floats | None = None,
    ):
        self.mesh, self.law, self.support = mesh, law, support
        self.assembly = Assembly(mesh, support)
        self.body = element.elements(mesh, fibre_frames, support.frames)
        self.unloaded = np.sum(self.body.weight, axis=1)
        self.stiffness_scale = np.ones(len(mesh.cells)) if stiffness_scale is None else stiffness_scale
        self._cells = element.blocks(len(mesh.cells), with_tangent=True)
        self._facets = np.empty((len(mesh.endo), 18, 18))
        self._springs = springs(mesh, support.spring) if support.spring else None
        self._solver = factorization(single=True)
        self.past: Past | None = None
        self._rate, self._before = np.zeros(len(mesh.cells)), np.zeros((*self.body.weight.shape, 6))

    def remember(self, past: Past) -> None:
        """Be viscous against a past state; without time since, the wall is elastic."""
        self.past = past
        elastic = past.time <= 0 or self.law.viscosity == 0
        self._rate[:] = 0.0 if elastic else self.law.viscosity / past.time
        if not elastic:
            element.stretch(self.positions(past.state, past.moved), self.body, self._before)

    def close(self) -> None:
        """Give the memory of the factors back."""
        self._solver.close()

    def rest(self, stiffness: float) -> State:
        """The unloaded state."""
        return State(np.zeros(self.assembly.n_equations), np.zeros(len(self.mesh.cells)), stiffness)

    def positions(self, state: State, moved: float = 0.0) -> Floats:
        """Deformed nodes, shape (n_nodes, 3), m, with a part of the displacement that the support imposes."""
        nodes = self.mesh.nodes + self.assembly.spread(state.solution)
        return nodes if self.support.moved is None else nodes + moved * self.support.moved

    def volume(self, state: State) -> float:
        """Volume of the cavity, m^3."""
        return cavity.cavity_volume(self.positions(state), self.mesh.endo)

    def tension(self, state: State, load: Load) -> Floats:
        """T_Ca of each cell, shape (n_cells,), Pa."""
        return np.zeros(len(self.mesh.cells)) + state.tension * load.share + load.tension

    def imbalance(self, state: State, load: Load, unknown: Unknown) -> Imbalance:
        """Residuals of a state under a load."""
        return self._imbalance(state, load, unknown, self._cells._replace(tangent=np.empty((0, element.PACKED))))

    # Far from a solution the exponential may overflow; the line search then goes back.
    @np.errstate(over="ignore", invalid="ignore")
    def _imbalance(self, state: State, load: Load, unknown: Unknown, out: element.Blocks) -> Imbalance:
        nodes = self.positions(state, load.moved)
        stiffness, tension = state.stiffness * self.stiffness_scale, self.tension(state, load)
        scale = element.Load(stiffness, tension, state.pressure, self._rate, self._before)
        element.respond(nodes, self.body, self.law, scale, out)
        slope = cavity.load(nodes, self.mesh.endo)
        self._gradient = self.assembly.vector(self.assembly.turn(self.mesh.endo, slope), ENDO)
        inside = self.assembly.vector(out.force[:, point.WHOLE]) + self._spring_force(nodes)
        blood = (state.cavity_pressure if unknown == "cavity_pressure" else load.pressure) * self._gradient
        growth = out.volume / self.unloaded - 1 - state.pressure / self.law.bulk_modulus
        # The volume is of third degree in the positions (Euler's theorem).
        volume = float(np.sum(slope * nodes[self.mesh.endo])) / 3 - load.volume if unknown else 0.0
        errors = norm(inside - blood) / self._size(blood, out), abs(volume) / load.volume if unknown else 0.0
        return Imbalance(inside - blood, growth, volume, *errors, norm(growth) / np.sqrt(len(growth)))

    def _size(self, blood: Floats, out: element.Blocks) -> float:
        """Norm of the forces that balance at the nodes: of the blood, and of the cells where there is none."""
        return norm(blood) or norm(out.force[:, point.WHOLE]) or 1.0

    def _spring_force(self, nodes: Floats) -> Floats | float:
        if self._springs is None:
            return 0.0
        moved = (nodes - self.mesh.nodes)[self.mesh.epi].reshape(-1, 18)
        force = np.einsum("frs,fs->fr", self._springs, moved).reshape(-1, 6, 3)
        return self.assembly.vector(self.assembly.turn(self.mesh.epi, force), EPI)

    def linearize(self, state: State, load: Load, unknown: Unknown) -> Tangent:
        """Factor the tangent at a state."""
        self._imbalance(state, load, unknown, self._cells)
        pressure = state.cavity_pressure if unknown == "cavity_pressure" else load.pressure
        cavity.stiffness(self.positions(state, load.moved), self.mesh.endo, self._facets)
        facets = self.assembly.pack(self.mesh.endo, -pressure * self._facets)
        around = [] if self._springs is None else [self.assembly.pack(self.mesh.epi, self._springs)]
        self._solver.factor(self.assembly.matrix(self._cells.tangent, facets, *around))
        return Tangent(self, unknown, load, state)

    def solve(self, right: Floats) -> Floats:
        """Solution for a right-hand side (n_equations,) with the factors of the last tangent."""
        return self._solver.solve(right[:, None])[:, 0]

    def response(self, unknown: Unknown, load: Load) -> Floats:
        """Force (n_equations,) on the nodes for a change of the one number more, at the state evaluated last."""
        if unknown == "cavity_pressure":
            return self._gradient
        part, scale = point.PASSIVE, -self.stiffness_scale
        if unknown == "tension":
            part, scale = point.ACTIVE, -load.share * np.ones(len(self.mesh.cells))
        return self.assembly.vector(scale[:, None] * self._cells.force[:, part], CELLS)


class Tangent:
    """The factored tangent at one state, from which corrections of this and later states are had."""

    def __init__(self, equations: Equilibrium, unknown: Unknown, load: Load, state: State) -> None:
        self._equations, self.unknown, self.load, self.state = equations, unknown, load, state
        self.past = equations.past
        self._growth = equations._cells.force[:, point.VOLUMETRIC].copy()
        if unknown:
            self._gradient = equations._gradient
            self._response = equations.solve(equations.response(unknown, load))
            self._compliance = float(np.sum(self._gradient * self._response))

    def correction(self, imbalance: Imbalance) -> Correction:
        """Newton correction of an imbalance."""
        heart = self._equations
        bulk = heart.law.bulk_modulus
        condensed = heart.assembly.vector(bulk * imbalance.growth[:, None] * self._growth)
        solution, scalar = heart.solve(-imbalance.force - condensed), 0.0
        if self.unknown:
            scalar = -(imbalance.volume + float(np.sum(self._gradient * solution))) / self._compliance
            solution += scalar * self._response
        growth = np.sum(self._growth * heart.assembly.of_cells(solution), axis=1) / heart.unloaded
        return Correction(solution, bulk * (imbalance.growth + growth), scalar)


def norm(vector: Floats) -> float:
    """Euclidean norm, summed on one thread."""
    with np.errstate(over="ignore"):  # a trial step may go anywhere; an infinite norm refuses it
        return float(np.sqrt(np.sum(vector**2)))
