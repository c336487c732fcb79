"""The points at which trackers follow a clip, read from a repository: their motion, tracked and true."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echotruth.config import Config
from echotruth.evaluation import kept
from echotruth.evaluation.choice import image_size, job_of
from echotruth.evaluation.clip import grid_positions
from echotruth.evaluation.scoring import truth_at
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.imaging.view import Plane
from echotruth.notebook.datasets import as_stored, dataset

if TYPE_CHECKING:
    import xarray as xr


def load_points(
    repository: str | Path,
    case: str = "heart",
    view: str = "mid",
    tracker: str = "bspline_dic",
    size: int | None = None,
) -> xr.Dataset:
    """Read what a tracker found at the points of a clip, beside their true motion.

    Parameters
    ----------
    repository : str or Path
    case : str
        Case id, as in `cases.csv`.
    view : str
    tracker : str
        Name of a tracker of the repository, or of one that `echotruth evaluate --keep` stored.
    size : int, optional
        Pixels along a side of the clip. Default: the largest.

    Returns
    -------
    Dataset
        displacement (frame, axial, lateral, plane), m, quality (frame, axial, lateral) and strain (frame, axial,
        lateral, wall_component) of the tracker, the strain by the operator of docs/conventions.md; true_displacement
        (frame, axial, lateral, vector), m; true_strain (reference, frame, axial, lateral, wall_component); and
        layer and segment (axial, lateral) of the point, 0 outside the wall. Motion is from end-diastole.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view, tracker or size.

    Examples
    --------
    >>> import echotruth as et
    >>> points = et.load_points("out/demo", "heart", "mid", tracker="dis", size=128)
    >>> error = points["displacement"] - points["true_displacement"].sel(vector=["lateral", "axial"]).values
    >>> error.dims
    ('frame', 'axial', 'lateral', 'plane')
    """
    job = job_of(repository, case, view)
    config = job.case.config
    size = image_size(config, size)
    tracked = kept.read(job, "tracking", "displacement", "quality", tracker=tracker, size=size)
    true = job.read("evaluation", "true_displacement", "true_strain")
    grid = grid_positions(config)
    points = {"lateral": grid[0, :, 0], "axial": grid[:, 0, 1]}
    found = dataset(job.case, as_stored(job.case, {"tracking": tracked, "evaluation": true}), points)
    axes = job.read("evaluation", "wall_axes")["wall_axes"]
    strain = _strain(tracked["displacement"], axes, config)
    at_ed = replace(job.heart, displacement=job.heart.displacement[:1], es=0)
    truth = truth_at(at_ed, Plane(**job.read("phantom", "origin", "axes")), job.view.plane, grid, config)
    layer, segment = (truth.on_grid(values, 0) for values in (truth.wall.layer, truth.wall.segment))
    about = {"units": "1"}
    found = found.assign(
        strain=(["frame", "axial", "lateral", "wall_component"], strain, about),
        layer=(["axial", "lateral"], layer, about),
        segment=(["axial", "lateral"], segment, about),
    )
    return found.assign_attrs(case=case, view=view, tracker=tracker, size_px=size)


def _strain(displacement: np.ndarray, axes: np.ndarray, config: Config) -> np.ndarray:
    """Strain (frame, axial, lateral, 3) of a displacement, by the operator at the points that have axes."""
    inside = np.isfinite(axes).all((-2, -1))
    radius = RADIUS * config.bmode.si().field_of_view
    operator = StrainOperator(grid_positions(config)[inside], axes[inside].astype(float), radius)
    strain = np.full((*displacement.shape[:3], 3), np.nan)
    strain[:, inside] = operator.strain(displacement[:, inside])
    return strain
