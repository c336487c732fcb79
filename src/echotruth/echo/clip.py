"""A recorded clip of one cycle, with square pixels of known size and frames of known time."""

from os import PathLike
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.echo import files, sector
from echotruth.echo.failure import FEWEST_FRAMES, EchoError, unsaid
from echotruth.echo.recording import Recording, check_size
from echotruth.echo.wall_file import Excerpt
from echotruth.echo.wall_file import part as part_of

SQUARE = 1e-3
"""Relative difference of the sides of a pixel from which an image is resampled to square pixels."""
SIDES_MM, STEPS_MS = (0.001, 10.0), (0.01, 1000.0)
"""Shortest and longest side of a pixel, and time from frame to frame, of an echo of any heart."""
LARGEST_RATIO = 100.0
"""Longer side of a pixel over the shorter."""


def read_clip(
    source: str | PathLike[str] | ArrayLike,
    *,
    spacing_mm: float | None = None,
    frame_time_ms: float | None = None,
    cycle: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | Literal["sector"] | None = None,
    part: str = "",
) -> xr.Dataset:
    """Read a recorded clip.

    Parameters
    ----------
    source : str, Path or array_like
        DICOM, video (.mp4, .avi, .mov, .mkv), .gif, .tif of several pages, NIfTI, .npy, a folder of images, the .zarr
        of a recording of EchoXFlow, or grey levels (frame, axial, lateral). Images of a folder are frames in the order
        of the numbers in their names. Levels of 8 bits are taken as they are; those of more bits, or real, are scaled
        so that the least of the clip becomes 0 and the largest 255. Images in colour of more bits keep the upper 8.
    spacing_mm : float, optional
        Distance of pixel centres. Default: what the file says; videos and images say nothing.
    frame_time_ms : float, optional
        Time from frame to frame. Default: what the file says; videos and animations are often played more slowly than
        the heart beat, so theirs is not taken.
    cycle : tuple of int, optional
        First frame, at end-diastole, and the frame after the last. Default: from the first R wave to the next where
        the file has two, else the whole clip.
    crop : tuple of int or "sector", optional
        Part of the image: left, top, right, bottom, px of the file's region; or what of it changes over the frames,
        without the writing about it. Default: all.
    part : str, optional
        Cycle and crop of the clip in which a wall was drawn, as its attribute `part` says, where neither is given.

    Returns
    -------
    Dataset
        `image` (frame, axial, lateral), uint8, with the coordinates time (s), axial and lateral (m), and the attributes
        `source`, `spacing` (m) and `part`: the frames and pixels of the file that it holds, as "cycle 31 59, crop 120
        40 520 440".

    Raises
    ------
    EchoError
        If it is no clip of three frames or more, its levels are not finite, or its spacing or frame time is neither
        given nor in the file, or is that of no echo: beyond 0.001 to 10 mm, or 0.01 to 1000 ms.

    Examples
    --------
    >>> import numpy as np
    >>> import echotruth as et
    >>> clip = et.read_clip(np.zeros((10, 64, 48), np.uint8), spacing_mm=0.3, frame_time_ms=20)
    >>> clip["image"].dims, float(clip["time"][-1])
    (('frame', 'axial', 'lateral'), 0.18)
    """
    is_path = isinstance(source, str | PathLike)
    name = str(source) if is_path else "array"
    with np.errstate(all="ignore"):  # whatever is not finite is reported below
        recording = files.read(Path(source)) if is_path else files.of_array(source)  # type: ignore[arg-type]
        _check_said(recording, spacing_mm, frame_time_ms, name)
        time = _time(recording, frame_time_ms, name)
    if drawn := part_of(part):
        cycle, crop = cycle or drawn.cycle, crop or drawn.crop
    first, stop = _cycle(recording, time, cycle, name)
    height, width = recording.frames.shape[1:]
    if crop == "sector":
        crop = sector.find(recording.frames)
    crop = crop or (0, 0, width, height)
    shown = Excerpt((first, stop), (crop[0], crop[1], crop[2], crop[3]))
    frames = _cropped(recording.frames[first:stop], shown.crop, name)
    frames, spacing = _square(frames, _spacing(recording, spacing_mm, name))
    axial, lateral = (np.arange(size) * spacing for size in frames.shape[1:])
    return xr.Dataset(
        {"image": (("frame", "axial", "lateral"), frames, {"units": "1", "long_name": "grey level"})},
        coords={
            "frame": np.arange(len(frames)),
            "time": ("frame", time[first:stop] - time[first], {"units": "s", "long_name": "since the first frame"}),
            "axial": ("axial", axial, {"units": "m", "long_name": "distance from the first row"}),
            "lateral": ("lateral", lateral, {"units": "m", "long_name": "distance from the first column"}),
        },
        attrs={"source": name, "spacing": spacing, "part": str(shown)},
    )


