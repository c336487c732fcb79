"""Trackers from outside the package: a callable or a program is run, and its result checked.

It receives copies of the clip, the points and the mask, and nothing of the truth. What it prints goes to stderr.
"""

import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from traceback import extract_tb
from typing import Any

import numpy as np

from echotruth.config.tracking import ENTRY_POINT_GROUP, TRACKER_ARGUMENTS, External
from echotruth.tracking import external_program
from echotruth.tracking.external_program import check_real, in_one_line
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker_input import TrackerInput

QUALITY_TOLERANCE = 1e-6
"""Distance of a quality outside 0 to 1 that is accepted as rounding in single precision."""

MAX_DISPLACEMENT_PX = 1e6
"""Largest displacement, which no tissue in an image comes near."""

MAX_INITIAL_DISPLACEMENT_PX = 1.0
"""Median displacement in frame 0, where it is 0 by definition, above which the result is not a displacement."""


def track(clip: TrackerInput, settings: External) -> tuple[np.ndarray, np.ndarray]:
    """Run an external tracker: displacement and quality, as :func:`echotruth.tracking.tracker.track` returns them.

    Raises
    ------
    TrackerFailed
        If the tracker cannot be found, raises, exits, takes too long or returns an invalid result.
    """
    arrays = clip.frames.copy(), clip.points.copy(), clip.mask.copy()
    spacing = np.array(clip.spacing) if clip.is_volume else float(clip.spacing)
    arguments = (*arrays, spacing, clip.frame_time.copy(), int(clip.seed))
    command, shape = settings.command or [], (len(clip.frames), *clip.points.shape)
    try:
        if settings.track is not None:
            result = _call(settings.track, arguments, settings.options)
        else:
            entries = dict(zip(TRACKER_ARGUMENTS, arguments, strict=True)) | settings.options
            result = external_program.run(command, entries, settings.timeout_s, shape)
        return _checked(result, shape)
    except TrackerFailed as error:
        name = getattr(settings.track, "__name__", settings.track) or " ".join(command)
        raise TrackerFailed(f"{name} {error}") from error.__cause__


def _call(name: str | Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
    try:
        with redirect_stdout(sys.stderr):
            return (name if callable(name) else load_callable(name))(*arguments, **options)
    except TrackerFailed:
        raise
    except (Exception, SystemExit) as error:
        # The first entry is the call above; if it is the only one, the arguments were refused.
        lines = [f" ({Path(entry.filename).name}, line {entry.lineno})" for entry in extract_tb(error.__traceback__)]
        raise TrackerFailed(f"raised {_describe(error)}{lines[-1] if len(lines) > 1 else ''}") from error


def _describe(error: BaseException) -> str:
    return in_one_line(f"{type(error).__name__}: {error}")


def load_callable(name: str) -> Callable[..., Any]:
    """Import the callable `package.module:function` or the entry point; the current directory is searched too.

    Raises
    ------
    TrackerFailed
        If it cannot be found or imported.
    """
    if not {"", str(Path.cwd())} & set(sys.path):
        sys.path.insert(0, str(Path.cwd()))
    installed = entry_points(group=ENTRY_POINT_GROUP)
    if ":" not in name and name not in installed.names:
        raise TrackerFailed(
            f"is not an entry point of the group {ENTRY_POINT_GROUP} (installed: "
            f"{', '.join(sorted(installed.names)) or 'none'}): install its package, or write package.module:function"
        )
    entry = EntryPoint("external", name, ENTRY_POINT_GROUP) if ":" in name else installed[name]
    try:
        return entry.load()
    except (Exception, SystemExit) as error:
        raise TrackerFailed(f"cannot be imported: {_describe(error)}") from error


def _checked(result: Any, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and quality as new arrays, from what the tracker returned."""
    if isinstance(result, tuple) and len(result) != 2:
        raise TrackerFailed(f"returned a tuple of {len(result)}, not displacement, or displacement and quality")
    displacement, quality = result if isinstance(result, tuple) else (result, None)
    displacement = _real_array("displacement", displacement, shape)
    known = np.isfinite(displacement).all(-1)
    if not known[1:].any():
        raise TrackerFailed("returned no finite displacement after frame 0")
    largest = np.abs(displacement[known]).max()
    if largest > MAX_DISPLACEMENT_PX:
        raise TrackerFailed(f"returned a displacement of {largest:.3g} px: give px, {MAX_DISPLACEMENT_PX:g} at most")
    initial = np.median(np.linalg.norm(displacement[0][known[0]], axis=-1)) if known[0].any() else 0.0
    if initial > MAX_INITIAL_DISPLACEMENT_PX:
        raise TrackerFailed(
            f"returned a displacement of {initial:.1f} px in frame 0, where it is 0: return displacements since frame "
            "0, not positions"
        )
    if quality is None:
        return displacement, np.full(shape[:2], np.nan)
    quality = _real_array("quality", quality, shape[:2])
    if (np.abs(quality - 0.5) > 0.5 + QUALITY_TOLERANCE).any():
        low, high = np.nanmin(quality), np.nanmax(quality)
        raise TrackerFailed(f"returned a quality from {low:.3g} to {high:.3g}, not from 0 to 1")
    return displacement, np.clip(quality, 0, 1)


def _real_array(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Array of real numbers of a shape, NaN where masked; TrackerFailed if the values are something else."""
    try:
        array = np.ma.asarray(values)
    except Exception as error:
        raise TrackerFailed(f"returned a {name} that is not an array of shape {shape} ({_describe(error)})") from error
    kind = type(values).__name__ if array.dtype.kind == "O" else array.dtype
    check_real(f"returned a {name}", kind, array.shape, shape)
    return np.ma.filled(array.astype(float), np.nan)
