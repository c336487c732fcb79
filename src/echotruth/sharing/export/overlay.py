"""The truth drawn over B-mode images, on their own pixels, so that the scale stays."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw

from echotruth.arrays import Floats
from echotruth.report.palette import BORDER, MOTION, SEGMENTS, TISSUES
from echotruth.sharing.export.clip import ExportedClip

OPACITY = 0.35
"""Of the colours of segments and tissues."""

ARROWS_ALONG_SIDE = 28
"""Arrows along the side of an image that is all wall."""

_DETAIL = 4
"""Pixels, along each axis, of which a drawing has one, so that its edges are smooth."""

Pictures = NDArray[np.uint8]


def pictures(clip: ExportedClip, overlay: Sequence[str]) -> Pictures:
    """Images of a clip with what is to be drawn over them.

    Parameters
    ----------
    clip : ExportedClip
    overlay : sequence of {"wall", "segments", "tissue", "displacement"}
        The border of the wall; the AHA segments in colour; all tissues in colour; arrows from where points of the
        tissue were at end-diastole to where they are.

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


def _tint(clip: ExportedClip, frames: Pictures, name: str, palette: Sequence[str]) -> None:
    """Lay the colours of the numbers from 1 on that a label has at the pixels over images."""
    colours = np.array([(0, 0, 0), *map(ImageColor.getrgb, palette)], float)
    for frame, numbers in zip(frames, clip.truth(name)[name].values, strict=True):
        tinted = (1 - OPACITY) * frame + OPACITY * colours[numbers]
        frame[:] = np.where(numbers[..., None] > 0, np.round(tinted), frame)


def _wall(clip: ExportedClip, frames: Pictures) -> None:
    """Draw the border of the wall, half-way between the centres of pixels in and out of it."""
    for frame, mask in zip(frames, clip.truth("mask")["mask"].values, strict=True):
        inside = np.pad(mask.astype(bool), 1)
        with _drawing(frame, BORDER) as draw:
            for axis in (0, 1):
                half = np.array([0.0, 0.0])
                half[axis] = 0.5
                # An edge of a pixel, from corner to corner: (row, column) to (lateral, axial).
                corner = (np.argwhere(np.diff(inside, axis=axis)) - 1)[:, ::-1] + half[::-1]
                for middle in corner:
                    ends = _fine(np.stack([middle - half, middle + half]))
                    draw.line(ends, 255, _DETAIL * _thickness(clip))


def _displacement(clip: ExportedClip, frames: Pictures) -> None:
    """Draw an arrow for each point of a grid that is in the wall at end-diastole."""
    step, radius = max(1, clip.size // ARROWS_ALONG_SIDE), _thickness(clip)
    position = clip.tracks(step)["pixel"].values
    for frame, ends in zip(frames, position, strict=True):
        with _drawing(frame, MOTION) as draw:
            for start, end in zip(position[0], ends, strict=True):
                draw.line(_fine(np.stack([start, end])), 255, _DETAIL * _thickness(clip))
                draw.ellipse(_fine(np.stack([end - radius, end + radius])), 255)


DRAWINGS: dict[str, Callable[[ExportedClip, Pictures], None]] = {
    "segments": partial(_tint, name="segment", palette=SEGMENTS),  # those of AHA next to each other differ
    "tissue": partial(_tint, name="tissue", palette=TISSUES),
    "wall": _wall,
    "displacement": _displacement,
}
"""Name of an overlay to the function that draws it, those below first."""


@contextmanager
def _drawing(frame: Pictures, colour: str) -> Iterator[ImageDraw.ImageDraw]:
    """Draw in one colour on an image, smoothly: 255 is all of it, at the places of :func:`_fine`."""
    mask = Image.new("L", (_DETAIL * frame.shape[1], _DETAIL * frame.shape[0]))
    yield ImageDraw.Draw(mask)
    share = np.asarray(mask.reduce(_DETAIL))[..., None] / 255
    frame[:] = np.round((1 - share) * frame + share * np.array(ImageColor.getrgb(colour)))


def _fine(position: Floats) -> list[tuple[float, float]]:
    """Places in a drawing of positions (point, 2), lateral and axial, px of the image."""
    return [tuple(place) for place in (_DETAIL * (position + 0.5) - 0.5).tolist()]


def _thickness(clip: ExportedClip) -> int:
    """Width of lines, px."""
    return max(1, round(clip.size / 300))
