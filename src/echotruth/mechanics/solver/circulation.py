"""The heart in a circulation: its tension is given; pressure and volume are solved, beat after beat until steady."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from math import exp

import numpy as np

from echotruth.loop.circulation import Circulation
from echotruth.mechanics.solver.activation import Activation
from echotruth.mechanics.solver.cycle import SolvedFrame, extrapolated
from echotruth.mechanics.solver.element import fibre_stretch
from echotruth.mechanics.solver.equilibrium import Load, State
from echotruth.mechanics.solver.newton import Diverged, LoadStepper

logger = logging.getLogger("echotruth.mechanics")

STEADY = 0.005
"""Change from end-diastole to end-diastole at which a heart counts as steady: of the volume over the stroke volume, and
of the arterial pressure over itself."""

SENSITIVITY = 0.45
"""Relative fall of the stroke volume with the arterial pressure: the default mouse ejects 12 % less with a peripheral
resistance half as large again. It changes the number of beats until the heart is steady, not what it comes to."""


def steady_beat(
    stepper: LoadStepper, circulation: Circulation, activation: Activation, beats_max: int
) -> list[SolvedFrame]:
    """The frames of the first beat that ends as it began.

    Parameters
    ----------
    stepper : LoadStepper
        At end-diastole (:func:`.cycle.filled_to_end_diastole`).
    circulation : Circulation
    activation : Activation
    beats_max : int

    Returns
    -------
    list of SolvedFrame
        The first of them is end-diastole.

    Raises
    ------
    Diverged
        If a frame cannot be solved, or the heart is not steady after so many beats.
    """
    stepper.couple(circulation)
    frames = _frames(stepper, circulation, activation)
    first = next(frames)
    for number in range(1, beats_max + 1):
        beat = [first, *(next(frames) for _ in range(len(activation.twitch) - 1))]
        first = next(frames)
        volumes = [frame.load.volume * 1e9 for frame in beat]
        change = _change(beat, first)
        text = "beat %d: end-diastole %.4g uL, ejected %.4g uL, highest pressure %.4g kPa, %.2g %% from steady"
        highest = max(frame.load.pressure for frame in beat) / 1e3
        logger.info(text, number, volumes[0], volumes[0] - min(volumes), highest, 100 * change)
        if change < STEADY:
            return beat
        stepper.arterial_pressure = _hastened(circulation, beat[0].arterial_pressure, first.arterial_pressure)
        first = first._replace(arterial_pressure=stepper.arterial_pressure)
    remedy = "raise loop.circulation.beats_max, or change the heart less"
    raise Diverged(f"The heart is not steady after {beats_max} beats ({100 * change:.2g} % from it): {remedy}.")


def _frames(stepper: LoadStepper, circulation: Circulation, activation: Activation) -> Iterator[SolvedFrame]:
    """The frames of all beats from end-diastole on."""
    states: list[State] = [stepper.state]
    equations, twitch, frame = stepper.equations, activation.twitch, 0
    while True:
        yield SolvedFrame(
            stepper.state, stepper.load, stepper.factorizations, stepper.max_error, stepper.arterial_pressure
        )
        tension = activation.advance(frame, fibre_stretch(equations.positions(stepper.state), equations.elements))
        frame += 1
        load = Load(0.0, 1.0, 0.0, tension, time=frame * circulation.period / len(twitch))
        state = stepper.advance(load, "cavity_pressure", extrapolated(states))
        stepper.state = replace(state, tension=float(twitch[frame % len(twitch)]))
        states = [*states, stepper.state][-4:]


def _hastened(circulation: Circulation, first: float, last: float) -> float:
    """Arterial pressure, Pa, of the next beat, from those with which a beat began and ended.

    With the flow of that beat the arteries would end at first + (last - first) / (1 - exp(-T / R C)). A heart ejects
    about .45 % less for each per cent of arterial pressure, so that flow and pressure meet at 1 / 1.45 of the way.
    """
    decay_time = circulation.peripheral_resistance * circulation.compliance
    return first + (last - first) / (1 - exp(-circulation.period / decay_time)) / (1 + SENSITIVITY)


def _change(beat: list[SolvedFrame], following: SolvedFrame) -> float:
    """Largest relative change from the first frame of a beat to that of the next."""
    first, volumes = beat[0], np.array([frame.load.volume for frame in beat])
    filled = abs(following.load.volume - volumes[0]) / np.ptp(volumes)
    return max(filled, abs(following.arterial_pressure / first.arterial_pressure - 1))
