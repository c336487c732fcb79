"""All views of one heart for the player of the page: frames in one picture, and points that move with the tissue."""

from base64 import b64encode
from io import BytesIO
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from PIL import Image

from echotruth.report import style
from echotruth.report.clip import ClipWithMotion, crop, round_length, thin
from echotruth.report.comparison import LINE, Comparison
from echotruth.repository import estimates
from echotruth.repository.reader import Repository
from echotruth.repository.schema import LABELS
from echotruth.tracking.point_grid import grid_points

STRAIN_LIMIT = 30
"""Largest strain on the scale of colours, to either side, %."""

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
        positions, in steps of 1 / `STEPS_PER_PIXEL` of a pixel of the picture (-32768 where there is none), 8 bit for
        strains, in percent.
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
    spacing = config.bmode.si().field_of_view / size
    position = grid_points(config, size)[inside]
    return ClipWithMotion(image, spacing, time, position, motion[:, inside].astype(float)), inside


def _clip(comparison: Comparison, view: str, count: int) -> dict[str, Any]:
    """One clip of several for the player, with the strain over the cycle of the best tracker."""
    repository, size, best = comparison.repository, comparison.size, comparison.trackers[0]
    place = repository, comparison.case.id, view
    clip, inside = with_motion(*place, size)
    found = estimates.tracked(*place, best, size, "displacement")["displacement"][:, inside].astype(float)
    chosen, curves = thin(clip.position, ARROW_SPACING * size), comparison.curves[view][best]
    shown, corner, factor = _sheet(clip, count)
    pixel = clip.spacing / factor  # m, of the picture
    bar = round_length(max(shown["width"], shown["height"]) * pixel)

    def placed(path: NDArray[np.float64]) -> str:
        return _integers((path - corner) * factor * STEPS_PER_PIXEL, np.int16)

    return shown | {
        "time_ms": [round(1e3 * float(time), 3) for time in clip.time],
        "es": curves.attrs["es_frame"],
        "points": clip.path.shape[1],
        "steps": STEPS_PER_PIXEL,
        "radius": round(0.62 * factor * _spacing(clip.path[0]), 2),
        "path": placed(clip.path),
        "strain": _integers(100 * _strain(*place)[:, inside], np.int8),
        "strain_limit": STRAIN_LIMIT,
        "chosen": chosen.tolist(),
        "tracked": placed((clip.position + found / clip.spacing)[:, chosen]),
        "bar_px": round(bar / pixel, 2),
        "bar": f"{1e3 * bar:g} mm",
        "course": _course(curves),
    }


def _sheet(clip: ClipWithMotion, count: int) -> tuple[dict[str, Any], NDArray[np.float64], float]:
    """All frames about the wall in one picture, row by row.

    Parameters
    ----------
    clip : ClipWithMotion
    count : int
        Number of clips on the page, which share its size.

    Returns
    -------
    shown : dict
        The picture, size and number of its frames.
    corner : ndarray of shape (2,)
        Upper left corner of a frame of it: lateral, axial, px of the clip.
    factor : float
        Pixels of the picture in one of the clip.
    """
    left, right, lower, upper = crop(clip)
    column, row, extent = int(np.floor(left)), int(np.floor(upper)), int(np.ceil(max(right - left, lower - upper)))
    tissue = clip.image[:, row : row + extent + 1, column : column + extent + 1]
    largest = max(tissue.shape[1:])
    factor = min(MAX_SIDE, int((MAX_PIXELS / (count * len(tissue))) ** 0.5), largest) / largest
    width, height = (round(side * factor) for side in tissue.shape[:0:-1])
    sheet = Image.new("L", (width * min(COLUMNS, len(tissue)), height * -(-len(tissue) // COLUMNS)))
    for number, frame in enumerate(tissue):
        picture = Image.fromarray(frame).resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(picture, (number % COLUMNS * width, number // COLUMNS * height))
    size = {"width": width, "height": height, "columns": COLUMNS, "frames": len(tissue)}
    return {"sheet": jpeg_address(sheet)} | size, np.array([column, row]) - 0.5, factor


def _strain(repository: Repository, case: str, view: str) -> NDArray[np.float64]:
    """True engineering strain along the wall, in the plane, (frame, rows, columns): sqrt(1 + 2 E) - 1."""
    strain = estimates.true(repository, case, view, "true_strain")["true_strain"]
    along = strain[LABELS["reference"].index("plane"), ..., LABELS["wall_component"].index("TT")]
    return np.sqrt(np.maximum(1 + 2 * along.astype(float), 0)) - 1


def _course(curves: xr.Dataset) -> dict[str, Any]:
    """Strain of the mid-wall contour over the cycle, %, true and tracked; None where there is none."""
    lists = {
        name: [round(100 * float(value), 3) if np.isfinite(value) else None for value in values]
        for name in ("true", "tracked")
        for values in [curves[f"{name}_line_strain"].sel(contour="middle").values]
    }
    return {"title": f"{style.title(curves.attrs['view'])}: {LINE[curves.attrs['plane']]}"} | lists


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
