"""Clips as the page of the report plays them: frames in one picture, and points that move with the tissue."""

from __future__ import annotations

from base64 import b64encode
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from echotruth.report.clip import ClipWithMotion, crop, round_length

QUALITY = 78
"""Of the JPEG."""

STEPS_PER_PIXEL = 16
"""Steps in which positions are given, per pixel of the picture."""

MAX_SIDE = 360
"""Largest side of a frame, px."""

MAX_PIXELS = 24_000_000
"""Largest number of pixels of all frames of all clips of a page."""

COLUMNS = 8
"""Frames in a row of the picture."""


def cine(
    clip: ClipWithMotion,
    strain: NDArray[np.float64],
    chosen: NDArray[np.int_],
    tracked: NDArray[np.float64],
    clips: int,
) -> dict[str, Any]:
    """One clip for the player of the page.

    Parameters
    ----------
    clip : ClipWithMotion
        It determines the part of the image that is shown.
    strain : ndarray of shape (frame, point)
        True strain of the tissue at its points.
    chosen : ndarray of int
        The points whose motion is drawn.
    tracked : ndarray of shape (frame, chosen point, 2)
        Where a tracker finds the chosen points: lateral, axial, px of the clip; NaN where it lost them.
    clips : int
        Number of clips on the page, which share its size.

    Returns
    -------
    dict
        Numbers, texts and lists, which JSON can hold; arrays are base64 of little-endian integers:
        16 bit for positions, in steps of 1 / `STEPS_PER_PIXEL` of a pixel of the picture (-32768 where
        there is none), 8 bit for strains, in percent.
    """
    left, right, lower, upper = crop(clip)
    first_column, first_row = int(np.floor(left)), int(np.floor(upper))
    extent = int(np.ceil(max(right - left, lower - upper)))
    tissue = clip.image[:, first_row : first_row + extent + 1, first_column : first_column + extent + 1]
    count, height, width = tissue.shape
    side = min(MAX_SIDE, int((MAX_PIXELS / (clips * count)) ** 0.5), max(height, width))
    factor = side / max(height, width)
    corner = np.array([first_column, first_row]) - 0.5

    def placed(path: NDArray[np.float64]) -> str:
        return _integers((path - corner) * factor * STEPS_PER_PIXEL, np.int16)

    size = round(width * factor), round(height * factor)
    pixel = clip.spacing / factor
    bar = round_length(side * pixel)
    return {
        "sheet": jpeg_address(_sheet(tissue, size)),
        "width": size[0],
        "height": size[1],
        "columns": COLUMNS,
        "frames": count,
        "time_ms": [round(1e3 * float(time), 3) for time in clip.time],
        "points": clip.path.shape[1],
        "radius": round(0.62 * factor * _spacing(clip.path[0]), 2),
        "path": placed(clip.path),
        "strain": _integers(100 * strain, np.int8),
        "chosen": [int(index) for index in chosen],
        "tracked": placed(tracked),
        "bar_px": round(bar / pixel, 2),
        "bar": f"{1e3 * bar:g} mm",
    }


def _sheet(frames: NDArray[np.uint8], size: tuple[int, int]) -> Image.Image:
    """All frames in one picture, row by row."""
    width, height = size
    rows = -(-len(frames) // COLUMNS)
    sheet = Image.new("L", (width * min(COLUMNS, len(frames)), height * rows))
    for number, frame in enumerate(frames):
        picture = Image.fromarray(frame).resize(size, Image.Resampling.LANCZOS)
        sheet.paste(picture, (number % COLUMNS * width, number // COLUMNS * height))
    return sheet


def jpeg_address(picture: Image.Image) -> str:
    """A grey picture as JPEG, as an address that holds its data."""
    file = BytesIO()
    picture.save(file, "JPEG", quality=QUALITY, optimize=True)
    return "data:image/jpeg;base64," + b64encode(file.getvalue()).decode()


def _integers(values: NDArray[np.float64], kind: type[np.signedinteger[Any]]) -> str:
    """Numbers rounded to integers, as base64; the lowest integer where there is none."""
    limits = np.iinfo(kind)
    rounded = np.clip(np.rint(np.nan_to_num(values)), limits.min + 1, limits.max)
    integers = np.where(np.isfinite(values), rounded, limits.min).astype(np.dtype(kind).newbyteorder("<"))
    return b64encode(integers.tobytes()).decode()


def _spacing(position: NDArray[np.float64]) -> float:
    """Distance of neighbours in a grid of points (point, 2)."""
    steps = np.diff(np.unique(np.round(position[np.isfinite(position).all(-1)][:, 0], 3)))
    return float(steps.min(initial=np.inf)) if steps.size else 1.0
