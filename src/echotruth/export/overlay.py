"""The truth drawn over B-mode images, on their own pixels, so that the scale stays."""

from collections.abc import Sequence

import cv2
import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from echotruth.export.clip import Clip
from echotruth.report.clip import MOTION

WALL = "#4cc9f0"
"""Colour of the border of the wall."""

OPACITY = 0.35
"""Of the colours of the segments."""

ARROWS_ALONG_SIDE = 28
"""Arrows along the side of an image that is all wall."""

_SHIFT = 4
"""Binary digits of a fraction of a pixel in OpenCV's coordinates."""

Pictures = NDArray[np.uint8]


def pictures(clip: Clip, overlay: Sequence[str]) -> Pictures:
    """Images of a clip with what is to be drawn over them.

    Parameters
    ----------
    clip : Clip
    overlay : sequence of {"wall", "segments", "displacement"}
        The border of the wall; the AHA segments in colour; arrows from where points of the tissue were at
        end-diastole to where they are.

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
    segment = clip.truth("segment")["segment"].values
    colours = np.vstack([np.zeros(3), matplotlib.colormaps["tab10"](np.arange(1, 18) * 3 % 10)[:, :3]]) * 255
    for frame, numbers in zip(frames, segment, strict=True):
        tinted = (1 - OPACITY) * frame + OPACITY * colours[numbers]
        frame[:] = np.where(numbers[..., None] > 0, np.round(tinted), frame)


def _wall(clip: Clip, frames: Pictures) -> None:
    """Draw the border of the wall, half-way between the centres of pixels in and out of it."""
    for frame, mask in zip(frames, clip.truth("mask")["mask"].values, strict=True):
        contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(frame, contours, -1, _rgb(WALL), _thickness(clip), cv2.LINE_AA)


def _displacement(clip: Clip, frames: Pictures) -> None:
    """Draw an arrow for each point of a grid that is in the wall at end-diastole."""
    step = max(1, clip.size // ARROWS_ALONG_SIDE)
    position = clip.tracks(step)["pixel"].values
    for frame, ends in zip(frames, position, strict=True):
        for start, end in zip(_fixed(position[0]), _fixed(ends), strict=True):
            cv2.line(frame, start, end, _rgb(MOTION), _thickness(clip), cv2.LINE_AA, _SHIFT)
            cv2.circle(frame, end, _thickness(clip) << _SHIFT, _rgb(MOTION), -1, cv2.LINE_AA, _SHIFT)


DRAWINGS = {"segments": _segments, "wall": _wall, "displacement": _displacement}
"""Name of an overlay to the function that draws it, those below first."""


def _fixed(position: NDArray[np.floating]) -> list[list[int]]:
    """Positions (point, 2), px, as OpenCV takes fractions of a pixel."""
    return np.round(position * (1 << _SHIFT)).astype(int).tolist()


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(255 * part for part in to_rgb(colour))


def _thickness(clip: Clip) -> int:
    """Width of lines, px."""
    return max(1, round(clip.size / 300))
