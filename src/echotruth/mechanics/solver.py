"""Newton's method and the walk of the heart through its loop.

Corrections are damped until the next one, taken with the same factors, is
smaller (Deuflhard, Newton Methods for Nonlinear Problems, section 3.3: the
natural monotonicity test); while it is much smaller it is added at once, which
saves a factorization. Steps of the load are halved where that fails.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.mechanics.equilibrium import Correction, Equilibrium, Imbalance, Load, State, Unknown
from echotruth.mechanics.loop import PressureVolume
from echotruth.mechanics.sparse import SingularMatrix

Floats = NDArray[np.float64]
logger = logging.getLogger("echotruth.mechanics")

TOLERANCE = 1e-8
"""Relative imbalance of force, cavity volume and volume growth at which a state is taken as solved."""

_MOST_STEPS = 25
_LEAST_SHARE = 1 / 16
_LEAST_LOAD_STEP = 1 / 128
_REUSE = 0.3
"""Factors serve again while a correction is smaller than this part of the one before."""

FIRST_STIFFNESS = 1100.0
"""Start (Pa) of the search for the stiffness."""


class Diverged(ValueError):
    """A heart for which no equilibrium was found."""


@dataclass(frozen=True)
class Beat:
    """A solved cycle.

    Attributes
    ----------
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
        From the unloaded state.
    pressure, volume : ndarray of shape (n_frames,), Pa and m^3
        Applied pressure, and volume of the solved cavity.
    volume_asked : ndarray of shape (n_frames,), m^3
    tension : ndarray of shape (n_frames,), Pa
    newton_steps : ndarray of shape (n_frames,)
        Factorizations.
    stiffness : float, Pa
    """

    displacement: Floats
    pressure: Floats
    volume: Floats
    volume_asked: Floats
    tension: Floats
    newton_steps: NDArray[np.int64]
    stiffness: float


class Walk:
    """A heart on its way: the last solved state, and the count of factorizations."""

    def __init__(self, heart: Equilibrium, stiffness: float) -> None:
        self.heart, self.state, self.steps = heart, heart.rest(stiffness), 0
        self._load = Load(0.0, heart.volume(self.state))

    def to(self, load: Load, unknown: Unknown, guess: State | None = None) -> State:
        """Go to a load in as few steps as converge.

        Parameters
        ----------
        load : Load
        unknown : "stiffness", "tension" or None
            What gives way so that the cavity has its volume; None leaves the volume free.
        guess : State, optional
            Where to start if it is nearer than the last state.

        Raises
        ------
        Diverged
            If even short steps fail.
        """
        start, done, step = self._load, 0.0, 1.0
        while done < 1:
            try:
                self.state = self._solve(start.toward(load, done + step), unknown, guess if step == 1 else None)
            except Diverged as failure:
                step /= 2
                logger.info("step of the load halved to %g: %s", step, failure)
                if step < _LEAST_LOAD_STEP:
                    raise
                continue
            done += step
            step = min(2 * step, 1 - done)
        self._load = Load(load.pressure, self.heart.volume(self.state))
        return self.state

    def _solve(self, load: Load, unknown: Unknown, guess: State | None) -> State:
        state, imbalance = self._nearer(load, unknown, guess)
        for _ in range(_MOST_STEPS):
            if _solved(imbalance):
                return state
            self.steps += 1
            state, imbalance = self._newton(state, imbalance, load, unknown)
        raise Diverged(f"no equilibrium within {_MOST_STEPS} Newton steps {_place(load)}.")

    def _nearer(self, load: Load, unknown: Unknown, guess: State | None) -> tuple[State, Imbalance]:
        """The better of the last state and the guess."""
        starts = [(state, self.heart.imbalance(state, load, unknown)) for state in (self.state, guess) if state]
        return min(starts, key=lambda start: np.nan_to_num(start[1].error, nan=np.inf))

    def _newton(self, state: State, imbalance: Imbalance, load: Load, unknown: Unknown) -> tuple[State, Imbalance]:
        """Corrections with one factorization."""
        try:
            tangent = self.heart.linearize(state, load, unknown)
        except SingularMatrix as failure:
            raise Diverged(f"{failure} It happened {_place(load)}.") from None
        step, share = tangent.correction(imbalance), 1.0
        while True:
            trial = state.moved(step, share, unknown)
            found = self.heart.imbalance(trial, load, unknown)
            following = tangent.correction(found) if np.isfinite(found.error) else None
            ratio = _ratio(following, step)
            if not ratio < 1 - share / 4 and not _solved(found):
                share /= 2
                if share < _LEAST_SHARE:
                    raise Diverged(f"Newton's method stalls {_place(load)}.")
                continue
            if _solved(found) or share < 1 or ratio > _REUSE:
                return trial, found
            state, step = trial, following


def _solved(imbalance: Imbalance) -> bool:
    return max(imbalance.force_error, imbalance.volume_error, imbalance.growth_error) < TOLERANCE


def _ratio(following: Correction | None, step: Correction) -> float:
    return following.size / step.size if following else np.inf


def _place(load: Load) -> str:
    return f"at a pressure of {load.pressure / 1e3:.3g} kPa and a volume of {load.volume * 1e9:.3g} uL"


def end_diastole(walk: Walk, loop: PressureVolume, stiffness: float | None) -> float:
    """Fill the passive heart to end-diastole.

    Parameters
    ----------
    walk : Walk
        At rest.
    loop : PressureVolume
    stiffness : float, optional, Pa
        C. If not given, it is solved from the end-diastolic pressure and volume.

    Returns
    -------
    float
        Factor of the loop's volumes, with which the heart has its end-diastolic volume.
    """
    pressure, volume = float(loop.pressure[0]), float(loop.volume[0])
    empty = walk.heart.volume(walk.state)
    if stiffness is None and volume <= empty:
        volumes = f"{volume * 1e9:.3g} uL at end-diastole, and the unloaded cavity {empty * 1e9:.3g} uL"
        raise Diverged(f"the loop has {volumes}: raise edv_uL, or make the heart smaller (scale).")
    walk.to(Load(pressure, volume), None)
    reached = walk.heart.volume(walk.state)
    logger.info("filled to %.4g uL with a stiffness of %.4g kPa", reached * 1e9, walk.state.stiffness / 1e3)
    if stiffness is not None:
        return reached / volume
    state = walk.to(Load(pressure, volume), "stiffness")
    logger.info("stiffness %.4g kPa for an end-diastolic volume of %.4g uL", state.stiffness / 1e3, volume * 1e9)
    return 1.0


def solve(heart: Equilibrium, loop: PressureVolume, stiffness: float | None) -> Beat:
    """Drive a heart through a pressure-volume loop; the active tension is what is solved for.

    Parameters
    ----------
    heart : Equilibrium
    loop : PressureVolume
    stiffness : float, optional, Pa
        C of the passive law. If not given, it is solved from end-diastole; if given, the
        volumes of the loop are scaled to what the heart then holds at end-diastole.

    Returns
    -------
    Beat

    Raises
    ------
    Diverged
        If a frame cannot be solved.
    """
    walk = Walk(heart, FIRST_STIFFNESS if stiffness is None else stiffness)
    asked = loop.volume * end_diastole(walk, loop, stiffness)
    states, steps = [walk.state], [walk.steps]
    for frame in range(1, len(asked)):
        before = walk.steps
        load = Load(float(loop.pressure[frame]), float(asked[frame]))
        states.append(walk.to(load, "tension", _extrapolated(states)))
        steps.append(walk.steps - before)
        row = (frame, loop.time[frame] * 1e3, load.pressure / 1e3, load.volume * 1e9, states[-1].tension / 1e3)
        logger.info("frame %d, %.1f ms: %.2f kPa, %.2f uL, T_Ca %.2f kPa, %d steps", *row, steps[-1])
    displacement = np.array([heart.assembly.spread(state.solution) for state in states])
    volume = np.array([heart.volume(state) for state in states])
    tension = np.array([state.tension for state in states])
    return Beat(displacement, loop.pressure, volume, asked, tension, np.array(steps), states[0].stiffness)


def _extrapolated(states: list[State]) -> State | None:
    """Straight on from the last two states."""
    if len(states) < 2:
        return None
    first, last = states[-2:]
    values = (2 * getattr(last, name) - getattr(first, name) for name in ("solution", "pressure"))
    return State(*values, last.stiffness, 2 * last.tension - first.tension)
