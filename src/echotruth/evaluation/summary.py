"""Strain of clips as one table: at end-systole, at its peak, its time to peak and its rate, tracked and true."""

from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.cases import Case
from echotruth.config import Config
from echotruth.config.imaging import ALL_VIEWS
from echotruth.evaluation.curves import strain_curves, strain_peaks, twist_of, twist_views
from echotruth.evaluation.no_estimate import reason
from echotruth.evaluation.segment_strain import Row
from echotruth.repository import estimates
from echotruth.repository.choice import Names, Sizes, chosen, image_size
from echotruth.repository.estimates import NotEvaluated
from echotruth.repository.reader import Repository


class Quantity(NamedTuple):
    """A curve of a clip that the table holds.

    Attributes
    ----------
    name : str
        In the column `quantity`.
    curve : str
        As :meth:`.Repository.curves` names it, less `tracked_` or `true_`.
    place : dict
        Its place along the dimensions of that curve.
    planes : tuple of str
        Planes that show it.
    """

    name: str
    curve: str
    place: dict[str, str | int]
    planes: tuple[str, ...]


_RADIAL: dict[str, str | int] = {"measure": "engineering", "region": 0, "wall_component": "RR"}
QUANTITIES = (
    Quantity("gls", "line_strain", {"contour": "middle"}, ("long_axis",)),
    Quantity("gls_endocardial", "line_strain", {"contour": "endocardial"}, ("long_axis",)),
    Quantity("gcs", "line_strain", {"contour": "middle"}, ("short_axis",)),
    Quantity("gcs_endocardial", "line_strain", {"contour": "endocardial"}, ("short_axis",)),
    Quantity("radial", "region_strain", _RADIAL, ("short_axis", "long_axis")),
    Quantity("rotation", "rotation", {}, ("short_axis",)),
)
"""Quantities of one view."""

MEAN_OF = {"gls": "long_axis", "gls_endocardial": "long_axis"} | dict.fromkeys(
    ("gcs", "gcs_endocardial", "radial"), "short_axis"
)
"""Quantities whose mean over the views of one kind of plane is that of the heart."""

ANGLES = ("rotation", "twist")
"""Quantities that are angles."""

WHAT = ("tracked", "true")


def strain_summary(
    repository: Repository, cases: Names = None, views: Names = None, sizes: Sizes = None, trackers: Names = None
) -> pd.DataFrame:
    """Read GLS, GCS, radial strain, rotation and twist of clips into a table; see :meth:`.Repository.summary`."""
    chosen_sizes = [image_size(repository.config, size) for size in sizes or repository.sizes[:1]]
    chosen_trackers = chosen("tracker", trackers, repository.trackers)
    clips = repository.finished(cases, views, "points")
    rows = [row for clip in clips for row in _rows(repository, *clip, chosen_sizes, chosen_trackers)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


COLUMNS = (
    *("case", "view", "size_px", "tracker", "quantity", "unit"),
    *("tracked_es", "true_es", "tracked_peak", "true_peak", "tracked_time_to_peak_ms", "true_time_to_peak_ms"),
    *("tracked_systolic_rate", "true_systolic_rate", "rate_unit", "no_estimate"),
)
"""Columns of the table; `no_estimate` says why the tracker has no value at end-systole, and is empty if it has one."""


def _rows(repository: Repository, case: Case, views: list[str], sizes: list[int], trackers: list[str]) -> Iterator[Row]:
    """Rows of one heart: of each view, and of the heart as a whole."""
    config, ends = case.config, twist_views(case.config)
    for size in sizes:
        for tracker in trackers:
            curves = {}
            for view in views:
                with suppress(NotEvaluated):
                    curves[view] = strain_curves(repository, case.id, view, tracker, size)
            keys: Row = {"case": case.id, "size_px": size, "tracker": tracker}
            rows: list[Row] = []
            for view, of_view in curves.items():
                peaks = strain_peaks(of_view)
                shown = [quantity for quantity in QUANTITIES if config.views[view].plane in quantity.planes]
                failure = estimates.failures(repository, case.id, view).get((tracker, size), "")
                for one in shown:
                    row = keys | {"view": view} | _row(one.name, one.curve, one.place, peaks)
                    rows.append(row | {"no_estimate": _why_none(row, config, failure)})
            yield from rows
            yield from _means(rows, config, keys)
            if ends is not None and set(ends) <= set(curves):
                twist = strain_peaks(twist_of(curves[ends[0]], curves[ends[1]]))
                row = keys | {"view": ALL_VIEWS} | _row("twist", "twist", {}, twist)
                rotations = [one for one in rows if one["quantity"] == "rotation" and one["view"] in ends]
                yield row | {"no_estimate": _first_reason(rotations)}


def _why_none(row: Row, config: Config, failure: str) -> str:
    """Why a row has no tracked value at end-systole."""
    tracked, true = (np.array(row[f"{what}_es"], float) for what in WHAT)
    return reason(tracked, true, config, failure, is_strain=row["quantity"] not in ANGLES)


def _row(name: str, curve: str, place: dict[str, str | int], peaks: xr.Dataset) -> Row:
    """Columns of one quantity: strain in %, angles in degrees, rates in 1/s or degrees a second."""
    angle = name in ANGLES
    factor, rate_factor = (np.degrees(1), np.degrees(1)) if angle else (100.0, 1.0)
    factors = {"es": factor, "peak": factor, "time_to_peak": 1e3, "systolic_rate": rate_factor}
    row: Row = {"quantity": name, "unit": "degree" if angle else "percent"}
    for what in WHAT:
        for kind, scale in factors.items():
            value = peaks[f"{what}_{curve}_{kind}"]
            at = {dim: label for dim, label in place.items() if dim in value.dims}
            row[f"{what}_{kind}{'_ms' if kind == 'time_to_peak' else ''}"] = float(scale * value.sel(at))
    return row | {"rate_unit": "degree s-1" if angle else "s-1"}


def _means(rows: list[Row], config: Config, keys: Row) -> Iterator[Row]:
    """Rows of the heart: means over its views, NaN where one of them is; none if a view of the kind is left out."""
    for name, plane in MEAN_OF.items():
        wanted = sum(view.plane == plane for view in config.views.values())
        of_plane = [row for row in rows if row["quantity"] == name and config.views[str(row["view"])].plane == plane]
        if of_plane and len(of_plane) == wanted:
            means: Row = {
                column: float(np.mean([float(row[column]) for row in of_plane]))
                for column in COLUMNS
                if column.startswith(("tracked_", "true_"))
            }
            yield of_plane[0] | keys | {"view": ALL_VIEWS} | means | {"no_estimate": _first_reason(of_plane)}


def _first_reason(rows: list[Row]) -> str:
    """Why what is made from some rows has no estimate."""
    return next((str(row["no_estimate"]) for row in rows if row["no_estimate"]), "")
