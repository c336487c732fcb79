"""Newton's method with quasi-Newton corrections, and the stepping of the load through the cycle.

With F the residual of a state x and J the factored tangent, a correction solves J dx = -F(x). The step x + d dx, with
damping d, is taken if the correction after it, J dx' = -F(x + d dx), has |dx'| < (1 - d / 4) |dx| (natural monotonicity
test; Deuflhard, Newton Methods for Nonlinear Problems, section 3.3); if not, d is halved. At rest it is also taken if
the relative residual falls by that factor: as the wall fills and stiffens, the first test alone refuses steps that lead
to the solution. With velocities it stands alone, because the result depends on which steps are halved. Factors are
reused, also from frame to frame, with Broyden's updates, as long as the remaining corrections cost less than new
factors. Load steps are halved where Newton's method fails.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from itertools import pairwise
from math import log
from typing import NamedTuple

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.sparse import SingularMatrix
from echotruth.loop.circulation import ARTERIES, LEFT_VENTRICLE, Circulation
from echotruth.mechanics.solver.equilibrium import (
    Correction,
    Equilibrium,
    Load,
    PreviousState,
    Residual,
    State,
    Tangent,
    Unknown,
    VolumeTarget,
)

logger = logging.getLogger("echotruth.mechanics")

TOLERANCE = 1e-8
"""Relative residual of force, cavity volume and cell volumes at which a state counts as solved."""

MAX_PREDICTOR_RESIDUAL = 0.3
"""Residual of a predictor above which the load step is halved without an attempt, except from the unloaded state and
where the tension follows the velocity."""

GOOD_PREDICTOR_RESIDUAL = 0.05
"""Residual of a predictor below which it is used without trying the others."""

REFACTOR_COST = 15
"""Number of corrections with old factors that cost as much as a new tangent, its factors and one correction."""

_MAX_NEWTON_STEPS = 25
_MIN_DAMPING = 1 / 16
_MIN_LOAD_STEP = 1 / 1024
_REMEDY = "use a finer mesh or more frames"


class Diverged(ValueError):
    """Raised if no equilibrium of the heart is found."""


class Step(NamedTuple):
    """A solved step of the load.

    Attributes
    ----------
    start, end : Load
        Loads between which the heart is stepped.
    begun, ended : float
        Fractions of the way from one to the other at which the step begins and ends.
    unknown : Unknown
    before, after : State
    """

    start: Load
    end: Load
    begun: float
    ended: float
    unknown: Unknown
    before: State
    after: State


class LoadStepper:
    """Steps a heart from load to load.

    Attributes
    ----------
    state, load
        Last solved state, and the load that it balances.
    volumes, pressures : ndarray of shape (8,), m^3 and Pa
        Of the compartments of the circulation, at the last solved state; not numbers without one.
    arterial_pressure : float, Pa
        In the root of the aorta, likewise.
    tolerance : float
        Relative residual at which a state counts as solved.
    max_error : float
        Largest relative residual of the state.
    factorizations : int
        Number of factorizations so far.
    on_step : callable, optional
        Called with every :class:`Step` that is solved.
    """

    def __init__(self, equations: Equilibrium, stiffness: float) -> None:
        self.equations, self.state, self.factorizations = equations, equations.unloaded_state(stiffness), 0
        self.load = Load(0.0, equations.volume(self.state))
        self.circulation: Circulation | None = None
        self.volumes, self.pressures = np.full(8, np.nan), np.full(8, np.nan)
        self.arterial_pressure = np.nan
        self.tolerance = TOLERANCE
        self.max_error = 0.0
        self.on_step: Callable[[Step], None] | None = None
        self._tangent: Tangent | None = None

    def advance(self, load: Load, unknown: Unknown, predictors: tuple[State, ...] = ()) -> State:
        """Go to a load in as few steps as converge.

        Parameters
        ----------
        load : Load
        unknown : "stiffness", "tension", "cavity_pressure" or None
            Solved so that the cavity has its volume; None leaves the volume free.
        predictors : tuple of State
            Where to start if the residual is smaller there than at the last state.

        Raises
        ------
        Diverged
            If even short steps fail.
        """
        start, fraction, step, path = self.load, 0.0, 1.0, [(0.0, self.state)]
        while fraction < 1:
            target = start.toward(load, fraction + step)
            prescribed = start.toward(load, fraction).prescribed_fraction
            duration = step * (load.time - start.time)
            filled, before = self._filled(target.time, duration), self.state
            self.equations.set_previous(PreviousState(self.state, duration, prescribed, filled))
            try:
                self.state = self._solve(target, unknown, (*predictors, *_extrapolated(path, fraction + step)), step)
            except Diverged as failure:
                step, predictors = step / 2, ()
                logger.debug("load step halved to %g: %s", step, failure)
                if step < _MIN_LOAD_STEP:
                    raise
                continue
            if self.circulation:
                passed = self.circulation.exchange(self.volumes, target.time, duration, self.state.cavity_pressure)
                self.volumes, self.pressures = passed.volumes, passed.pressures
                self.arterial_pressure = passed.arterial_pressure
            if self.on_step:
                self.on_step(Step(start, load, fraction, fraction + step, unknown, before, self.state))
            fraction, predictors = fraction + step, ()
            path.append((fraction, self.state))
            step = min(2 * step, 1 - fraction)
        pressure = self.state.cavity_pressure if unknown == "cavity_pressure" else load.pressure
        self.load = replace(load, pressure=pressure, volume=self.equations.volume(self.state))
        return self.state

    def rest(self) -> None:
        """Let the pericardium and taut scars act from the last solved state on, at which they are at rest."""
        self.equations.rest_at(self.state)
        self._tangent = None

    def release(self) -> None:
        """Let the pericardium and taut scars not act, as while the heart fills."""
        self.equations.rest_at(None)
        self._tangent = None

    def couple(self, circulation: Circulation, volumes: Floats) -> None:
        """Let the last solved state be that of end-diastole of a heart in a circulation, from which it goes on.

        Parameters
        ----------
        circulation : Circulation
        volumes : ndarray of shape (8,), m^3
            Of its compartments.
        """
        self.circulation, self.volumes = circulation, volumes
        self.pressures = circulation.pressures(volumes, self.load.time, self.load.pressure)
        self.arterial_pressure = float(self.pressures[ARTERIES])  # behind a shut valve

    def _filled(self, time: float, duration: float) -> Callable[[float], VolumeTarget] | None:
        """Volume after a step that ends at a time, by the pressure, if there is a circulation."""
        if self.circulation is None:
            return None
        circulation, volumes = self.circulation, self.volumes

        def filled(pressure: float) -> VolumeTarget:
            passed = circulation.exchange(volumes, time, duration, pressure)
            return VolumeTarget(float(passed.volumes[LEFT_VENTRICLE]), passed.slope, float(volumes[LEFT_VENTRICLE]))

        return filled

    def _solve(self, load: Load, unknown: Unknown, predictors: tuple[State, ...], step: float) -> State:
        state, residual = self._best_predictor(load, unknown, predictors)
        far = residual.total_error > MAX_PREDICTOR_RESIDUAL and not self._follows_velocity(load)
        if far and self.load.pressure and step > _MIN_LOAD_STEP:
            raise Diverged(f"The load step is too large {_at(load, unknown)}.")
        if self._tangent is not None and self._tangent.unknown != unknown:
            self._tangent = None
        for _ in range(_MAX_NEWTON_STEPS):
            if residual.max_error < self.tolerance:
                self.max_error = residual.max_error
                return state
            state, residual = self._newton(state, residual, load, unknown)
        self._tangent = None
        raise Diverged(f"No equilibrium within {_MAX_NEWTON_STEPS} Newton steps {_at(load, unknown)}: {_REMEDY}.")

    def _follows_velocity(self, load: Load) -> bool:
        """Whether the tension follows the velocity, so that a shorter step brings no state nearer."""
        return load.time > self.load.time and bool(np.isfinite(self.equations.law.active.max_velocity))

    def _best_predictor(self, load: Load, unknown: Unknown, predictors: tuple[State, ...]) -> tuple[State, Residual]:
        """The first predictor (or the last state) with a small residual, or the one with the smallest."""
        best, least = self.state, None
        for state in (*predictors, self.state):
            residual = self.equations.residual(state, load, unknown)
            error = np.nan_to_num(residual.total_error, nan=np.inf)
            if least is None or error < np.nan_to_num(least.total_error, nan=np.inf):
                best, least = state, residual
            if least.total_error < GOOD_PREDICTOR_RESIDUAL:
                break
        assert least is not None
        return best, least

    def _newton(self, state: State, residual: Residual, load: Load, unknown: Unknown) -> tuple[State, Residual]:
        """Corrections with one factorization, the last or a new one."""
        fresh = self._tangent is None
        tangent = self._tangent or self._factor(state, load, unknown)
        corrections, damping, rests = [tangent.correction(residual)], 1.0, load.time == self.load.time
        while True:
            last = corrections[-1]
            trial = state.corrected(last, damping, unknown)
            after = self.equations.residual(trial, load, unknown)
            if after.max_error < self.tolerance:
                return trial, after
            finite = np.isfinite(after.total_error)
            simplified = _broyden_update(tangent.correction(after), corrections) if finite else None
            ratio = simplified.norm / last.norm if simplified else np.inf
            keep_factors = self._keeps_factors(ratio, after)
            least = 1 - damping / 4
            nearer = ratio < least or (rests and after.total_error < least * residual.total_error)
            if simplified and nearer and (fresh or keep_factors):
                if damping < 1 or not keep_factors:
                    self._tangent = None
                    return trial, after
                state, residual = trial, after
                alpha = simplified.projection(last)
                corrections.append(simplified.plus(alpha / (1 - alpha), simplified))
            elif not fresh:
                self._tangent = None
                return state, residual
            else:
                damping /= 2
                if damping < _MIN_DAMPING:
                    self._tangent = None
                    raise Diverged(f"The load step did not converge {_at(load, unknown)}: {_REMEDY}.")

    def _keeps_factors(self, ratio: float, residual: Residual) -> bool:
        """Whether corrections that shrink by a ratio reach the tolerance sooner than new factors would."""
        return ratio < 1 and log(self.tolerance / residual.total_error) > REFACTOR_COST * log(max(ratio, 1e-12))

    def _factor(self, state: State, load: Load, unknown: Unknown) -> Tangent:
        self.factorizations += 1
        try:
            self._tangent = self.equations.linearize(state, load, unknown)
        except SingularMatrix as failure:
            raise Diverged(f"{failure} It happened {_at(load, unknown)}.") from None
        return self._tangent


def _extrapolated(path: list[tuple[float, State]], fraction: float) -> tuple[State, ...]:
    """The state at a fraction of the load, extrapolated linearly from the last two (fraction, state) of a path."""
    if len(path) < 2:
        return ()
    (before, first), (now, last) = path[-2:]
    ratio = (fraction - now) / (now - before)
    return (linear_combination((first, last), (-ratio, 1 + ratio)),)


def linear_combination(states: Sequence[State], weights: Sequence[float]) -> State:
    """Weighted sum of states."""
    pairs = list(zip(weights, states, strict=True))
    return State(*(sum(weight * getattr(state, field.name) for weight, state in pairs) for field in fields(State)))


def _broyden_update(correction: Correction, corrections: list[Correction]) -> Correction:
    """A correction by the factored tangent, updated with the corrections dx_0, ... taken since it was factored.

    Broyden's first method (Deuflhard, section 3.4, algorithm QNERR), without a matrix: for each k in turn
    v <- v + <v, dx_k> / <dx_k, dx_k> dx_(k+1). With alpha = <v, dx_n> / <dx_n, dx_n> of the last of them, the next
    correction is v / (1 - alpha).
    """
    for earlier, later in pairwise(corrections):
        correction = correction.plus(correction.projection(earlier), later)
    return correction


def _at(load: Load, unknown: Unknown) -> str:
    pressure, volume = f"a pressure of {load.pressure / 1e3:.3g} kPa", f"a volume of {load.volume * 1e9:.4g} uL"
    if unknown == "cavity_pressure" and load.time:  # in a circulation the volume is not known
        return f"{1e3 * load.time:.4g} ms after end-diastole"
    return "at " + {None: pressure, "cavity_pressure": volume}.get(unknown, f"{pressure} and {volume}")
