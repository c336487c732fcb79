"""The heart in a circulation: its tension is given; pressure and volume are solved, beat after beat until steady.

The veins alone would take tens of beats to come to rest. So each beat of the finite elements makes an elastance of the
left ventricle (:func:`elastance`), with which the beat that ends as it began is found among the compartments, in
milliseconds; the next beat of the finite elements begins there. The elastance goes through the pressures and volumes of
the beat that it is made from: a beat of the finite elements that ends as it began does so with its elastance too. So a
poor elastance costs more beats, and changes no result.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echotruth.arrays import Floats
from echotruth.loop.circulation import (
    ARTERIES,
    LEFT_ATRIUM,
    LEFT_VENTRICLE,
    PULMONARY_ARTERIES,
    RIGHT_ATRIUM,
    Cavity,
    Circulation,
)
from echotruth.mechanics.solver.activation import Activation
from echotruth.mechanics.solver.cycle import SolvedCycle, SolvedFrame, extrapolated, solved_frame
from echotruth.mechanics.solver.element import fibre_stretch
from echotruth.mechanics.solver.equilibrium import Load, State
from echotruth.mechanics.solver.newton import TOLERANCE, Diverged, LoadStepper, linear_combination

logger = logging.getLogger("echotruth.mechanics")

STEADY = 0.005
"""Distance from the steady beat at which a heart counts as steady: of the volume of a chamber or of the arteries at
end-diastole, over the stroke volume."""

ROUGH_TOLERANCE, NEAR = 1e-3, 0.1
"""Tolerance of the states of a beat that is not to be the last, and distance from the steady beat below which the next
one may be."""

LEAST_CHANGE = 0.01
"""Difference of volume between two beats, over the stroke volume, from which an elastance follows."""

DIASTOLIC_EXPONENT = 2.76
"""P ~ (V - V0)^2.76 of the filling heart in several species (Klotz et al., Am J Physiol 291 (2006) H403)."""


def steady_beat(
    stepper: LoadStepper,
    circulation: Circulation,
    guess: Cavity,
    activation: Activation,
    beats_max: int,
    like: Sequence[State] = (),
) -> list[SolvedFrame]:
    """The frames of the first beat that ends as it began: with the same volumes and tension.

    End-diastole is solved at rest, where the last frame has viscous stress as well, so that points differ by up to 20
    um in a mouse whose wall is activated out of turn.

    Parameters
    ----------
    stepper : LoadStepper
        At end-diastole (:func:`.cycle.filled_to_end_diastole`).
    circulation : Circulation
    guess : Cavity
        A left ventricle like this one.
    activation : Activation
    beats_max : int
    like : sequence of State
        The frames of the beat of a like heart, from which the first beat is predicted; empty if there is none.

    Returns
    -------
    list of SolvedFrame
        The first of them is end-diastole.

    Raises
    ------
    Diverged
        If a frame cannot be solved, or the heart is not steady after so many beats.
    """
    unloaded = stepper.equations.volume(stepper.equations.unloaded_state(0.0))
    answered, steady = circulation.steady(guess, circulation.volumes)
    begun = steady.volumes
    moved = _distance(circulation, begun, circulation.volumes)
    stepper.tolerance = TOLERANCE if moved < STEADY else ROUGH_TOLERANCE
    frames: list[SolvedFrame] = []
    states = [*like, *like[:1]]
    cavity: Cavity | None = None
    last = np.inf
    for number in range(1, beats_max + 1):
        _fill(stepper, begun, activation.tension(0), frames[0] if frames else None)
        stepper.state = replace(stepper.state, tension=float(activation.twitch[0]))
        stepper.couple(answered, begun)
        frames = _beat(stepper, answered, activation, states)
        states = [frame.state for frame in frames]
        pressure, volume = np.array([(frame.load.pressure, frame.load.volume) for frame in frames[1:]]).T
        cavity = elastance(pressure, volume, unloaded, cavity)
        answered, steady = circulation.steady(cavity, stepper.volumes)
        change = _distance(circulation, steady.volumes, begun)
        _log(number, cavity, change)
        # Where beats alternate about the steady one, half of the way leads to it.
        begun = steady.volumes if change < last / 2 else (begun + steady.volumes) / 2
        last = change
        if change < STEADY and stepper.tolerance == TOLERANCE:
            means = steady.mean_pressures[[RIGHT_ATRIUM, PULMONARY_ARTERIES, LEFT_ATRIUM]] / 1e3
            text = "mean pressures: arteries %.4g, right atrium %.3g, pulmonary arteries %.3g, left atrium %.3g kPa"
            logger.info(text, steady.mean_arterial_pressure / 1e3, *means)
            return frames[:-1]
        stepper.tolerance = TOLERANCE if change < NEAR else ROUGH_TOLERANCE
    remedy = "raise loop.circulation.beats_max, or change the heart less"
    raise Diverged(f"The heart is not steady after {beats_max} beats ({100 * change:.2g} % from it): {remedy}.")


def _distance(circulation: Circulation, volumes: Floats, others: Floats) -> float:
    """Largest difference of the volumes of left ventricle, arteries and left atrium, over the stroke volume."""
    judged = [LEFT_VENTRICLE, ARTERIES, LEFT_ATRIUM]
    return float(np.abs(volumes - others)[judged].max() / circulation.stroke_volume)


def _log(number: int, cavity: Cavity, change: float) -> None:
    volumes, highest = cavity.volume * 1e9, cavity.pressure.max() / 1e3
    text = "beat %d: end-diastole %.4g uL, ejected %.4g uL, highest pressure %.4g kPa, %.2g %% from steady"
    logger.info(text, number, volumes[-1], volumes[-1] - volumes.min(), highest, 100 * change)


def _fill(stepper: LoadStepper, volumes: Floats, tension: Floats, rested: SolvedFrame | None) -> None:
    """Fill the heart at rest from end-diastole to the volume of another, from which a beat begins.

    Meanwhile neither pericardium nor taut scars act; they are at rest where the beat begins. The last frame of a beat
    is not at rest. Where no way leads on from there, the heart is filled from the end-diastole with which that beat
    began.
    """
    stepper.circulation = None
    stepper.release()
    stepper.state = replace(stepper.state, cavity_pressure=stepper.load.pressure)
    load = Load(0.0, float(volumes[LEFT_VENTRICLE]), 0.0, tension, time=stepper.load.time)
    try:
        stepper.advance(load, "cavity_pressure")
    except Diverged:
        if rested is None:
            raise
        stepper.state, stepper.load = rested.state, replace(rested.load, time=load.time)
        stepper.advance(load, "cavity_pressure")
    stepper.rest()
    stepper.load = replace(stepper.load, time=0.0)


def _beat(
    stepper: LoadStepper, circulation: Circulation, activation: Activation, before: Sequence[State]
) -> list[SolvedFrame]:
    """The frames of a beat from end-diastole to end-diastole; `before` are the states of the beat before, if any."""
    states, frames = [stepper.state], [solved_frame(stepper)]
    equations, twitch = stepper.equations, activation.twitch
    for frame in range(1, len(twitch) + 1):
        stretch = fibre_stretch(equations.positions(stepper.state), equations.elements)
        time = frame * circulation.period / len(twitch)
        load = Load(0.0, 1.0, 0.0, activation.advance(frame - 1, stretch), time=time)
        state = stepper.advance(load, "cavity_pressure", _predicted(states, before))
        stepper.state = replace(state, tension=float(twitch[frame % len(twitch)]))
        states.append(stepper.state)
        frames.append(solved_frame(stepper))
    return frames


def _predicted(states: Sequence[State], before: Sequence[State]) -> tuple[State, ...]:
    """The next state: that of the beat before with the difference between the beats; by extrapolation without one."""
    number = len(states)
    if not before:
        return extrapolated(list(states[-4:]))
    if number == 1:
        return (linear_combination((before[1], before[0], states[0]), (1, -1, 1)),)
    earlier = before[number], before[number - 1], before[number - 2], states[-1], states[-2]
    return (linear_combination(earlier, (1, -2, 1, 2, -1)),)


def guessed(measured: SolvedCycle, edv: float, unloaded: float, strength: Floats) -> Cavity:
    """A left ventricle like the healthy one in its measured loop.

    Parameters
    ----------
    measured : SolvedCycle
    edv, unloaded : float, m^3
        Volumes of this heart at the end-diastolic pressure of the healthy one, and without pressure.
    strength : ndarray of shape (n_frames,)
        Its pressure over that of the healthy one, by the tension of their muscle.
    """
    active = np.clip(4 * measured.active_tension / measured.active_tension.max(), 0, 1)
    pressure = measured.pressure * (1 + (strength - 1) * active)
    volume = edv / measured.volume[0] * measured.volume
    passive = np.full(len(volume), _passive_elastance(pressure[0], edv, unloaded))
    return Cavity(*(np.roll(curve, -1) for curve in (pressure, volume, np.maximum(passive, pressure / volume / 2))))


def elastance(pressure: Floats, volume: Floats, unloaded: float, before: Cavity | None = None) -> Cavity:
    """A left ventricle that goes through a beat.

    Its elastance is that between this beat and the one before; where their volumes are alike, and in the first beat,
    half of the passive one at end-diastole: with a given T_Ca the heart is hardly stiffer in systole.

    Parameters
    ----------
    pressure, volume : ndarray of shape (n_frames,), Pa and m^3
        At the end of each step of the beat; the last is end-diastole.
    unloaded : float, m^3
        Volume without pressure.
    before : Cavity, optional
        Of the beat before.
    """
    found = np.full(len(volume), _passive_elastance(pressure[-1], volume[-1], unloaded))
    if before is not None:
        change, differs = volume - before.volume, np.abs(volume - before.volume) > LEAST_CHANGE * np.ptp(volume)
        secant = np.divide(pressure - before.pressure, change, out=found.copy(), where=differs)
        found = np.clip(secant, found / 10, 10 * found)
    return Cavity(pressure, volume, found)


def _passive_elastance(pressure: float, volume: float, unloaded: float) -> float:
    """Half of dP/dV at end-diastole, Pa/m^3, as more than the volume of that moment changes from beat to beat."""
    return 0.5 * DIASTOLIC_EXPONENT * abs(float(pressure)) / max(float(volume) - unloaded, 0.1 * unloaded)
