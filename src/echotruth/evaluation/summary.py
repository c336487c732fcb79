"""Strain of clips as one table: at end-systole, at its peak, its time to peak and its rate, tracked and true."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.config import Config
from echotruth.config.imaging import ALL_VIEWS
from echotruth.evaluation.agreement import REFERENCES
from echotruth.evaluation.courses import peak, rate, systolic_rate
from echotruth.evaluation.curves import REFERENCE, twist_views
from echotruth.evaluation.segment_strain import Row
from echotruth.loop.cycle import read_loop
from echotruth.repository import estimates
from echotruth.repository.choice import chosen, image_size
from echotruth.repository.schema import LABELS

if TYPE_CHECKING:
    import pandas as pd

    from echotruth.repository.reader import Repository


class Quantity(NamedTuple):
    """A curve of a clip that the table holds.

    Attributes
    ----------
    name : str
        In the column `quantity`.
    curve : str
        Array of the group evaluation, less `tracked_` or `true_`.
    place : tuple of int
        Its place along the dimensions of that array after frame.
    planes : tuple of str
        Planes that show it.
    """

    name: str
    curve: str
    place: tuple[int, ...]
    planes: tuple[str, ...]


_ENGINEERING, _WHOLE_WALL, _RR = LABELS["measure"].index("engineering"), 0, LABELS["wall_component"].index("RR")
_MIDDLE, _ENDOCARDIAL = (LABELS["contour"].index(name) for name in ("middle", "endocardial"))
QUANTITIES = (
    Quantity("gls", "line_strain", (_MIDDLE,), ("long_axis",)),
    Quantity("gls_endocardial", "line_strain", (_ENDOCARDIAL,), ("long_axis",)),
    Quantity("gcs", "line_strain", (_MIDDLE,), ("short_axis",)),
    Quantity("gcs_endocardial", "line_strain", (_ENDOCARDIAL,), ("short_axis",)),
    Quantity("radial", "region_strain", (_ENGINEERING, _WHOLE_WALL, _RR), ("short_axis", "long_axis")),
    Quantity("rotation", "rotation", (), ("short_axis",)),
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
    repository: Repository,
    cases: Iterable[str] | None = None,
    views: Iterable[str] | None = None,
    sizes: Iterable[int] | None = None,
    trackers: Iterable[str] | None = None,
) -> pd.DataFrame:
    """Read GLS, GCS, radial strain, rotation and twist of clips into a table; see :meth:`.Repository.summary`."""
    import pandas as pd

    chosen_sizes = [image_size(repository.config, size) for size in sizes or repository.sizes[:1]]
    chosen_trackers = chosen("tracker", trackers, repository.trackers)
    clips = repository.finished(cases, views, "evaluation")
    rows = [row for clip in clips for row in _rows(repository, *clip, chosen_sizes, chosen_trackers)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


COLUMNS = (
    *("case", "view", "size_px", "tracker", "quantity", "unit"),
    *("tracked_es", "true_es", "tracked_peak", "true_peak", "tracked_time_to_peak_ms", "true_time_to_peak_ms"),
    *("tracked_systolic_rate", "true_systolic_rate", "rate_unit"),
)
"""Columns of the table."""


def _rows(repository: Repository, case: Case, views: list[str], sizes: list[int], trackers: list[str]) -> Iterator[Row]:
    """Rows of one heart: of each view, and of the heart as a whole."""
    if not views:
        return
    config, es = case.config, int(repository.arrays("mechanics", case.id, None, "es_frame")["es_frame"])
    read = partial(_row, time=read_loop(config.loop).time, es=es)
    every = {view: _curves(repository, case.id, view, sizes, trackers) for view in views}
    ends = twist_views(config)
    for size in sizes:
        for tracker in trackers:
            curves = {view: of_view[size, tracker] for view, of_view in every.items() if (size, tracker) in of_view}
            keys: Row = {"case": case.id, "size_px": size, "tracker": tracker}
            rows: list[Row] = []
            for view, of_view in curves.items():
                shown = [quantity for quantity in QUANTITIES if config.views[view].plane in quantity.planes]
                for name, curve, place, _ in shown:
                    pair = (np.moveaxis(of_view[f"{what}_{curve}"], 0, -1)[place] for what in WHAT)
                    rows.append(keys | {"view": view} | read(name, *pair))
            yield from rows
            yield from _means(rows, config, keys)
            if ends is not None and set(ends) <= set(curves):
                base, apex = (curves[view] for view in ends)
                pair = (apex[f"{what}_rotation"] - base[f"{what}_rotation"] for what in WHAT)
                yield keys | {"view": ALL_VIEWS} | read("twist", *pair)


def _curves(
    repository: Repository, case: str, view: str, sizes: list[int], trackers: list[str]
) -> dict[tuple[int, str], dict[str, Floats]]:
    """Curves of one view, tracked and true, by size and tracker; without those that were not evaluated on it."""
    names = list(dict.fromkeys(quantity.curve for quantity in QUANTITIES))
    true = estimates.true(repository, case, view, *(f"true_{name}" for name in names))
    true["true_region_strain"] = true["true_region_strain"][REFERENCES.index(REFERENCE)]
    read = estimates.each(repository, case, view, sizes, trackers, *(f"tracked_{name}" for name in names))
    return {
        (size, tracker): {name: np.asarray(values, float) for name, values in (true | tracked).items()}
        for size, tracker, tracked in read
    }


def _row(name: str, tracked: Floats, true: Floats, time: Floats, es: int) -> Row:
    """Columns of one quantity: strain in %, angles in degrees, rates in 1/s or degrees a second."""
    angle = name in ANGLES
    factor, rate_factor = (np.degrees(1), np.degrees(1)) if angle else (100.0, 1.0)
    row: Row = {"quantity": name, "unit": "degree" if angle else "percent"}
    for what, curve in zip(WHAT, (tracked, true), strict=True):
        value, when = peak(curve, time)
        row |= {f"{what}_es": float(factor * curve[es]), f"{what}_peak": float(factor * value)}
        row[f"{what}_time_to_peak_ms"] = float(1e3 * when)
        row[f"{what}_systolic_rate"] = float(rate_factor * systolic_rate(rate(curve, time)[: es + 1], curve[es]))
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
            yield of_plane[0] | keys | {"view": ALL_VIEWS} | means
