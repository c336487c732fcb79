"""All views of one heart for the player of the page: frames in one picture, and points that move with the tissue."""

from base64 import b64encode
from io import BytesIO
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from numpy.typing import NDArray
from PIL import Image

from echotruth.report import style
from echotruth.report.clip import ClipWithMotion, crop, round_length, thin
from echotruth.report.comparison import Comparison, strain_of_line
from echotruth.repository import estimates
from echotruth.repository.reader import Repository
from echotruth.repository.schema import LABELS
from echotruth.tracking.point_grid import grid_points
from echotruth.units import mm

ARROW_SPACING = 0.0375
"""Smallest distance of points whose motion is drawn, over the side of the image: 0.45 mm for a mouse."""

MAX_VIEWS = 12
"""Largest number of views that can be chosen."""

QUALITY = 78
"""Of the JPEG."""

STEPS_PER_PIXEL = 16
"""Steps in which positions are given, per pixel of the picture."""

MAX_SIDE = 360
"""Largest side of a frame, px."""

MAX_PIXELS = 24_000_000
"""Largest number of pixels of all frames of all clips of a page."""

SHADES = 61
"""Steps of the scale of strain, an odd number, so that one of them is zero."""

COLUMNS = 8
"""Frames in a row of the picture."""


def clips(comparison: Comparison) -> dict[str, Any]:
    """Clips of one heart with their truth, at the largest image size.

    Parameters
    ----------
    comparison : Comparison
        Of the heart.

    Returns
    -------
    dict
        View -> numbers, texts and lists, which JSON can hold; arrays are base64 of little-endian integers: 16 bit for
        positions, in steps of 1 / `STEPS_PER_PIXEL` of a pixel of the picture (-32768 where there is none).
    """
    views = list(comparison.views)[:MAX_VIEWS]
    return {view: _clip(comparison, view, len(views)) for view in views}


def with_motion(repository: Repository, case: str, view: str, size: int) -> tuple[ClipWithMotion, NDArray[np.bool_]]:
    """A clip and the true motion of all points of its wall, and which points of the grid these are.

    Parameters
    ----------
    repository : Repository
    case, view : str
    size : int
        px.

    Returns
    -------
    clip : ClipWithMotion
    inside : ndarray of shape (grid rows, grid columns), bool
    """
    config, group = repository.case(case).config, f"bmode/{size}"
    image = repository.arrays(group, case, view, "image")["image"]
    time = repository.read(f"{group}/time", case, view)
    motion = estimates.true(repository, case, view, "true_displacement")["true_displacement"][..., :2]
    inside = np.isfinite(motion[0]).all(-1)
    spacing = config.bmode.field_of_view_mm * mm / size
    position = grid_points(config, size)[inside]
    return ClipWithMotion(image, spacing, time, position, motion[:, inside].astype(float)), inside


def _clip(comparison: Comparison, view: str, count: int) -> dict[str, Any]:
    """One clip of several for the player, with the strain over the cycle of the best tracker."""
    repository, size, best = comparison.repository, comparison.size, comparison.trackers[0]
    case = comparison.case.id
    clip, inside = with_motion(repository, case, view, size)
    found = estimates.tracked(repository, case, view, best, size, "displacement")["displacement"][:, inside].astype(
        float
    )
    chosen, curves = thin(clip.position, ARROW_SPACING * size), comparison.curves[view][best]
    name = style.ALONG[curves.attrs["plane"]]
    quantity, component = style.QUANTITIES[name], LABELS["strain_component"].index(name)
    strain = repository.read(f"truth/{size}/strain", case, view, ..., component)
    shown, corner, factor = _sheets(clip, strain, count)
    pixel = clip.spacing / factor  # m, of the picture
    bar = round_length(max(shown["width"], shown["height"]) * pixel)

    def placed(path: NDArray[np.float64]) -> str:
        return _integers((path - corner) * factor * STEPS_PER_PIXEL, np.int16)

    return shown | {
        "time_ms": [round(1e3 * float(time), 3) for time in clip.time],
        "es": curves.attrs["es_frame"],
        "points": clip.path.shape[1],
        "steps": STEPS_PER_PIXEL,
        "path": placed(clip.path),
        "strain_name": f"true {quantity.words.lower()} {quantity.symbol} ({quantity.unit})",
        "chosen": chosen.tolist(),
        "tracked": placed((clip.position + found / clip.spacing)[:, chosen]),
        "bar_px": round(bar / pixel, 2),
        "bar": f"{1e3 * bar:g} mm",
        "course": _course(curves),
    }