def _check_said(recording: Recording, spacing_mm: float | None, frame_time_ms: float | None, name: str) -> None:
    """Raise an :class:`EchoError` that asks for all that neither the file nor an option says."""
    has_spacing = recording.spacing and min(recording.spacing) > 0
    missing = [] if has_spacing or spacing_mm is not None else ["spacing_mm"]
    missing += [] if len(recording.time) or frame_time_ms is not None else ["frame_time_ms"]
    if missing:
        raise EchoError(unsaid(name, missing))


def _time(recording: Recording, frame_time_ms: float | None, name: str) -> Floats:
    """Times (frame,), s."""
    if frame_time_ms is not None:
        _check_within(STEPS_MS, frame_time_ms, f"frame_time_ms = {frame_time_ms:g}: give a time")
        return np.arange(len(recording.frames), dtype=float) * frame_time_ms * 1e-3
    steps = 1e3 * np.diff(recording.time)
    if not (steps > 0).all():
        raise EchoError(f"{name}: has frames of which the times do not increase: give frame_time_ms")
    for step in steps:
        _check_within(STEPS_MS, step, f"{name}: has a time from frame to frame of {step:g} ms: give frame_time_ms")
    return recording.time


def _check_within(bounds: tuple[float, float], value: float, said: str) -> None:
    """Raise an :class:`EchoError` that says the bounds, ms or mm, if a value is not within them."""
    if not bounds[0] <= value <= bounds[1]:
        raise EchoError(f"{said} from {bounds[0]:g} to {bounds[1]:g}")


def _spacing(recording: Recording, spacing_mm: float | None, name: str) -> tuple[float, float]:
    """Axial and lateral distance of pixel centres, m."""
    if spacing_mm is not None:
        _check_within(SIDES_MM, spacing_mm, f"spacing_mm = {spacing_mm:g}: give a side")
        return spacing_mm * 1e-3, spacing_mm * 1e-3
    axial, lateral = recording.spacing
    sides = f"{name}: has pixels of {1e3 * axial:g} x {1e3 * lateral:g} mm"
    for side in recording.spacing:
        _check_within(SIDES_MM, 1e3 * side, f"{sides}: give spacing_mm")
    if max(axial, lateral) > LARGEST_RATIO * min(axial, lateral):
        raise EchoError(f"{sides}, more than {LARGEST_RATIO:g} to 1: if they are square give spacing_mm")
    return axial, lateral


def _cycle(recording: Recording, time: Floats, cycle: tuple[int, int] | None, name: str) -> tuple[int, int]:
    """First frame of the cycle and the frame after its last."""
    frames = len(recording.frames)
    if frames < FEWEST_FRAMES:
        raise EchoError(f"{name}: has {frames} frame{'s' * (frames > 1)}: a clip needs {FEWEST_FRAMES} or more")
    if cycle is None and len(recording.r_waves) > 1:
        waves = np.searchsorted(time, recording.r_waves[:2] - 1e-9)
        cycle = (int(waves[0]), int(waves[1]))
        cycle = cycle if cycle[1] - cycle[0] >= FEWEST_FRAMES else (0, frames)
    first, stop = cycle or (0, frames)
    if not 0 <= first <= stop - FEWEST_FRAMES <= frames - FEWEST_FRAMES:
        raise EchoError(f"cycle = {first}, {stop}: give {FEWEST_FRAMES} or more of the {frames} frames of {name}")
    return first, stop


def _cropped(frames: NDArray[np.uint8], crop: tuple[int, int, int, int], name: str) -> NDArray[np.uint8]:
    """Part of the frames."""
    left, top, right, bottom = crop
    height, width = frames.shape[1:]
    if not (0 <= left < right <= width and 0 <= top < bottom <= height):
        raise EchoError(f"crop = {left}, {top}, {right}, {bottom}: {name} is {width} x {height} px: stay within it")
    return frames[:, top:bottom, left:right]


def _square(frames: NDArray[np.uint8], spacing: tuple[float, float]) -> tuple[NDArray[np.uint8], float]:
    """Frames with square pixels, of the smaller side, and that side, m."""
    side = min(spacing)
    if max(spacing) - side <= SQUARE * side:
        return frames, side
    height, width = (round(size * length / side) for size, length in zip(frames.shape[1:], spacing, strict=True))
    check_size(len(frames) * height * width, "the clip with square pixels")
    return np.stack([cv2.resize(frame, (width, height), interpolation=cv2.INTER_LINEAR) for frame in frames]), side
