"""Newton's method and the walk of the heart through its cycle.

Corrections are damped until the next one, taken with the same factors, is
smaller (Deuflhard, Newton Methods for Nonlinear Problems, section 3.3: the
natural monotonicity test). Factors serve for as long as what is left to do with them
costs less than new ones, from frame to frame too. Steps of the load are halved where
that fails.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import log

import numpy as np

from echotruth.fem.sparse import SingularMatrix
from echotruth.mechanics.solver.checkpoint import Factored, Frame
from echotruth.mechanics.solver.equilibrium import (
    Correction,
    Equilibrium,
    Imbalance,
    Load,
    Past,
    State,
    Tangent,
    Unknown,
)

logger = logging.getLogger("echotruth.mechanics")

TOLERANCE = 1e-8
"""Relative imbalance of force, cavity volume and volume growth at which a state is taken as solved."""

_FAR = 0.3
"""Imbalance above which a step of the load is halved before it is tried; at rest every load is far."""

_MOST_STEPS = 25
_LEAST_SHARE = 1 / 16
_LEAST_LOAD_STEP = 1 / 128

_NEAR = 0.05
"""Imbalance of a guess at which no other is tried."""

_WORTH = 15
"""Corrections with old factors that cost as much as a tangent, its factors and one correction."""


class Diverged(ValueError):
    """A heart for which no equilibrium was found."""


class Walk:
    """A heart on its way: the last solved state, and the count of factorizations."""

    def __init__(self, heart: Equilibrium, stiffness: float) -> None:
        self.heart, self.state, self.steps = heart, heart.rest(stiffness), 0
        self.load = Load(0.0, heart.volume(self.state))
        self.residual = 0.0
        self._tangent: Tangent | None = None

    def to(self, load: Load, unknown: Unknown, guesses: tuple[State, ...] = ()) -> State:
        """Go to a load in as few steps as converge.

        Parameters
        ----------
        load : Load
        unknown : "stiffness", "tension", "cavity_pressure" or None
            What gives way so that the cavity has its volume; None leaves the volume free.
        guesses : tuple of State
            Where to start if it is nearer than the last state.

        Raises
        ------
        Diverged
            If even short steps fail.
        """
        start, done, step, path = self.load, 0.0, 1.0, [(0.0, self.state)]
        while done < 1:
            goal = start.toward(load, done + step)
            self.heart.remember(Past(self.state, step * (load.time - start.time), start.toward(load, done).moved))
            try:
                self.state = self._solve(goal, unknown, (*guesses, *_ahead(path, done + step)), step)
            except Diverged as failure:
                step, guesses = step / 2, ()
                logger.debug("step of the load halved to %g: %s", step, failure)
                if step < _LEAST_LOAD_STEP:
                    raise
                continue
            done, guesses = done + step, ()
            path.append((done, self.state))
            step = min(2 * step, 1 - done)
        self.load = replace(load, pressure=self.pressure(load, unknown), volume=self.heart.volume(self.state))
        return self.state

    def frame(self) -> Frame:
        """The last solved state, with all that the next one depends on."""
        tangent = self._tangent
        factored = Factored(tangent.state, tangent.load, tangent.unknown, tangent.past) if tangent else None
        return Frame(self.state, self.load, self.steps, self.residual, factored)

    def resume(self, frame: Frame) -> None:
        """Go on from a solved state."""
        self.state, self.load, self.steps = frame.state, frame.load, frame.steps
        if frame.factored:
            self.heart.remember(frame.factored.past)
            self._tangent = self.heart.linearize(frame.factored.state, frame.factored.load, frame.factored.unknown)

    def pressure(self, load: Load, unknown: Unknown) -> float:
        """Pressure in the cavity, given or solved, Pa."""
        return self.state.cavity_pressure if unknown == "cavity_pressure" else load.pressure

    def _solve(self, load: Load, unknown: Unknown, guesses: tuple[State, ...], step: float) -> State:
        state, imbalance = self._nearest(load, unknown, guesses)
        if imbalance.error > _FAR and self.load.pressure and step > _LEAST_LOAD_STEP:
            raise Diverged(f"too long a step {_place(load, unknown)}.")
        if self._tangent is not None and self._tangent.unknown != unknown:
            self._tangent = None
        for _ in range(_MOST_STEPS):
            if _solved(imbalance):
                self.residual = imbalance.worst
                return state
            state, imbalance = self._newton(state, imbalance, load, unknown)
        self._tangent = None
        raise Diverged(f"no equilibrium within {_MOST_STEPS} Newton steps {_place(load, unknown)}.")

    def _nearest(self, load: Load, unknown: Unknown, guesses: tuple[State, ...]) -> tuple[State, Imbalance]:
        """The first of the guesses and the last state that is near, or else the best of them."""
        best, least = self.state, None
        for state in (*guesses, self.state):
            found = self.heart.imbalance(state, load, unknown)
            if least is None or np.nan_to_num(found.error, nan=np.inf) < np.nan_to_num(least.error, nan=np.inf):
                best, least = state, found
            if least.error < _NEAR:
                break
        return best, least

    def _newton(self, state: State, imbalance: Imbalance, load: Load, unknown: Unknown) -> tuple[State, Imbalance]:
        """Corrections with one factorization, the last or a new one."""
        fresh = self._tangent is None
        tangent = self._factored(state, load, unknown) if self._tangent is None else self._tangent
        steps, share = [tangent.correction(imbalance)], 1.0
        while True:
            trial = state.moved(steps[-1], share, unknown)
            found = self.heart.imbalance(trial, load, unknown)
            if _solved(found):
                return trial, found
            following = _learned(tangent.correction(found), steps) if np.isfinite(found.error) else None
            ratio = following.size / steps[-1].size if following else np.inf
            if ratio < 1 - share / 4 and (fresh or _worth(ratio, found)):
                if share < 1 or not _worth(ratio, found):
                    self._tangent = None
                    return trial, found
                state, imbalance = trial, found
                steps.append(following.plus(following.along(steps[-1]) / (1 - following.along(steps[-1])), following))
            elif not fresh:
                self._tangent = None
                return state, imbalance
            else:
                share = self._shorter(share, load, unknown)

    def _factored(self, state: State, load: Load, unknown: Unknown) -> Tangent:
        self.steps += 1
        try:
            self._tangent = self.heart.linearize(state, load, unknown)
        except SingularMatrix as failure:
            raise Diverged(f"{failure} It happened {_place(load, unknown)}.") from None
        return self._tangent

    def _shorter(self, share: float, load: Load, unknown: Unknown) -> float:
        if share / 2 < _LEAST_SHARE:
            self._tangent = None
            raise Diverged(f"Newton's method stalls {_place(load, unknown)}.")
        return share / 2


def _ahead(path: list[tuple[float, State]], share: float) -> tuple[State, ...]:
    """The state on from the last two of a path, each at a share of it."""
    if len(path) < 2:
        return ()
    (before, first), (now, last) = path[-2:]
    ratio = (share - now) / (now - before)
    return (combined((first, last), (-ratio, 1 + ratio)),)


def combined(states: Sequence[State], weights: Sequence[float]) -> State:
    """Weighted sum of states."""
    names = ("solution", "pressure", "stiffness", "tension", "cavity_pressure")
    pairs = list(zip(weights, states, strict=True))
    return State(*(sum(weight * getattr(state, name) for weight, state in pairs) for name in names))


def _solved(imbalance: Imbalance) -> bool:
    return imbalance.worst < TOLERANCE


def _learned(correction: Correction, steps: list[Correction]) -> Correction:
    """A correction with what the steps since the factorization have shown (Broyden's first method).

    Deuflhard, section 3.4, algorithm QNERR: no matrix is kept, only the steps.
    """
    for before, after in pairwise(steps):
        correction = correction.plus(correction.along(before), after)
    return correction


def _worth(ratio: float, imbalance: Imbalance) -> bool:
    """Whether corrections that shrink by a ratio reach the tolerance sooner than new factors would."""
    return ratio < 1 and log(TOLERANCE / imbalance.error) > _WORTH * log(max(ratio, 1e-12))


def _place(load: Load, unknown: Unknown) -> str:
    pressure, volume = f"a pressure of {load.pressure / 1e3:.3g} kPa", f"a volume of {load.volume * 1e9:.4g} uL"
    return "at " + {None: pressure, "cavity_pressure": volume}.get(unknown, f"{pressure} and {volume}")
