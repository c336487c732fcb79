"""The points at which trackers follow a clip of a repository: their motion, tracked and true."""

from collections.abc import Callable, Iterable

import numpy as np
import xarray as xr

from echotruth.config import Config
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.repository import estimates
from echotruth.repository.choice import chosen
from echotruth.repository.datasets import dataset
from echotruth.repository.estimates import NotEvaluated
from echotruth.repository.reader import Repository
from echotruth.tracking.point_grid import grid_positions
from echotruth.units import mm

_STRAIN, _ABOUT = ("frame", "axial", "lateral", "wall_component"), {"units": "1"}


def tracks(
    repository: Repository, case: str, view: str, size: int, trackers: Iterable[str] | None = None
) -> xr.Dataset:
    """Read what trackers found at the points of a clip; see :meth:`.Repository.tracks`."""
    found = repository.case(case)
    grid, known = grid_positions(found.config), chosen("tracker", trackers, repository.trackers)
    points = {"lateral": grid[0, :, 0], "axial": grid[:, 0, 1]}
    values = {}
    for name in known:
        try:
            values[name] = estimates.tracked(repository, case, view, name, size, "displacement", "quality")
        except NotEvaluated:
            if trackers is not None:
                raise
    true = estimates.true(repository, case, view, "true_displacement", "true_strain", "wall_axes", "layer", "segment")
    strain, tracked = _strain(true.pop("wall_axes"), grid, found.config), {}
    for name, arrays in values.items():
        tracked[name] = dataset(found, {"tracking/TRACKER": arrays}, points)
        tracked[name]["strain"] = (_STRAIN, strain(arrays["displacement"]), _ABOUT)
    together = xr.concat(list(tracked.values()), xr.Variable("tracker", list(tracked)), combine_attrs="override")
    truth = dataset(found, {"points": true}, points)
    return together.assign(truth.data_vars).assign_attrs(case=case, view=view, size_px=size)


def _strain(axes: np.ndarray, grid: np.ndarray, config: Config) -> Callable[[np.ndarray], np.ndarray]:
    """Function from a displacement on the grid to its strain, (frame, axial, lateral, 3), at the points with axes."""
    inside = np.isfinite(axes).all((-2, -1))
    radius = RADIUS * (config.bmode.field_of_view_mm * mm)
    operator = StrainOperator(grid[inside], axes[inside].astype(float), radius)

    def strain(displacement: np.ndarray) -> np.ndarray:
        found = np.full((*displacement.shape[:3], 3), np.nan)
        found[:, inside] = operator.strain(displacement[:, inside])
        return found

    return strain
