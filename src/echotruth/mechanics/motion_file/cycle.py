"""One cycle of a series: its frames, their times, and its interpolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from echotruth.arrays import Floats
from echotruth.config.motion import FileMotion
from echotruth.mechanics.motion_file.series import MeshSeries
from echotruth.mechanics.prescribed import MotionError

REPEATS = 0.01
"""Distance of the last frame from the first, over the largest of any, up to which it is the first one again."""
MAX_GAP = 0.03
"""The same, above which a last frame that is said to be the first one again is not; as of a loop."""
MAX_RETURN = 1.5
"""Step from the last frame back to the first, over the largest between frames, above which the cycle is not closed."""
EVEN = 1e-3
"""Deviation of times from equal steps, over a step, below which they are equal: files hold few digits."""


@dataclass(frozen=True)
class RecordedCycle:
    """Frames of one cycle, without the first one repeated.

    Attributes
    ----------
    names : list of str
        Of the frames, for errors.
    positions : ndarray of shape (n_frames, n_points, 3)
        In the unit of the series.
    phase : ndarray of shape (n_frames,)
        Time since the first frame over the period, 0 to below 1.
    first : int
        Number in the series of the first frame.
    """

    names: list[str]
    positions: Floats
    phase: Floats
    first: int

    def beginning_at(self, frame: int) -> RecordedCycle:
        """The cycle from another of its frames on."""
        phase = np.roll(self.phase - self.phase[frame], -frame) % 1.0
        names = self.names[frame:] + self.names[:frame]
        return RecordedCycle(names, np.roll(self.positions, -frame, axis=0), _even(phase), self.first + frame)


def one_cycle(series: MeshSeries, section: FileMotion) -> RecordedCycle:
    """The cycle that a configuration selects in a series.

    Parameters
    ----------
    series : MeshSeries
    section : FileMotion

    Returns
    -------
    RecordedCycle

    Raises
    ------
    MotionError
        If there are no such frames, they are not finite, their times do not increase, or they do not close.
    """
    count = len(series.positions)
    first, last = section.frames or (0, count - 1)
    for key, number in (("frames", last), ("ed_frame", section.ed_frame or 0)):
        if number >= count:
            value = section.frames if key == "frames" else number
            raise MotionError(f"motion.file.{key} = {value}: {series.source} has the frames 0 to {count - 1}.")
    positions, names = series.positions[first : last + 1], series.names[first : last + 1]
    _check_finite(positions, names)
    times = _times(series, section)[first : last + 1]
    repeats = _repeats_first(positions, section, series.source)
    own = len(positions) - repeats
    if own < 2:
        raise MotionError(f"{series.source}: has {own} frame of its own in the cycle: give at least two.")
    duration = (times[-1] - times[0]) * (1.0 if repeats else own / (own - 1))
    return RecordedCycle(names[:own], positions[:own], _even((times[:own] - times[0]) / duration), first)


def periodic_weights(phase: Floats, frames: int) -> Floats:
    """Weights of recorded frames in frames at equal steps of one period.

    Parameters
    ----------
    phase : ndarray of shape (n,)
        Of the recorded frames, from 0 to below 1.
    frames : int

    Returns
    -------
    ndarray of shape (frames, n)
        Those of the periodic cubic spline: exactly 1 for a recorded frame at that phase, and 0 for the others. They
        are the same for all points and axes, so that the result does not depend on the axes of the file.
    """
    values = np.eye(len(phase))
    spline = CubicSpline(np.append(phase, 1.0), np.vstack([values, values[:1]]), bc_type="periodic")
    return spline(np.arange(frames) / frames)


def _check_finite(positions: Floats, names: list[str]) -> None:
    for frame, name in zip(positions, names, strict=True):
        if not np.isfinite(frame).all():
            raise MotionError(f"{name}: has points that are not finite numbers: write the file again.")


def _times(series: MeshSeries, section: FileMotion) -> Floats:
    """Times of all frames of the series, increasing."""
    count = len(series.positions)
    given, key = (
        (series.times, "its times") if section.times is None else (np.array(section.times), "motion.file.times")
    )
    if given is None:
        return np.arange(count, dtype=float)
    if len(given) != count:
        raise MotionError(f"{series.source}: has {count} frames and {key} {len(given)} entries: give one for each.")
    not_later = ~(np.diff(given) > 0)
    if not_later.any():
        number = int(np.argmax(not_later)) + 1
        raise MotionError(f"{series.source}: {key} must increase, and that of frame {number} is {given[number]:g}.")
    return given


def _repeats_first(positions: Floats, section: FileMotion, source: str) -> bool:
    """Whether the last frame is the first one again; refused if it is neither that nor one step before it."""
    distance = np.array([_rms(frame - positions[0]) for frame in positions])
    steps = np.array([_rms(step) for step in np.diff(positions, axis=0)])
    if not distance.max() > 0:
        raise MotionError(f"{source}: does not move in the frames of the cycle: give others by motion.file.frames.")
    gap = distance[-1] / distance.max()
    repeats = gap <= REPEATS if section.repeats_first is None else section.repeats_first
    closed = gap <= MAX_GAP if repeats else distance[-1] <= MAX_RETURN * steps.max()
    if not closed:
        raise MotionError(
            f"{source}: does not close, its last frame is {gap:.0%} of the motion away from its first: give one whole "
            "cycle, by motion.file.frames where the series holds more or less."
        )
    return bool(repeats)


def _rms(vectors: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))


def _even(phase: Floats) -> Floats:
    """Phases, exactly i / n where they are that but for rounding."""
    even = np.arange(len(phase)) / len(phase)
    return even if np.abs(phase - even).max() < EVEN / len(phase) else phase
