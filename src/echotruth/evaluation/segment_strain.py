"""Strain of the AHA segments of a clip: at end-systole, at its peak, with its time, and its rate, tracked and true."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.evaluation import statistics
from echotruth.evaluation.courses import peak, rate, systolic_rate
from echotruth.evaluation.displacement_error import SEGMENTS
from echotruth.mechanics.pathology import INFARCT

COMPONENTS = {"short_axis": ("radial", "circumferential"), "long_axis": ("radial", "longitudinal")}
"""Plane to the first two components of strain along the axes of the wall in it."""

RADIAL = "radial"

CONTRACTION = (1, -1)
"""Signs of radial and tangential strain in a contraction. The largest thickening and the largest shortening, unlike the
value of largest magnitude, stay the same feature of the curve where an infarct, or a segment that is activated late, is
first stretched by the others as much as it shortens."""

SHOWN = 0.25
"""Share of the points of the fullest segment of a view below which the view shows a corner of a segment only."""

MOVING = 5.0
"""True peak, %, below which a segment hardly moves: the time of its peak says nothing."""

WHAT = ("tracked", "true")

COLUMNS = (
    *("aha", "component", "points", "infarct_share", "infarct_extent", "epicardial_share"),
    *(
        f"{what}_{name}"
        for what in WHAT
        for name in ("es_percent", "peak_percent", "time_to_peak_ms", "systolic_rate_per_s")
    ),
)
"""Columns of the rows of segments."""

Row = dict[str, str | int | float]


@dataclass(frozen=True)
class Tissue:
    """What lies at the points of the grid at end-diastole.

    Attributes
    ----------
    layer : ndarray of shape (point,), integer
        1 at the endocardium.
    segment : ndarray of shape (point,), integer
        AHA segment 1..17.
    region : ndarray of shape (point,), integer
        Of disease: 0 healthy, 1 infarct, 2 border zone, 3 late activation.
    layers : int
        Number of layers.
    """

    layer: NDArray[np.integer]
    segment: NDArray[np.integer]
    region: NDArray[np.integer]
    layers: int

    def rows(self) -> dict[int, Row]:
        """What is known of every segment that the view shows.

        Returns
        -------
        dict
            AHA segment to `points`, their number; `infarct_share`, `infarct_extent` and `epicardial_share`, the shares
            of all its points, of those of its innermost and of those of its outermost layer that are infarcted. If it
            has no point in one of these layers, that of all its points counts.
        """
        layers = {"infarct_share": self.layer > 0, "infarct_extent": self.layer == 1}
        layers |= {"epicardial_share": self.layer == self.layers}
        found: dict[int, Row] = {}
        for number in range(1, SEGMENTS + 1):
            inside = (self.segment == number) & layers["infarct_share"]
            if inside.any():
                whole = float(np.mean(self.region[inside] == INFARCT))
                shares = {name: self._share(inside & layer, whole) for name, layer in layers.items()}
                found[number] = {"points": int(inside.sum()), **shares}
        return found

    def _share(self, points: NDArray[np.bool_], otherwise: float) -> float:
        return float(np.mean(self.region[points] == INFARCT)) if points.any() else otherwise


def segment_rows(tracked: Floats, true: Floats, tissue: Tissue, plane: str, time: Floats, es: int) -> list[Row]:
    """Read strain off the curves of segments.

    Parameters
    ----------
    tracked, true : ndarray of shape (frame, 17, component)
        Engineering strain since end-diastole, radial and tangential first; NaN where unknown.
    tissue : Tissue
    plane : {"short_axis", "long_axis"}
    time : ndarray of shape (frame,), s
    es : int
        Frame of end-systole.

    Returns
    -------
    list of dict
        One for every segment with points and component: `aha`, `component`, what :meth:`Tissue.rows` tells, and of
        `tracked_` and `true_` each `es_percent`, `peak_percent` and `time_to_peak_ms` (of the largest thickening or
        shortening), and
        `systolic_rate_per_s` (:func:`.courses.systolic_rate`), both in the direction of the true end-systolic strain.
    """
    read = {what: _readings(curves, time, es, true[es]) for what, curves in zip(WHAT, (tracked, true), strict=True)}
    rows: list[Row] = []
    for number, about in tissue.rows().items():
        for place, component in enumerate(COMPONENTS[plane]):
            values = {
                f"{what}_{name}": float(array[number - 1, place])
                for what, readings in read.items()
                for name, array in readings.items()
            }
            rows.append({"aha": number, "component": component, **about, **values})
    return rows


def errors(rows: list[Row]) -> dict[str, float]:
    """Errors of the tangential strain of the segments of a clip.

    Parameters
    ----------
    rows : list of dict
        As :func:`segment_rows` returns them.

    Returns
    -------
    dict of float
        segment_peak_bias_pp, the mean of tracked less true peak, and segment_peak_error_pp,
        segment_time_to_peak_error_ms and segment_strain_rate_error_per_s, means of absolute differences; over the
        segments in which both are known and of which the view shows more than a corner (`SHOWN`), times over those of
        them that move (`MOVING`), NaN where there is none.
    """
    fullest = max((float(row["points"]) for row in rows), default=0)
    shown = [row for row in rows if float(row["points"]) >= SHOWN * fullest]
    tangential = [row for row in shown if row["component"] != RADIAL]
    apart = {
        name: np.array([float(row[f"tracked_{name}"]) - float(row[f"true_{name}"]) for row in tangential])
        for name in ("peak_percent", "time_to_peak_ms", "systolic_rate_per_s")
    }
    moves = np.array([abs(float(row["true_peak_percent"])) >= MOVING for row in tangential], bool)
    return {
        "segment_peak_bias_pp": _mean(apart["peak_percent"]),
        "segment_peak_error_pp": _mean(np.abs(apart["peak_percent"])),
        "segment_time_to_peak_error_ms": _mean(np.abs(apart["time_to_peak_ms"])[moves]),
        "segment_strain_rate_error_per_s": _mean(np.abs(apart["systolic_rate_per_s"])),
    }


def _readings(curves: Floats, time: Floats, es: int, true_at_es: Floats) -> dict[str, Floats]:
    """Values of curves (frame, 17, component), each (17, component) as the true end-systolic strain."""
    value, when = peak(curves[..., :2], time, CONTRACTION)
    return {
        "es_percent": 100 * curves[es],
        "peak_percent": 100 * value,
        "time_to_peak_ms": 1e3 * when,
        "systolic_rate_per_s": systolic_rate(rate(curves, time)[: es + 1], true_at_es),
    }


def _mean(values: Floats) -> float:
    """Mean of the values (n,) that are known."""
    return float(statistics.mean(values[:, None], np.ones((1, len(values)), bool))[0, 0])
