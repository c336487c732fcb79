"""All views of one heart for the player of the page."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.evaluation import kept
from echotruth.report import style
from echotruth.report.cine import STEPS_PER_PIXEL, cine
from echotruth.report.clip import ClipWithMotion, thin
from echotruth.report.comparison import LINE, Comparison
from echotruth.workflow.job import Job

STRAIN_LIMIT = 30
"""Largest strain on the scale of colours, to either side, %."""

ARROW_SPACING = 0.0375
"""Smallest distance of points whose motion is drawn, over the side of the image: 0.45 mm for a mouse."""

MAX_VIEWS = 12
"""Largest number of views that can be chosen."""


def clips(tree: xr.DataTree, comparison: Comparison) -> dict[str, Any]:
    """Clips of one heart with their truth, at the largest image size.

    Parameters
    ----------
    tree : DataTree
        The repository.
    comparison : Comparison
        Of the heart.

    Returns
    -------
    dict
        View -> what :func:`echotruth.report.cine.cine` gives, frame of end-systole and strain over the cycle.
    """
    views = list(comparison.views)[:MAX_VIEWS]
    return {view: _clip(tree, comparison, view, len(views)) for view in views}


def with_motion(tree: xr.DataTree, case: str, view: str, size: int) -> tuple[ClipWithMotion, NDArray[np.bool_]]:
    """A clip and the true motion of all points of its wall, and which points of the grid these are.

    Parameters
    ----------
    tree : DataTree
        The repository.
    case, view : str
    size : int
        px.

    Returns
    -------
    clip : ClipWithMotion
    inside : ndarray of shape (grid rows, grid columns), bool
    """
    images = tree[f"bmode/{size}"].to_dataset().sel(case=case, view=view)
    truth = tree["evaluation"].to_dataset().true_displacement.sel(case=case, view=view, vector=["lateral", "axial"])
    motion = truth.transpose("frame", "axial", "lateral", "vector").values
    inside = np.isfinite(motion[0]).all(-1)
    spacing = float(images.lateral[1] - images.lateral[0])
    place = np.stack(np.meshgrid(truth.lateral.values, truth.axial.values), -1)[inside]
    corner = float(images.lateral[0]), float(images.axial[0])
    found = ClipWithMotion(
        images.image.values, spacing, images.time.values, (place - corner) / spacing, motion[:, inside].astype(float)
    )
    return found, inside


def _clip(tree: xr.DataTree, comparison: Comparison, view: str, count: int) -> dict[str, Any]:
    job, size = comparison.job(view), comparison.size
    case, best = job.case.id, comparison.trackers[0]
    clip, inside = with_motion(tree, case, view, size)
    chosen = thin(clip.position, ARROW_SPACING * size)
    tracked = _tracked(job, best, size, inside, clip)[:, chosen]
    shown = cine(clip, _strain(tree, case, view, inside), chosen, tracked, count)
    es = int(tree["mechanics"].to_dataset().es_frame.sel(case=case))
    further = {"es": es, "steps": STEPS_PER_PIXEL, "strain_limit": STRAIN_LIMIT}
    return shown | further | {"course": _course(comparison.curves[view][best])}


def _tracked(job: Job, tracker: str, size: int, inside: NDArray[np.bool_], clip: ClipWithMotion) -> NDArray[np.float64]:
    """Where a tracker finds the points of the wall, (frame, point, 2), px."""
    found = kept.read(job, "tracking", "displacement", tracker=tracker, size=size)["displacement"]
    return clip.position + np.asarray(found, float)[:, inside] / clip.spacing


def _strain(tree: xr.DataTree, case: str, view: str, inside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """True engineering strain along the wall, in the plane, (frame, point): sqrt(1 + 2 E) - 1."""
    strain = (
        tree["evaluation"].to_dataset().true_strain.sel(case=case, view=view, reference="plane", wall_component="TT")
    )
    values = strain.transpose("frame", "axial", "lateral").values[:, inside]
    return np.sqrt(np.maximum(1 + 2 * values.astype(float), 0)) - 1


def _course(curves: xr.Dataset) -> dict[str, Any]:
    """Strain of the mid-wall contour over the cycle, %, true and tracked; None where there is none."""
    lists = {
        name: [round(100 * float(value), 3) if np.isfinite(value) else None for value in values]
        for name in ("true", "tracked")
        for values in [curves[f"{name}_line_strain"].sel(contour="middle").values]
    }
    return {"title": f"{style.title(curves.attrs['view'])}: {LINE[curves.attrs['plane']]}"} | lists