def _sheets(
    clip: ClipWithMotion, strain: NDArray[np.float32], count: int
) -> tuple[dict[str, Any], NDArray[np.float64], float]:
    """All frames about the wall in one picture, row by row, and the colours of their strain in another.

    Parameters
    ----------
    clip : ClipWithMotion
    strain : ndarray of shape (frame, axial, lateral)
        NaN outside the wall.
    count : int
        Number of clips on the page, which share its size.

    Returns
    -------
    shown : dict
        The pictures, size and number of their frames.
    corner : ndarray of shape (2,)
        Upper left corner of a frame of it: lateral, axial, px of the clip.
    factor : float
        Pixels of the picture in one of the clip.
    """
    left, right, lower, upper = crop(clip)
    column, row, extent = int(np.floor(left)), int(np.floor(upper)), int(np.ceil(max(right - left, lower - upper)))
    tissue = clip.image[:, row : row + extent + 1, column : column + extent + 1]
    colour = entries(strain[:, row : row + extent + 1, column : column + extent + 1])
    largest = max(tissue.shape[1:])
    factor = min(MAX_SIDE, int((MAX_PIXELS / (count * len(tissue))) ** 0.5), largest) / largest
    size = tuple(round(side * factor) for side in tissue.shape[:0:-1])
    return sheets(tissue, colour, size), np.array([column, row]) - 0.5, factor


def sheets(image: NDArray[np.uint8], colour: NDArray[np.uint8], size: tuple[int, ...]) -> dict[str, Any]:
    """All frames (frame, axial, lateral) in one picture, row by row, the :func:`entries` of their strain in another.

    With them are the size of a frame in the pictures, width and height in px, and the number of frames.
    """
    return {
        "sheet": address(_pasted(image, size, Image.Resampling.LANCZOS), "jpeg", quality=QUALITY, optimize=True),
        "colours": address(coloured(_pasted(colour, size, Image.Resampling.NEAREST)), "png", optimize=True),
        **{"width": size[0], "height": size[1], "columns": COLUMNS, "frames": len(image)},
    }


def _pasted(frames: NDArray[np.uint8], size: tuple[int, ...], filter_: Image.Resampling) -> Image.Image:
    """Frames of a size, row by row in one picture."""
    width, height = size
    sheet = Image.new("L", (width * min(COLUMNS, len(frames)), height * -(-len(frames) // COLUMNS)))
    for number, frame in enumerate(frames):
        picture = Image.fromarray(frame).resize((width, height), filter_)
        sheet.paste(picture, (number % COLUMNS * width, number // COLUMNS * height))
    return sheet


def entries(strain: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Steps of the scale of strain, from 1; 0 where there is none."""
    place = (style.FACTORS["%"] * strain / style.STRAIN_LIMIT + 1) / 2 * (SHADES - 1)
    return np.where(np.isfinite(place), 1 + np.rint(np.clip(np.nan_to_num(place), 0, SHADES - 1)), 0).astype(np.uint8)


def coloured(entries: Image.Image) -> Image.Image:
    """A picture of :func:`entries` in the colours of strain, transparent where there is none."""
    table = np.vstack([np.zeros(3), colormaps[style.SIGNED](np.linspace(0, 1, SHADES))[:, :3]])
    picture = entries.copy()
    picture.putpalette(np.rint(255 * table).astype(np.uint8).tobytes())
    picture.info["transparency"] = 0
    return picture


def _course(curves: xr.Dataset) -> dict[str, Any]:
    """Strain of the mid-wall contour over the cycle, %, true and tracked; None where there is none."""
    lists = {
        name: [round(100 * float(value), 3) if np.isfinite(value) else None for value in values]
        for name in ("true", "tracked")
        for values in [curves[f"{name}_line_strain"].sel(contour="middle").values]
    }
    return {"title": f"{style.title(curves.attrs['view'])}: {strain_of_line(curves.attrs['plane'])}"} | lists


def address(picture: Image.Image, kind: str, **settings: Any) -> str:
    """A picture as JPEG or PNG, as an address that holds its data."""
    file = BytesIO()
    picture.save(file, kind, **settings)
    return f"data:image/{kind};base64," + b64encode(file.getvalue()).decode()


def _integers(values: NDArray[np.float64], kind: type[np.signedinteger[Any]]) -> str:
    """Numbers rounded to integers, as base64; the lowest integer where there is none."""
    limits = np.iinfo(kind)
    rounded = np.clip(np.rint(np.nan_to_num(values)), limits.min + 1, limits.max)
    integers = np.where(np.isfinite(values), rounded, limits.min).astype(np.dtype(kind).newbyteorder("<"))
    return b64encode(integers.tobytes()).decode()
