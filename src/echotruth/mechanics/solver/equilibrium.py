"""Equilibrium of the heart under a cavity pressure, and its Newton corrections.

Unknowns are the displacement u, the pressure p_c of each cell (positive in tension) and, if asked for, one scalar s:
the active tension T, the stiffness C or the cavity pressure P. The weak form, virtual work for every displacement v
that the support leaves free (:func:`.support.base_support`), is

      sum_c int_c F S : grad v dV                        element.evaluate, stress_point.add_force
    + int_epi  [k n.(u - u_ED) + d n.u'] n.v dA          surroundings.surface_matrix, Equilibrium._spring_force
    + int_base [k_z u_z v_z + k_t u_t v_t] dA            the same; only if the base is elastic
    + P int_endo v.n da                                  cavity.volume_gradient; n points into the cavity
    + q P int_right v.n da                               the same, if there is a right ventricle; q P is its pressure
    = 0,

    int_c (J - 1 - p_c / kappa) dV = 0 for each cell c,  element.evaluate (Response.volume)
    V(u) = V_target, if there is an s,                   cavity.cavity_volume; with a circulation V_target follows P

with the second Piola-Kirchhoff stress S of the wall, term by term (:func:`.stress_point.evaluate`),

    S = C S_passive                                      a law of materials/, stress.isochoric_stress
      + T sum_a share_a S_active(lambda_a, lambda_a') a (x) a
                                                         active_stress.py; the T of each cell: activation.py
      + [p_c + C b (J - 1)] J C_G^-1                     stress_point.evaluate; b is the pointwise bulk ratio
      + eta dE/dt                                        the same, over the step since the previous state
      + G (E - E_ED)                                     the same; G is the stiffness of a taut scar.

Here x = X + u, F = dx/dX, J = det F, C_G = F^T F, E = (C_G - I) / 2, and a is fibre, sheet and normal, along which the
stretch is lambda_a and the share of the tension 1 and those of the configuration; only the stress along the fibre
depends on the rate lambda_a' over the same step. Springs act on the unloaded surface of normal n, per area: k and d are
those of the pericardium, at rest at end-diastole (ED), k_z and k_t those of the base along and around the long axis; u'
is the velocity. Stresses are in Pa, lengths in m.

Discretised by quadratic tetrahedra (:mod:`.element`) and summed by :class:`.assembly.Assembly`, the residuals are

    r = f(u, p, s) + K_e (u - u_rest) + D_e (u - u_previous) / dt - P dW/du,
    r_c = v_c(u) / V_c - 1 - p_c / kappa,    r_V = V(u) - V_target,

with v_c and V_c the deformed and unloaded volume of a cell and V(u) that of the cavity (:meth:`Equilibrium.residual`).
W = V + q V_right, which is V in a left ventricle alone. K_e and D_e are the springs and dashpots of the surroundings
(:mod:`.surroundings`), dt the time since the previous state. P is work-conjugate to W: its load P dW/du does the work
P dW. Newton's method eliminates p_c in its cell and borders the tangent with s, so that one factorization of K serves
both right-hand sides. With G_c = dv_c/du and g = dV/du:

    K = df/du + K_e + D_e / dt - P d2W/du2 + sum_c kappa / V_c G_c G_c^T,
    K du_0 = -r - sum_c kappa r_c G_c,    K du_s = -dr/ds,
    ds = -(r_V + g . du_0) / (g . du_s - dV_target/ds),    du = du_0 + ds du_s,    dp_c = kappa (r_c + G_c . du / V_c).
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, fields, replace
from typing import Literal, NamedTuple

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.sparse import factorization
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.solver import cavity, element
from echotruth.mechanics.solver.assembly import CELLS, ENDO, RIGHT_ENDO, Assembly
from echotruth.mechanics.solver.stress_point import ACTIVE, PASSIVE, TOTAL, VOLUMETRIC
from echotruth.mechanics.solver.support import Support
from echotruth.mechanics.solver.surroundings import Springs

Unknown = Literal["stiffness", "tension", "cavity_pressure"] | None
"""The scalar unknown."""


@dataclass(frozen=True)
class State:
    """The unknowns.

    Attributes
    ----------
    solution : ndarray of shape (n_equations,), m
        Free displacements.
    cell_pressure : ndarray of shape (n_cells,), Pa
        Positive in tension.
    stiffness, tension, cavity_pressure : float, Pa
        C, T_Ca and the pressure of the blood.
    """

    solution: Floats
    cell_pressure: Floats
    stiffness: float
    tension: float = 0.0
    cavity_pressure: float = 0.0

    def corrected(self, correction: Correction, damping: float, unknown: Unknown) -> State:
        """The state plus `damping` times a correction."""
        solution = self.solution + damping * correction.solution
        state = replace(self, solution=solution, cell_pressure=self.cell_pressure + damping * correction.cell_pressure)
        return replace(state, **{unknown: getattr(self, unknown) + damping * correction.scalar}) if unknown else state


@dataclass(frozen=True)
class Correction:
    """Changes of the unknowns, in the units of `State`; `scalar` is that of the scalar unknown."""

    solution: Floats
    cell_pressure: Floats
    scalar: float

    @property
    def norm(self) -> float:
        """Norm of the change of the displacements, m."""
        return norm(self.solution)

    def projection(self, other: Correction) -> float:
        """<self, other> / <other, other>, of the displacements."""
        return float(np.sum(self.solution * other.solution) / np.sum(other.solution**2))

    def plus(self, factor: float, other: Correction) -> Correction:
        """This correction plus `factor` times another."""
        return Correction(*(getattr(self, k.name) + factor * getattr(other, k.name) for k in fields(self)))


@dataclass(frozen=True)
class Load:
    """The load that a state balances.

    Attributes
    ----------
    pressure : float, Pa
        Cavity pressure; ignored where it is solved.
    volume : float, m^3
        Cavity volume; ignored where there is no scalar unknown.
    tension_fraction : ndarray of shape (n_cells,), or 1
        Fraction of the state's tension that each cell bears.
    tension : ndarray of shape (n_cells,), or float, Pa
        Tension of each cell in addition.
    prescribed_fraction : float
        Fraction of the displacement that the support prescribes.
    time : float, s
    """

    pressure: float
    volume: float
    tension_fraction: Floats | float = 1.0
    tension: Floats | float = 0.0
    prescribed_fraction: float = 0.0
    time: float = 0.0

    def toward(self, other: Load, fraction: float) -> Load:
        """The load at a fraction of the way to another."""
        pairs = ((getattr(self, k.name), getattr(other, k.name)) for k in fields(self))
        return Load(*(first + fraction * (last - first) for first, last in pairs))


class VolumeTarget(NamedTuple):
    """Volume that the cavity is to have, m^3, its derivative by the pressure of the blood, m^3/Pa, and the volume, m^3,
    to which its error is relative.

    A pressure far from that of the solution may ask for a negative volume.
    """

    volume: float
    slope: float
    scale: float


@dataclass(frozen=True)
class PreviousState:
    """The state from which the viscous strain rate is taken, and the time since, s.

    Attributes
    ----------
    state : State
    time : float, s
    prescribed_fraction : float
        Fraction of the displacement that the support prescribes, in that state.
    filled : callable, optional
        Volume target for a pressure of the blood, Pa, after that time; that of the load if not given.
    """

    state: State
    time: float
    prescribed_fraction: float = 0.0
    filled: Callable[[float], VolumeTarget] | None = None


@dataclass(frozen=True)
class Residual:
    """Residuals of the equations.

    Attributes
    ----------
    force : ndarray of shape (n_equations,), N
        r, of the nodes.
    volumetric : ndarray of shape (n_cells,)
        r_c, the mean of J - 1 - p / kappa over each cell.
    volume : float, m^3
        r_V, cavity volume less its target.
    volume_slope : float, m^3/Pa
        Derivative of the target by the pressure of the blood.
    force_error, volume_error, volumetric_error : float
        Relative norms of the three: to the forces on the nodes, to the target and to one.
    """

    force: Floats
    volumetric: Floats
    volume: float
    volume_slope: float
    force_error: float
    volume_error: float
    volumetric_error: float

    @property
    def total_error(self) -> float:
        """Sum of the relative norms."""
        return self.force_error + self.volume_error + self.volumetric_error

    @property
    def max_error(self) -> float:
        """Largest of the relative norms."""
        return max(self.force_error, self.volume_error, self.volumetric_error)


class Equilibrium:
    """The equations of one heart.

    Parameters
    ----------
    mesh : Mesh
        Unloaded.
    fibre_frames : ndarray of shape (n_cells, n_points, 3, 3)
        Rows f, s, n at the points of `quadrature.tetrahedron`.
    law : element.WallLaw
    support : Support
    stiffness_scale : ndarray of shape (n_cells,), optional
        Factor of the stiffness of each cell.
    springs : tuple of Springs, optional
        Surroundings of the heart.
    exact : bool
        Whether corrections are exact and not only good enough for Newton's method.
    taut : ndarray of shape (n_cells,), optional, Pa
        Stiffness of each cell in addition from end-diastole on.

    Attributes
    ----------
    right_pressure_ratio : float
        q, pressure in the right ventricle, if there is one, over that in the left; 0 unless it is set.
    """

    def __init__(
        self,
        mesh: Mesh,
        fibre_frames: Floats,
        law: element.WallLaw,
        support: Support,
        stiffness_scale: Floats | None = None,
        springs: tuple[Springs, ...] = (),
        exact: bool = False,
        taut: Floats | None = None,
    ):
        self.mesh, self.law, self.support, self.springs = mesh, law, support, springs
        self.right_pressure_ratio, self._right_origin = 0.0, _rim_centre(mesh)
        self.assembly = Assembly(mesh, support, tuple(surface.group for surface in springs))
        self.elements = element.build_elements(mesh, fibre_frames, support.directions)
        self.unloaded_volume = np.sum(self.elements.weight, axis=1)
        self.stiffness_scale = np.ones(len(mesh.cells)) if stiffness_scale is None else stiffness_scale
        self.taut = np.zeros(len(mesh.cells)) if taut is None else taut
        self._response = element.allocate_response(len(mesh.cells), with_tangent=True)
        self._solver = factorization(single=not exact)
        self.previous: PreviousState | None = None
        self._end_diastole: Floats | None = None
        self._previous_nodes, self._rate = mesh.nodes, 0.0
        self._previous_c = self._taut_c = np.zeros((*self.elements.weight.shape, 6))

    def changed(
        self, law: element.WallLaw, stiffness_scale: Floats, springs: tuple[Springs, ...], taut: Floats
    ) -> Equilibrium:
        """The equations with other laws, stiffness and surroundings, before end-diastole; they share what is large."""
        other = copy(self)
        other.law, other.stiffness_scale, other.springs, other.taut = law, stiffness_scale, springs, taut
        other._previous_c, other._end_diastole = np.zeros_like(self._previous_c), None
        return other

    def set_previous(self, previous: PreviousState) -> None:
        """Set the previous state; without time since, nothing depends on velocities."""
        self.previous = previous
        self._previous_nodes = self.positions(previous.state, previous.prescribed_fraction)
        self._rate = 1 / previous.time if previous.time > 0 else 0.0
        if self._rate:
            element.right_cauchy_green(self._previous_nodes, self.elements, self._previous_c)

    def rest_at(self, state: State | None) -> None:
        """Set the state of end-diastole, where the pericardium is at rest, and from which on scars are taut.

        Without one the heart fills: the pericardium does not act, and scars are slack.
        """
        self._end_diastole = None if state is None else self.positions(state)
        if self._end_diastole is not None and self.taut.any():
            self._taut_c = np.empty_like(self._previous_c)
            element.right_cauchy_green(self._end_diastole, self.elements, self._taut_c)

    def close(self) -> None:
        """Free the memory of the factors."""
        self._solver.close()

    def unloaded_state(self, stiffness: float) -> State:
        """State without displacement and stress."""
        return State(np.zeros(self.assembly.n_equations), np.zeros(len(self.mesh.cells)), stiffness)

    def positions(self, state: State, prescribed_fraction: float = 0.0) -> Floats:
        """Deformed nodes, shape (n_nodes, 3), m."""
        nodes, prescribed = self.mesh.nodes + self.assembly.displacement(state.solution), self.support.prescribed
        return nodes if prescribed is None else nodes + prescribed_fraction * prescribed

    def volume(self, state: State) -> float:
        """Volume of the cavity, m^3."""
        return cavity.cavity_volume(self.positions(state), self.mesh.endo)

    def residual(self, state: State, load: Load, unknown: Unknown) -> Residual:
        """Residuals of a state under a load."""
        return self._residual(state, load, unknown, self._response._replace(tangent=np.empty((0, element.PACKED))))

    # Far from a solution the exponential may overflow; the line search then goes back.
    @np.errstate(over="ignore", invalid="ignore")
    def _residual(self, state: State, load: Load, unknown: Unknown, response: element.Response) -> Residual:
        nodes = self.positions(state, load.prescribed_fraction)
        stiffness = state.stiffness * self.stiffness_scale
        tension = np.zeros(len(self.mesh.cells)) + state.tension * load.tension_fraction + load.tension
        velocity = self._rate, self._previous_c
        taut = np.zeros_like(self.taut) if self._end_diastole is None else self.taut
        cell_state = element.CellState(stiffness, tension, state.cell_pressure, *velocity, taut, self._taut_c)
        element.evaluate(nodes, self.elements, self.law, cell_state, response)
        gradient = cavity.volume_gradient(nodes, self.mesh.endo)
        self._volume_gradient = self.assembly.vector(self.assembly.rotate(self.mesh.endo, gradient), ENDO)
        self._unit_load = self._volume_gradient + self._right_unit_load(nodes)
        internal = self.assembly.vector(response.force[:, TOTAL])
        for surface in filter(self._acts, self.springs):
            internal += self._spring_force(surface, nodes)
        external = (state.cavity_pressure if unknown == "cavity_pressure" else load.pressure) * self._unit_load
        volumetric = response.volume / self.unloaded_volume - 1 - state.cell_pressure / self.law.bulk_modulus
        target = self._volume_target(state, load, unknown)
        # V is of third degree in the positions x: V = x . dV/dx / 3 (Euler's theorem).
        volume = float(np.sum(gradient * nodes[self.mesh.endo])) / 3 - target.volume if unknown else 0.0
        force_scale = norm(external) or norm(response.force[:, TOTAL]) or 1.0
        errors = norm(internal - external) / force_scale, abs(volume) / target.scale if unknown else 0.0
        volumetric_error = norm(volumetric) / np.sqrt(len(volumetric))
        return Residual(internal - external, volumetric, volume, target.slope, *errors, volumetric_error)

    def _right_unit_load(self, nodes: Floats) -> Floats | float:
        """q dV_right/du (n_equations,): the load on the right endocardium of a unit pressure in the left ventricle."""
        facets = self.mesh.right_endo
        if not len(facets):
            return 0.0
        gradient = self.right_pressure_ratio * cavity.volume_gradient(nodes - self._right_origin, facets)
        return self.assembly.vector(self.assembly.rotate(facets, gradient), RIGHT_ENDO)

    def _volume_target(self, state: State, load: Load, unknown: Unknown) -> VolumeTarget:
        filled = self.previous.filled if self.previous and unknown == "cavity_pressure" else None
        return filled(state.cavity_pressure) if filled else VolumeTarget(load.volume, 0.0, load.volume)

    def _spring_force(self, surface: Springs, nodes: Floats) -> Floats:
        """K_e (u - u_rest) + D_e (u - u_previous) / dt of a surface, on the free displacements."""
        rest = self._end_diastole if surface.rest_at_end_diastole else self.mesh.nodes
        assert rest is not None
        moved, since = ((nodes - at)[surface.facets].reshape(-1, 18) for at in (rest, self._previous_nodes))
        force = np.einsum("frs,fs->fr", surface.spring, moved)
        force += self._rate * np.einsum("frs,fs->fr", surface.dashpot, since)
        return self.assembly.vector(self.assembly.rotate(surface.facets, force.reshape(-1, 6, 3)), surface.group)

    def _acts(self, surface: Springs) -> bool:
        """Whether the springs of a surface act already."""
        return not surface.rest_at_end_diastole or self._end_diastole is not None

    def linearize(self, state: State, load: Load, unknown: Unknown) -> Tangent:
        """Factor the tangent at a state."""
        self._residual(state, load, unknown, self._response)
        pressure = state.cavity_pressure if unknown == "cavity_pressure" else load.pressure
        nodes, right = self.positions(state, load.prescribed_fraction), self.mesh.right_endo
        blocks = [self.assembly.pack(self.mesh.endo, -pressure * cavity.volume_hessian(nodes, self.mesh.endo))]
        hessian = self.right_pressure_ratio * cavity.volume_hessian(nodes - self._right_origin, right)
        blocks.append(self.assembly.pack(right, -pressure * hessian))
        for surface in self.springs:
            matrix = surface.spring + self._rate * surface.dashpot
            # Those that do not act yet keep their place in the pattern.
            matrix = matrix if self._acts(surface) else np.zeros_like(matrix)
            blocks.append(self.assembly.pack(surface.facets, matrix))
        self._solver.factor(self.assembly.matrix(self._response.tangent, *blocks))
        return Tangent(self, unknown, load)

    def solve(self, right: Floats) -> Floats:
        """Solution for a right-hand side (n_equations,) with the factors of the last tangent."""
        return self._solver.solve(right[:, None])[:, 0]

    def scalar_force(self, unknown: Unknown, load: Load) -> Floats:
        """-dr/ds, shape (n_equations,), at the state evaluated last."""
        if unknown == "cavity_pressure":
            return self._unit_load
        part, scale = PASSIVE, -self.stiffness_scale
        if unknown == "tension":
            part, scale = ACTIVE, -load.tension_fraction * np.ones(len(self.mesh.cells))
        return self.assembly.vector(scale[:, None] * self._response.force[:, part], CELLS)


class Tangent:
    """The factored tangent at one state, which gives corrections of this and later states."""

    def __init__(self, equations: Equilibrium, unknown: Unknown, load: Load) -> None:
        self._equations, self.unknown = equations, unknown
        self._cell_gradient = equations._response.force[:, VOLUMETRIC].copy()  # G_c
        if unknown:
            self._volume_gradient = equations._volume_gradient  # g
            self._scalar_solution = equations.solve(equations.scalar_force(unknown, load))  # du_s
            self._compliance = float(np.sum(self._volume_gradient * self._scalar_solution))  # g . du_s

    def correction(self, residual: Residual) -> Correction:
        """Newton correction of a residual."""
        equations = self._equations
        kappa = equations.law.bulk_modulus
        condensed = equations.assembly.vector(kappa * residual.volumetric[:, None] * self._cell_gradient)
        solution, scalar = equations.solve(-residual.force - condensed), 0.0
        if self.unknown:
            compliance = self._compliance - residual.volume_slope
            scalar = -(residual.volume + float(np.sum(self._volume_gradient * solution))) / compliance
            solution += scalar * self._scalar_solution
        cell_change = np.sum(self._cell_gradient * equations.assembly.of_cells(solution), axis=1)
        return Correction(solution, kappa * (residual.volumetric + cell_change / equations.unloaded_volume), scalar)


def _rim_centre(mesh: Mesh) -> Floats:
    """Mean position (3,), m, of the nodes at which a right endocardium meets the base; zero without one.

    The cavity is closed by the cone from there to its rim, which lies in z = 0 where the base is plane and stays so.
    """
    rim = np.intersect1d(mesh.right_endo, mesh.base)
    return mesh.nodes[rim].sum(axis=0) / max(len(rim), 1)


def norm(vector: Floats) -> float:
    """Euclidean norm, summed on one thread."""
    with np.errstate(over="ignore"):  # a trial step may go anywhere; an infinite norm refuses it
        return float(np.sqrt(np.sum(vector**2)))
