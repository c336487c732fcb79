"""The truth drawn over B-mode images, on their own pixels, so that the scale stays."""

from collections.abc import Sequence

import cv2
import matplotlib
import numpy as np
from matplotlib.colors import to_rgb, to_rgba_array
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.report.style import BORDER, MOTION, tissue_colours
from echotruth.sharing.export.clip import Clip

OPACITY = 0.35
"""Of the colours of segments and tissues."""

ARROWS_ALONG_SIDE = 28
"""Arrows along the side of an image that is all wall."""

SCALE = "#f2f2f2"
"""Colour of the depth scale, the time and the line of the beat."""

DEPTHS = 8
"""Marks of the depth scale, at most."""

_SHIFT = 4
"""Binary digits of a fraction of a pixel in OpenCV's coordinates."""

Pictures = NDArray[np.uint8]


def pictures(clip: Clip, overlay: Sequence[str]) -> Pictures:
    """Images of a clip with what is to be drawn over them.

    Parameters
    ----------
    clip : Clip
    overlay : sequence of {"wall", "segments", "tissue", "displacement", "scale"}
        The border of the wall; the AHA segments in colour; all tissues in colour; arrows from where points of the
        tissue were at end-diastole to where they are; a depth scale, the time since end-diastole, and a line of the
        beat, with a spike at end-diastole, a mark at end-systole and a dot that runs along it.

    Returns
    -------
    ndarray of shape (frame, axial, lateral), or (frame, axial, lateral, 3) with an overlay, uint8
        Grey levels, unchanged, or RGB.
    """
    found = np.repeat(clip.image[..., None], 3, axis=-1) if overlay else clip.image
    for name, draw in DRAWINGS.items():
        if name in overlay:
            draw(clip, found)
    return found


def _segments(clip: Clip, frames: Pictures) -> None:
    """Colour the segments, those of AHA next to each other differently."""
    _tint(frames, clip.truth("segment")["segment"].values, matplotlib.colormaps["tab10"](np.arange(1, 18) * 3 % 10))


def _tissue(clip: Clip, frames: Pictures) -> None:
    """Colour the tissues."""
    _tint(frames, clip.truth("tissue")["tissue"].values, to_rgba_array(tissue_colours()))


def _tint(frames: Pictures, labels: Pictures, palette: Floats) -> None:
    """Lay the colours (n, 4) of the numbers from 1 on over images."""
    colours = np.vstack([np.zeros(3), palette[:, :3]]) * 255
    for frame, numbers in zip(frames, labels, strict=True):
        tinted = (1 - OPACITY) * frame + OPACITY * colours[numbers]
        frame[:] = np.where(numbers[..., None] > 0, np.round(tinted), frame)


def _wall(clip: Clip, frames: Pictures) -> None:
    """Draw the border of the wall, half-way between the centres of pixels in and out of it."""
    for frame, mask in zip(frames, clip.truth("mask")["mask"].values, strict=True):
        contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(frame, contours, -1, _rgb(BORDER), _thickness(clip), cv2.LINE_AA)


def _displacement(clip: Clip, frames: Pictures) -> None:
    """Draw an arrow for each point of a grid that is in the wall at end-diastole."""
    step = max(1, clip.size // ARROWS_ALONG_SIDE)
    position = clip.tracks(step)["pixel"].values
    for frame, ends in zip(frames, position, strict=True):
        for start, end in zip(_fixed(position[0]), _fixed(ends), strict=True):
            cv2.line(frame, start, end, _rgb(MOTION), _thickness(clip), cv2.LINE_AA, _SHIFT)
            cv2.circle(frame, end, _thickness(clip) << _SHIFT, _rgb(MOTION), -1, cv2.LINE_AA, _SHIFT)


def _scale(clip: Clip, frames: Pictures) -> None:
    """Draw the depth scale at the right, and the time and the line of the beat at the bottom."""
    size, margin, thickness = clip.size, round(0.03 * clip.size), _thickness(clip)
    step = _round_step(size * clip.spacing / DEPTHS)
    depths = np.arange(step, size * clip.spacing, step)
    period, es = clip.time[-1] + clip.frame_time, clip.time[clip.heart.es]
    left, right, row = margin, size - 1 - margin, size - 1 - margin
    for frame, time in zip(frames, clip.time, strict=True):
        for number, depth in enumerate(depths, start=1):
            start, at = clip.axial[0] - clip.spacing / 2, right - margin * (2 if number % 5 == 0 else 1)
            level = round((depth - start) / clip.spacing - 0.5)
            cv2.line(frame, (at, level), (right, level), _rgb(SCALE), thickness)
        cv2.line(frame, (left, row), (size // 2, row), _rgb(SCALE), thickness)
        for moment, height in ((0.0, 3 * margin), (es, margin)):
            column = round(left + moment / period * (size // 2 - left))
            cv2.line(frame, (column, row), (column, row - height), _rgb(SCALE), thickness)
        column = round(left + time / period * (size // 2 - left))
        cv2.circle(frame, (column, row), 2 * thickness, _rgb(MOTION), -1, cv2.LINE_AA)
        _write(frame, f"{1e3 * time:.0f} ms", (left + margin, row - 2 * margin))
        _write(frame, f"{1e3 * step:g} mm", (0, 2 * margin), right)


def _round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below a length, m."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9)))


def _write(frame: Pictures, text: str, corner: tuple[int, int], right: int | None = None) -> None:
    """Write a text with its lower left corner at (column, row), or its right end at a column."""
    scale = max(0.3, frame.shape[0] / 1000)
    if right is not None:
        corner = right - cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0][0], corner[1]
    cv2.putText(frame, text, corner, cv2.FONT_HERSHEY_SIMPLEX, scale, _rgb(SCALE), 1, cv2.LINE_AA)


DRAWINGS = {"segments": _segments, "tissue": _tissue, "wall": _wall, "displacement": _displacement, "scale": _scale}
"""Name of an overlay to the function that draws it, those below first."""


def _fixed(position: NDArray[np.floating]) -> list[list[int]]:
    """Positions (point, 2), px, as OpenCV takes fractions of a pixel."""
    return np.round(position * (1 << _SHIFT)).astype(int).tolist()


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(255 * part for part in to_rgb(colour))


def _thickness(clip: Clip) -> int:
    """Width of lines, px."""
    return max(1, round(clip.size / 300))
