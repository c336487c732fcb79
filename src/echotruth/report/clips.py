"""All views of one heart for the player of the page."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.report import style
from echotruth.report.cine import STEPS_PER_PIXEL, cine
from echotruth.report.clip import ClipWithMotion, thin
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


def clips(comparison: Comparison) -> dict[str, Any]:
    """Clips of one heart with their truth, at the largest image size.

    Parameters
    ----------
    comparison : Comparison
        Of the heart.

    Returns
    -------
    dict
        View -> what :func:`echotruth.report.cine.cine` gives, frame of end-systole and strain over the cycle.
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
    time = repository.read(f"{group}/time", *repository.place(case))
    motion = estimates.true(repository, case, view, "true_displacement")["true_displacement"][..., :2]
    inside = np.isfinite(motion[0]).all(-1)
    spacing = config.bmode.si().field_of_view / size
    position = grid_points(config, size)[inside]
    return ClipWithMotion(image, spacing, time, position, motion[:, inside].astype(float)), inside


def _clip(comparison: Comparison, view: str, count: int) -> dict[str, Any]:
    repository, case, size = comparison.repository, comparison.case.id, comparison.size
    best = comparison.trackers[0]
    clip, inside = with_motion(repository, case, view, size)
    chosen = thin(clip.position, ARROW_SPACING * size)
    found = estimates.tracked(repository, case, view, best, size, "displacement")["displacement"]
    tracked = clip.position + np.asarray(found, float)[:, inside] / clip.spacing  # (frame, point, 2), px
    shown = cine(clip, _strain(repository, case, view, inside), chosen, tracked[:, chosen], count)
    curves = comparison.curves[view][best]
    further = {"es": curves.attrs["es_frame"], "steps": STEPS_PER_PIXEL, "strain_limit": STRAIN_LIMIT}
    return shown | further | {"course": _course(curves)}


def _strain(repository: Repository, case: str, view: str, inside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """True engineering strain along the wall, in the plane, (frame, point): sqrt(1 + 2 E) - 1."""
    strain = estimates.true(repository, case, view, "true_strain")["true_strain"]
    along = strain[LABELS["reference"].index("plane"), ..., LABELS["wall_component"].index("TT")]
    return np.sqrt(np.maximum(1 + 2 * along[:, inside].astype(float), 0)) - 1


def _course(curves: xr.Dataset) -> dict[str, Any]:
    """Strain of the mid-wall contour over the cycle, %, true and tracked; None where there is none."""
    lists = {
        name: [round(100 * float(value), 3) if np.isfinite(value) else None for value in values]
        for name in ("true", "tracked")
        for values in [curves[f"{name}_line_strain"].sel(contour="middle").values]
    }
    return {"title": f"{style.title(curves.attrs['view'])}: {LINE[curves.attrs['plane']]}"} | lists
