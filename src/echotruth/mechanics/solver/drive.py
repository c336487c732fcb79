"""The heart driven through a cycle, frame by frame.

Of pressure, volume and tension two are given and the third is solved: the tension from a
pressure-volume loop, the volume from pressure and tension, the pressure from volume and tension.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.loop.cycle import Cycle
from echotruth.mechanics.solver.activation import Activation
from echotruth.mechanics.solver.checkpoint import Frame, Progress
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, State, Unknown
from echotruth.mechanics.solver.newton import Diverged, Walk, combined

logger = logging.getLogger("echotruth.mechanics")

FIRST_STIFFNESS = 1100.0
"""Start (Pa) of the search for the stiffness."""

UNKNOWN: dict[str, Unknown] = {"pressure_volume": "tension", "pressure": None, "volume": "cavity_pressure"}
"""What each drive solves for beside the displacements."""


@dataclass(frozen=True)
class Beat:
    """A solved cycle.

    Attributes
    ----------
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
        From the unloaded state.
    pressure, volume : ndarray of shape (n_frames,), Pa and m^3
        In the solved cavity.
    pressure_asked, volume_asked : ndarray of shape (n_frames,), Pa and m^3
        What the cycle asks for; not a number where it leaves it open.
    tension : ndarray of shape (n_frames,), Pa
        T_Ca of the healthy, undelayed wall.
    newton_steps : ndarray of shape (n_frames,)
        Factorizations.
    residual : ndarray of shape (n_frames,)
        Relative imbalance of force, volume and growth that is left.
    stiffness : float, Pa
    """

    displacement: Floats
    pressure: Floats
    volume: Floats
    pressure_asked: Floats
    volume_asked: Floats
    tension: Floats
    newton_steps: NDArray[np.int64]
    residual: Floats
    stiffness: float


def solve(
    heart: Equilibrium,
    cycle: Cycle,
    activation: Activation,
    stiffness: float | None = None,
    progress: Progress | None = None,
) -> Beat:
    """Drive a heart through a cycle.

    Parameters
    ----------
    heart : Equilibrium
    cycle : Cycle
    activation : Activation
        Of its cells.
    stiffness : float, optional, Pa
        C of the passive law. If not given, it is solved from end-diastole; if given, the
        volumes of a pressure-volume loop are scaled to what the heart then holds at end-diastole.
    progress : Progress, optional
        Frames solved before, which are taken up, and those solved now.

    Returns
    -------
    Beat

    Raises
    ------
    Diverged
        If a frame cannot be solved.
    """
    walk = Walk(heart, FIRST_STIFFNESS if stiffness is None else stiffness)
    frames = progress.frames() if progress else []
    if frames:
        logger.info("goes on after %d of %d frames", len(frames), len(cycle.time))
        walk.resume(frames[-1])
    else:
        end_diastole(walk, cycle, stiffness)
        frames = [_kept(walk, progress)]
    if stiffness is not None and cycle.drive == "pressure_volume":
        cycle = cycle.scaled(frames[0].load.volume / float(cycle.volume[0]))
    while len(frames) < len(cycle.time):
        _next(walk, cycle, activation, [frame.state for frame in frames])
        frames.append(_kept(walk, progress))
        _report(cycle, frames)
    return _beat(heart, cycle, frames)


def end_diastole(walk: Walk, cycle: Cycle, stiffness: float | None) -> None:
    """Fill the passive heart to end-diastole.

    Parameters
    ----------
    walk : Walk
        At rest.
    cycle : Cycle
    stiffness : float, optional, Pa
        C. If not given, it is solved from the end-diastolic pressure and volume.

    Raises
    ------
    Diverged
        If the heart cannot be filled.
    """
    if cycle.pressure is None:
        walk.to(Load(0.0, float(cycle.volume[0]), 0.0), "cavity_pressure")
        return
    pressure = float(cycle.pressure[0])
    if stiffness is None:
        _fits(cycle, walk.load.volume)
    walk.to(Load(pressure, 1.0, 0.0), None)
    logger.info("filled to %.4g uL with C = %.4g kPa", walk.load.volume * 1e9, walk.state.stiffness / 1e3)
    if stiffness is None:
        state = walk.to(Load(pressure, float(cycle.volume[0]), 0.0), "stiffness")
        logger.info("C = %.4g kPa for an end-diastolic volume of %.4g uL", state.stiffness / 1e3, cycle.volume[0] * 1e9)


def _fits(cycle: Cycle, empty: float) -> None:
    if cycle.volume[0] <= empty:
        volumes = f"{cycle.volume[0] * 1e9:.3g} uL at end-diastole, and the unloaded cavity {empty * 1e9:.3g} uL"
        raise Diverged(f"the loop has {volumes}: raise edv_uL, or make the heart smaller (scale).")


def _next(walk: Walk, cycle: Cycle, activation: Activation, states: list[State]) -> None:
    """Solve the frame after those given."""
    frame, unknown = len(states), UNKNOWN[cycle.drive]
    pressure = 0.0 if cycle.pressure is None else float(cycle.pressure[frame])
    volume = 1.0 if cycle.volume is None else float(cycle.volume[frame])
    if unknown == "tension":
        share, tension = activation.share(), activation.before([state.tension for state in states])
    else:
        share, tension = 0.0, activation.tension(cycle.tension[: frame + 1])
    load = Load(pressure, volume, share, tension, time=float(cycle.time[frame]))
    walk.to(load, unknown, _extrapolated(states))
    if cycle.tension is not None:
        walk.state = replace(walk.state, tension=float(cycle.tension[frame]))


def _kept(walk: Walk, progress: Progress | None) -> Frame:
    frame = walk.frame()
    if progress:
        progress.add(frame)
    return frame


def _report(cycle: Cycle, frames: list[Frame]) -> None:
    number, (before, now) = len(frames) - 1, frames[-2:]
    place = (number, len(cycle.time), cycle.time[number] * 1e3, now.load.pressure / 1e3, now.load.volume * 1e9)
    row = (*place, now.state.tension / 1e3, now.steps - before.steps)
    logger.info("frame %d of %d, %.4g ms: %.2f kPa, %.4g uL, T_Ca %.2f kPa, %d steps", *row)


def _extrapolated(states: list[State]) -> tuple[State, ...]:
    """On from the last states by polynomials of degrees 3 to 1."""
    weights = ((-1, 4, -6, 4), (1, -3, 3), (-1, 2))
    return tuple(combined(states[-len(row) :], row) for row in weights if len(states) >= len(row))


def _beat(heart: Equilibrium, cycle: Cycle, frames: list[Frame]) -> Beat:
    nothing = np.full(len(frames), np.nan)
    return Beat(
        displacement=np.array([heart.assembly.spread(frame.state.solution) for frame in frames]),
        pressure=np.array([frame.load.pressure for frame in frames]),
        volume=np.array([frame.load.volume for frame in frames]),
        pressure_asked=nothing if UNKNOWN[cycle.drive] == "cavity_pressure" else cycle.pressure,
        volume_asked=nothing if cycle.volume is None else cycle.volume,
        tension=np.array([frame.state.tension for frame in frames]),
        newton_steps=np.diff([frame.steps for frame in frames], prepend=0),
        residual=np.array([frame.residual for frame in frames]),
        stiffness=frames[0].state.stiffness,
    )
