"""The heart driven through a cycle, frame by frame.

Two of pressure, volume and tension are prescribed and the third is solved: the tension from a
pressure-volume loop, the volume from pressure and tension, the pressure from volume and tension.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.loop.cycle import Cycle
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, State, Unknown
from echotruth.mechanics.solver.newton import Diverged, LoadStepper, linear_combination
from echotruth.mechanics.solver.stress import relative_stiffness

logger = logging.getLogger("echotruth.mechanics")

INITIAL_STIFFNESS = 1100.0
"""Stiffness (Pa) from which the search for it starts, of the default law."""

LEAST_FILLING = 1.1
"""Smallest end-diastolic volume over that of the unloaded cavity with which the hearts of all three species beat."""

MOST_NORMAL_SHARE = 0.8
"""Share of the tension along the sheet normal, over that along the sheet, above which muscle works against itself: the
default mouse, in which it is 0.63, needs 112 kPa, at 0.8 it needs 181, at 1.0 626, and at 1.2 it stands still."""

OVERSTRAINED = 200e3
"""Tension, Pa, beyond what muscle bears."""

UNKNOWN: dict[str, Unknown] = {"pressure_volume": "tension", "pressure": None, "volume": "cavity_pressure"}
"""Scalar unknown of each value of `loop.prescribed`."""


class SolvedFrame(NamedTuple):
    """A solved frame.

    Attributes
    ----------
    state : State
    load : Load
        Balanced by the state.
    factorizations : int
        Number up to this frame.
    max_error : float
        Largest relative residual of force, cavity volume and cell volumes.
    arterial_pressure : float, Pa
        In the root of the aorta; not a number without a circulation.
    compartment_pressure, compartment_volume : ndarray of shape (8,), Pa and m^3
        Of the circulation; not numbers without one.
    """

    state: State
    load: Load
    factorizations: int
    max_error: float
    arterial_pressure: float
    compartment_pressure: Floats
    compartment_volume: Floats


@dataclass(frozen=True)
class SolvedCycle:
    """A solved cycle.

    Attributes
    ----------
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
        From the unloaded state.
    pressure, volume : ndarray of shape (n_frames,), Pa and m^3
        Solved pressure and volume of the cavity.
    pressure_target, volume_target : ndarray of shape (n_frames,), Pa and m^3
        Prescribed by the cycle; not a number where it prescribes none.
    active_tension : ndarray of shape (n_frames,), Pa
        T_Ca of the healthy wall.
    cell_tension : ndarray of shape (n_frames, n_cells), Pa
        T of the cells, by their contractility, activation and length.
    newton_steps : ndarray of shape (n_frames,)
        Factorizations.
    residual : ndarray of shape (n_frames,)
        Largest relative residual of force, cavity volume and cell volumes.
    stiffness : float, Pa
    arterial_pressure : ndarray of shape (n_frames,), Pa
        In the root of the aorta; not a number without a circulation.
    compartment_pressure, compartment_volume : ndarray of shape (n_frames, 8), Pa and m^3
        Of the compartments of the circulation, in their order (:mod:`echotruth.loop.circulation`); not a number without
        one.
    """

    displacement: Floats
    pressure: Floats
    volume: Floats
    pressure_target: Floats
    volume_target: Floats
    active_tension: Floats
    cell_tension: NDArray[np.float32]
    newton_steps: NDArray[np.int64]
    residual: Floats
    stiffness: float
    arterial_pressure: Floats
    compartment_pressure: Floats
    compartment_volume: Floats


def solve(
    equations: Equilibrium, cycle: Cycle, tension_scale: Floats, stiffness: float | None = None
) -> tuple[SolvedCycle, list[SolvedFrame]]:
    """Drive a heart through a cycle.

    Parameters
    ----------
    equations : Equilibrium
    cycle : Cycle
    tension_scale : ndarray of shape (n_cells,)
        Active tension of the cells over T_Ca.
    stiffness : float, optional, Pa
        C of the passive law. If not given, it is solved from end-diastole; if given, the
        volumes of a pressure-volume loop are scaled to the volume at end-diastolic pressure.

    Returns
    -------
    solved : SolvedCycle
    frames : list of SolvedFrame
        From which it is made.

    Raises
    ------
    Diverged
        If a frame cannot be solved.
    """
    stepper = filled_to_end_diastole(equations, cycle, stiffness)
    if stiffness is not None and cycle.prescribed == "pressure_volume":
        cycle = cycle.scaled(stepper.load.volume / cycle.edv)
    frames = list(solved_frames(stepper, cycle, tension_scale))
    return solved_cycle(equations, cycle, frames), frames


def filled_to_end_diastole(
    equations: Equilibrium, cycle: Cycle, stiffness: float | None = None, predictors: tuple[State, ...] = ()
) -> LoadStepper:
    """Fill the passive heart to end-diastole.

    Parameters
    ----------
    equations : Equilibrium
    cycle : Cycle
    stiffness : float, optional, Pa
        C. If not given, it is solved from the end-diastolic pressure and volume.
    predictors : tuple of State
        States of end-diastole of like hearts, from which a heart that fills to a pressure may start.

    Returns
    -------
    LoadStepper
        At end-diastole, at which the surroundings are at rest.

    Raises
    ------
    Diverged
        If the heart cannot be filled.
    """
    law = equations.law
    initial = INITIAL_STIFFNESS / relative_stiffness(law.energy, law.constants) if stiffness is None else stiffness
    if cycle.pressure is None:
        stepper = LoadStepper(equations, initial)
        stepper.advance(Load(0.0, cycle.edv, 0.0), "cavity_pressure")
    else:
        stepper = _filled_to_pressure(equations, cycle, stiffness is None, initial, predictors)
    stepper.rest()
    return stepper


def _filled_to_pressure(
    equations: Equilibrium, cycle: Cycle, stiffness_unknown: bool, initial: float, predictors: tuple[State, ...]
) -> LoadStepper:
    assert cycle.pressure is not None
    pressure = float(cycle.pressure[0])
    if stiffness_unknown:
        _check_volume(equations, cycle)
    # A law without exponential has a limit point: a pressure, in proportion to C, beyond which no wall holds it.
    for stiffness in (initial, 2 * initial, 4 * initial) if stiffness_unknown else (initial,):
        stepper = LoadStepper(equations, stiffness)
        try:
            stepper.advance(Load(pressure, 1.0, 0.0), None, predictors)
            break
        except Diverged as failure:
            logger.debug("%s", failure)
    else:
        holds = f"a wall with C = {stiffness / 1e3:.3g} kPa does not hold the end-diastolic {pressure / 1e3:.3g} kPa"
        raise Diverged(f"{holds}: give a larger mechanics.material.stiffness_kPa or a finer mesh.")
    logger.info("filled to %.4g uL with C = %.4g kPa", stepper.load.volume * 1e9, stepper.state.stiffness / 1e3)
    if stiffness_unknown:
        state = stepper.advance(Load(pressure, cycle.edv, 0.0), "stiffness")
        logger.info("C = %.4g kPa for an end-diastolic volume of %.4g uL", state.stiffness / 1e3, cycle.edv * 1e9)
    return stepper


def _check_volume(equations: Equilibrium, cycle: Cycle) -> None:
    """Refuse a volume at end-diastole that is not above that of the unloaded cavity."""
    unloaded_volume = cavity_volume(equations.mesh.nodes, equations.mesh.endo)
    if cycle.edv <= unloaded_volume:
        least = LEAST_FILLING * unloaded_volume
        volumes = f"{cycle.edv * 1e9:.3g} uL at end-diastole, and the unloaded cavity {unloaded_volume * 1e9:.3g} uL"
        shrunk = (cycle.edv / least) ** (1 / 3)
        remedy = f"give loop.edv_uL of {least * 1e9:.3g} or more, or {shrunk:.3g} of this geometry.scale or less"
        raise Diverged(f"the loop has {volumes}: {remedy}.")


def solved_frames(stepper: LoadStepper, cycle: Cycle, tension_scale: Floats) -> Iterator[SolvedFrame]:
    """The frames of a cycle, of which a stepper has solved the first one."""
    states: list[State] = []
    for frame, time in enumerate(cycle.time):
        before = stepper.factorizations
        if frame:
            try:
                _solve_next(stepper, cycle, tension_scale, states)
            except Diverged as failure:
                tension = [*(state.tension for state in states), stepper.state.tension]
                said = overstrained(cycle, np.array(tension), stepper.equations.law.cross_fibre)
                raise Diverged(said or str(failure)) from None
            loads = stepper.load.pressure / 1e3, stepper.load.volume * 1e9, stepper.state.tension / 1e3
            text = "frame %d of %d, %.4g ms: %.2f kPa, %.4g uL, T_Ca %.2f kPa, %d factorizations"
            logger.info(text, frame, len(cycle.time), time * 1e3, *loads, stepper.factorizations - before)
        states.append(stepper.state)
        yield solved_frame(stepper)


def solved_frame(stepper: LoadStepper) -> SolvedFrame:
    """The frame that a stepper has solved last."""
    circulation = stepper.arterial_pressure, stepper.pressures, stepper.volumes
    return SolvedFrame(stepper.state, stepper.load, stepper.factorizations, stepper.max_error, *circulation)


def overstrained(cycle: Cycle, tension: Floats, cross_fibre: Floats) -> str:
    """What is wrong, in one sentence, with a loop that asks for more tension than muscle bears; empty if it does not.

    Parameters
    ----------
    cycle : Cycle
    tension : ndarray of shape (n,), Pa
        T_Ca in its first frames.
    cross_fibre : ndarray of shape (2,)
        Shares of the tension along sheet and sheet normal.
    """
    if cycle.volume is None or tension.max() < OVERSTRAINED:
        return ""
    said = f"The loop asks for a T_Ca of {tension.max() / 1e3:.0f} kPa, and muscle bears {OVERSTRAINED / 1e3:g}"
    most = MOST_NORMAL_SHARE * cross_fibre[0]
    if cross_fibre[1] > most:
        return f"{said}: give mechanics.active.normal_share of {most:.2g} or less, or raise sheet_share."
    borne = cycle.volume[: max(1, int(np.argmax(tension >= OVERSTRAINED)))].min() / cycle.edv
    if borne > 0.9:
        return f"{said}, before it has ejected: lower loop.esp_mmHg, or thicken the wall."
    return f"{said}: give loop.esv_uL of {borne:.2f} times the end-diastolic volume or more."


def _solve_next(stepper: LoadStepper, cycle: Cycle, tension_scale: Floats, states: list[State]) -> None:
    """Solve the frame after the given states."""
    frame, unknown = len(states), UNKNOWN[cycle.prescribed]
    pressure = 0.0 if cycle.pressure is None else float(cycle.pressure[frame])
    volume = 1.0 if cycle.volume is None else float(cycle.volume[frame])
    load = Load(pressure, volume, tension_scale, time=float(cycle.time[frame]))
    if cycle.tension is not None:
        load = replace(load, tension_fraction=0.0, tension=tension_scale * cycle.tension[frame])
    stepper.advance(load, unknown, extrapolated(states))
    if cycle.tension is not None:
        stepper.state = replace(stepper.state, tension=float(cycle.tension[frame]))


def extrapolated(states: list[State]) -> tuple[State, ...]:
    """Next state by polynomials of degrees 3 to 1 through the last ones."""
    weights = ((-1, 4, -6, 4), (1, -3, 3), (-1, 2))
    return tuple(linear_combination(states[-len(row) :], row) for row in weights if len(states) >= len(row))


def solved_cycle(equations: Equilibrium, cycle: Cycle, frames: Sequence[SolvedFrame]) -> SolvedCycle:
    """The solved frames of a cycle together."""
    none = np.full(len(frames), np.nan)
    return SolvedCycle(
        displacement=np.array([equations.assembly.displacement(frame.state.solution) for frame in frames]),
        pressure=np.array([frame.load.pressure for frame in frames]),
        volume=np.array([frame.load.volume for frame in frames]),
        pressure_target=none if cycle.pressure is None else cycle.pressure,
        volume_target=none if cycle.volume is None else cycle.volume,
        active_tension=np.array([frame.state.tension for frame in frames]),
        cell_tension=np.array([_cell_tension(frame, len(equations.mesh.cells)) for frame in frames], np.float32),
        newton_steps=np.diff([frame.factorizations for frame in frames], prepend=0),
        residual=np.array([frame.max_error for frame in frames]),
        stiffness=frames[0].state.stiffness,
        arterial_pressure=np.array([frame.arterial_pressure for frame in frames]),
        compartment_pressure=np.array([frame.compartment_pressure for frame in frames]),
        compartment_volume=np.array([frame.compartment_volume for frame in frames]),
    )


def _cell_tension(frame: SolvedFrame, n_cells: int) -> Floats:
    tension = frame.state.tension * frame.load.tension_fraction + frame.load.tension
    return np.broadcast_to(np.asarray(tension), n_cells)
