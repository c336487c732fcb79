"""A tracker from elsewhere: called as it is, and its answer looked at before it is believed.

It is given copies of the clip, the points and the mask, and nothing of the truth. What it prints goes to stderr.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from traceback import extract_tb
from typing import Any

import numpy as np

from echotruth.config.tracking import GIVEN, Guest
from echotruth.tracking import external_program
from echotruth.tracking.external_program import in_one_line
from echotruth.tracking.failure import TrackerFailed

GROUP = "echotruth.trackers"
"""Group of entry points under which a package names its trackers."""

ROUNDING = 1e-6
"""By how much a quality may lie outside of 0 to 1 and be taken for single precision's 0 or 1."""

MOVED_PX = 1.0
"""Median displacement in frame 0, where it is 0 by definition, from which an answer is taken for something else."""


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: Guest,
) -> tuple[np.ndarray, np.ndarray]:
    """Ask a guest; arrays, shapes and units are those of :func:`echotruth.tracking.tracker.track`.

    Raises
    ------
    TrackerFailed
        If the guest cannot be found, raises, ends the interpreter, takes too long or does not answer as asked.
    """
    given = (frames.copy(), points.copy(), mask.copy(), float(spacing), frame_time.copy(), int(seed))
    name = settings.track or " ".join(settings.command or ())
    try:
        if settings.track is not None:
            answer = _called(settings.track, given, settings.options)
        else:
            entries = dict(zip(GIVEN, given, strict=True)) | settings.options
            answer = external_program.run(list(settings.command or ()), entries, settings.timeout_s)
        return _checked(answer, (len(frames), len(points)))
    except TrackerFailed as error:
        raise TrackerFailed(f"{name} {error}") from error.__cause__


def _called(track: str, given: tuple[Any, ...], options: dict[str, Any]) -> Any:
    """What a callable returns."""
    try:
        with redirect_stdout(sys.stderr):
            return _found(track)(*given, **options)
    except TrackerFailed:
        raise
    except (Exception, SystemExit) as error:
        # The first place is the call above: where there is no other, the call itself was refused.
        places = [f" ({Path(place.filename).name}, line {place.lineno})" for place in extract_tb(error.__traceback__)]
        raise TrackerFailed(f"raised {_named(error)}{places[-1] if len(places) > 1 else ''}") from error


def _named(error: BaseException) -> str:
    return in_one_line(f"{type(error).__name__}: {error}")


def _found(track: str) -> Callable[..., Any]:
    """The callable of a name; what lies in the current directory can be imported as a package can."""
    if not {"", str(Path.cwd())} & set(sys.path):
        sys.path.insert(0, str(Path.cwd()))
    known = entry_points(group=GROUP)
    if ":" not in track and track not in known.names:
        there = ", ".join(sorted(known.names)) or "none"
        raise TrackerFailed(
            f"is not an entry point of the group {GROUP} (there is {there}): install the package that has it, or "
            "write package.module:function"
        )
    entry = EntryPoint("guest", track, GROUP) if ":" in track else known[track]
    try:
        found = entry.load()
    except (Exception, SystemExit) as error:
        raise TrackerFailed(f"cannot be imported: {_named(error)}") from error
    if not callable(found):
        raise TrackerFailed(f"is a {type(found).__name__}, where a function is needed")
    return found


def _checked(answer: Any, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and quality of an answer, as arrays of our own."""
    if isinstance(answer, tuple) and len(answer) != 2:
        raise TrackerFailed(
            f"returned a tuple of {len(answer)}, where displacement, or displacement and quality is due"
        )
    displacement, quality = answer if isinstance(answer, tuple) else (answer, None)
    displacement = _reals("displacement", displacement, (*shape, 2))
    found = np.isfinite(displacement).all(-1)
    if not found[1:].any():
        raise TrackerFailed("returned no finite displacement after frame 0")
    moved = np.median(np.hypot(*displacement[0][found[0]].T)) if found[0].any() else 0.0
    if moved > MOVED_PX:
        raise TrackerFailed(
            f"returned a displacement of {moved:.1f} px in frame 0, where it is 0: return displacements since frame 0, "
            "not positions"
        )
    if quality is None:
        return displacement, np.where(found, 1.0, np.nan)
    quality = _reals("quality", quality, shape)
    if (np.abs(quality - 0.5) > 0.5 + ROUNDING).any():
        low, high = np.nanmin(quality), np.nanmax(quality)
        raise TrackerFailed(f"returned a quality from {low:.3g} to {high:.3g}, where it goes from 0 to 1")
    return displacement, np.clip(quality, 0, 1)


def _reals(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """An array of real numbers of that shape, NaN where masked, or a word about what it is instead."""
    try:
        array = np.ma.asarray(values)
    except Exception as error:
        raise TrackerFailed(f"returned a {name} that is no array ({_named(error)}): {shape} is due") from error
    if array.dtype.kind not in "fiub":
        what = type(values).__name__ if array.dtype.kind == "O" else array.dtype
        raise TrackerFailed(f"returned a {name} of {what}, where real numbers of shape {shape} are due")
    if array.shape != shape:
        raise TrackerFailed(f"returned a {name} of shape {array.shape}, where {shape} is due")
    return array.astype(float).filled(np.nan)
