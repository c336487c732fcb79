"""Metrics of all clips of a repository by every tracker, as tables.

They are made when they are read, from the displacement, the quality and the strain that are stored: a repository that
is not finished has those of its finished clips.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.cases import Case, diagnosis
from echotruth.cases.labels import heart_of, label_text
from echotruth.evaluation import point_tracks, reliability, segment_strain
from echotruth.evaluation.agreement import REFERENCES
from echotruth.evaluation.courses import rate, systolic_rate
from echotruth.evaluation.curves import REFERENCE
from echotruth.evaluation.leaderboard import KEYS
from echotruth.evaluation.no_estimate import of_scores, reason
from echotruth.evaluation.scoring import metrics
from echotruth.evaluation.segment_strain import Row
from echotruth.imaging.labels import unpack
from echotruth.imaging.tracks import visible
from echotruth.loop.cycle import frame_times
from echotruth.repository import estimates
from echotruth.repository.choice import Names, Sizes, chosen, image_size
from echotruth.repository.reader import Repository
from echotruth.repository.schema import LABELS, SCORES
from echotruth.tracking.point_grid import grid_pixels, grid_positions
from echotruth.units import mm

SORTS = ("heart", "split", "group", "acoustics", "variation")
"""Labels of the table of cases that sort clips; `heart` is the one that distinguishes hearts."""

BEGIN = (*KEYS[:2], "plane", *KEYS[2:], *SORTS, "diagnosis")
"""Columns with which every table begins."""

COURSES = ("segment_strain", "line_strain")
"""Curves that are read, by their names less `tracked_` and `true_`."""

_ENGINEERING, _MIDDLE = LABELS["measure"].index("engineering"), LABELS["contour"].index("middle")

Arrays = dict[str, NDArray[Any]]


class ClipMetrics(NamedTuple):
    """Tables of one repository.

    Attributes
    ----------
    clips : DataFrame
        A row per case, view, image size and tracker.
    segments : DataFrame
        A row per clip, tracker, AHA segment and component of strain.
    reliability : DataFrame
        A row per clip, tracker and step of quality.
    """

    clips: pd.DataFrame
    segments: pd.DataFrame
    reliability: pd.DataFrame


class ClipTruth(NamedTuple):
    """What is true of one view of one heart at the points of the grid in the wall, at any image size.

    Attributes
    ----------
    inside : ndarray of shape (grid rows, grid columns), bool
        Points of the grid in the wall at end-diastole; the other arrays hold only these.
    displacement : ndarray of shape (frame, point, 3)
        Since end-diastole: lateral, axial, elevation, 1/256 of the side of the image.
    visible : ndarray of shape (frame, point), bool
        Whether the image shows the point.
    unit : float
        1/256 of the side of the image, m.
    tissue : Tissue
    plane : {"short_axis", "long_axis"}
    time : ndarray of shape (frame,), s
    es : int
        Frame of end-systole.
    curves : dict of ndarray
        Segment strain (frame, 17, component) and line strain (frame, contour), by their names in `COURSES`.
    beat : int, optional
        Frames of the first beat, in which peaks are sought. Default: all.
    """

    inside: NDArray[np.bool_]
    displacement: Floats
    visible: NDArray[np.bool_]
    unit: float
    tissue: segment_strain.Tissue
    plane: str
    time: Floats
    es: int
    curves: dict[str, Floats]
    beat: int | None = None


def clip_metrics(
    repository: Repository, cases: Names = None, views: Names = None, sizes: Sizes = None, trackers: Names = None
) -> ClipMetrics:
    """Read the metrics of all clips and trackers; parameters, result and errors: see :meth:`.Repository.metrics`."""
    chosen_sizes = [image_size(repository.config, size) for size in sizes or repository.sizes]
    chosen_trackers = chosen("tracker", trackers, repository.trackers)
    found: tuple[list[Row], list[Row], list[Row]] = ([], [], [])
    for case, complete in repository.finished(cases, views, "truth", "points"):
        for view in complete:
            keys: Row = {"case": case.id, "view": view, "plane": case.config.views[view].plane}
            keys |= _sorts(case)
            for rows in _of_view(repository, case.id, view, chosen_sizes, chosen_trackers):
                for table, more in zip(found, rows, strict=True):
                    table += [keys | row for row in more]
    clips, segments, steps = found
    for row in clips:
        row["no_estimate"] = of_scores(row, str(row["plane"]), repository.config)
    of_segments = _table(segments, (*segment_strain.COLUMNS, "no_estimate"))
    return ClipMetrics(_table(clips), of_segments, _table(steps, reliability.COLUMNS))


def _table(rows: list[Row], columns: Sequence[str] = ()) -> pd.DataFrame:
    """A table of which the columns of `BEGIN` are first, and then those that are given, also without rows."""
    names = dict.fromkeys([*BEGIN, *columns, *(name for row in rows for name in row)])
    return pd.DataFrame(rows).reindex(columns=list(names))


def clip_truth(repository: Repository, case: str, view: str) -> ClipTruth:
    """Read what is true of a view that was evaluated.

    Parameters
    ----------
    repository : Repository
    case, view : str
    """
    config = repository.case(case).config
    unit, plane = config.bmode.field_of_view_mm * mm / point_tracks.SIDE, config.views[view].plane
    stored = estimates.true(repository, case, view, "true_displacement", *(f"true_{name}" for name in COURSES))
    # Only those of frame 0, of which each frame is a chunk.
    at_ed = unpack(repository.read(f"truth/{config.bmode.sizes[0]}/labels", case, view, 0))
    tissue = {name: values[grid_pixels(config)] for name, values in at_ed.items()}
    inside = np.asarray(tissue["mask"], bool) & np.isfinite(stored["true_displacement"]).all((0, -1))
    displacement = stored["true_displacement"][:, inside].astype(float)
    position = np.column_stack([grid_positions(config)[inside], np.zeros(inside.sum())])
    named = {name: tissue[name][inside] for name in ("layer", "segment", "region")}
    segments = stored["true_segment_strain"][REFERENCES.index(REFERENCE), :, _ENGINEERING].astype(float)
    return ClipTruth(
        inside=inside,
        displacement=displacement / unit,
        visible=visible(config, position + displacement),
        unit=unit,
        tissue=segment_strain.Tissue(**named, layers=config.fibres.layers),
        plane=plane,
        time=frame_times(config.loop),
        es=int(repository.read("mechanics/es_frame", case)),
        curves={"segment_strain": segments, "line_strain": stored["true_line_strain"].astype(float)},
        beat=config.loop.beat_starts[1],
    )


def track_metrics(displacement: Floats, quality: Floats, truth: ClipTruth) -> dict[str, float]:
    """Metrics of the tracks of one clip and of their steps.

    Parameters
    ----------
    displacement : ndarray of shape (frame, point, 2)
        Since end-diastole: lateral, axial, 1/256 of the side of the image; NaN where unknown.
    quality : ndarray of shape (frame, point)
        0 to 1; NaN where unknown.
    truth : ClipTruth

    Returns
    -------
    dict of float
        The results of :func:`.point_tracks.tap_vid` and :func:`.point_tracks.flow_error`;
        median_trajectory_error_px256, survival_percent and survival_8px_percent. In the median trajectory error and in
        those of flow, a point without an estimate counts as one that did not move; elsewhere it is wrong.
    """
    true = truth.displacement[..., :2]
    error = np.linalg.norm(displacement - true, axis=-1)
    at_rest = np.where(np.isfinite(displacement).all(-1, keepdims=True), displacement, 0)
    claimed = np.nan_to_num(quality, nan=0.0) >= point_tracks.SURE
    trajectory = point_tracks.median_trajectory_error(np.linalg.norm(at_rest - true, axis=-1))
    return {
        **point_tracks.tap_vid(error, truth.visible, claimed),
        "median_trajectory_error_px256": trajectory,
        "survival_percent": point_tracks.survival(error),
        "survival_8px_percent": point_tracks.survival(error, point_tracks.LOST_IN_A_WALL),
        **point_tracks.flow_error(at_rest, true),
    }


def _of_view(
    repository: Repository, case: str, view: str, sizes: list[int], trackers: list[str]
) -> Iterator[tuple[list[Row], list[Row], list[Row]]]:
    """Rows of the three tables, less those columns that all clips of a view share."""
    truth, failures = clip_truth(repository, case, view), estimates.failures(repository, case, view)
    names = ("displacement", "quality", *(f"tracked_{name}" for name in COURSES), *SCORES)
    for size, tracker, found in estimates.each(repository, case, view, sizes, trackers, *names):
        keys: Row = {"size_px": size, "tracker": tracker}
        failure = failures.get((tracker, size), "")
        clip, segments, steps = clip_rows(found, truth)
        for row in segments:
            tracked, true = (np.array(row[f"{what}_es_percent"], float) for what in segment_strain.WHAT)
            row["no_estimate"] = reason(tracked, true, repository.config, failure)
        yield [{**keys, "failure": failure, **clip}], [keys | row for row in segments], [keys | step for step in steps]


def clip_rows(found: Arrays, truth: ClipTruth) -> tuple[Row, list[Row], list[Row]]:
    """Rows of the three tables of one clip and tracker, less their keys.

    Parameters
    ----------
    found : dict of ndarray
        displacement (frame, grid rows, grid columns, 2), m, quality (frame, grid rows, grid columns), and what
        :func:`.scoring.score` makes of the first.
    truth : ClipTruth
    """
    displacement, quality = (found[name][:, truth.inside].astype(float) for name in ("displacement", "quality"))
    displacement /= truth.unit
    within = np.linalg.norm(displacement - truth.displacement[..., :2], axis=-1) < reliability.WITHIN
    judged = reliability.judged(quality, displacement)
    tracked = found["tracked_segment_strain"][:, _ENGINEERING].astype(float)
    tracked, true, time = (each[: truth.beat] for each in (tracked, truth.curves["segment_strain"], truth.time))
    segments = segment_strain.segment_rows(tracked, true, truth.tissue, truth.plane, time, truth.es)
    clip: Row = {
        **_truth_metrics(truth),
        **metrics(found, truth.plane),
        **track_metrics(displacement, quality, truth),
        **reliability.summary(quality[judged], within[judged]),
        **_line_strain(found, truth),
        **segment_strain.errors(segments),
    }
    return clip, segments, [dict(step) for step in reliability.counts(quality[judged], within[judged])]


def _line_strain(found: Arrays, truth: ClipTruth) -> dict[str, float]:
    """GLS or GCS at end-systole, %, and the systolic rate of the same line, 1/s."""
    curves = {
        "tracked": found["tracked_line_strain"][:, _MIDDLE].astype(float),
        "true": truth.curves["line_strain"][:, _MIDDLE],
    }
    at_es = {what: float(curve[truth.es]) for what, curve in curves.items()}
    rates = {
        what: float(systolic_rate(rate(curve, truth.time)[: truth.es + 1], np.asarray(at_es["true"])))
        for what, curve in curves.items()
    }
    shown = "gcs" if truth.plane == "short_axis" else "gls"
    return {
        **{
            f"{what}_{name}_percent": 100 * at_es[what] if name == shown else np.nan
            for name in ("gcs", "gls")
            for what in at_es
        },
        **{f"{what}_strain_rate_per_s": value for what, value in rates.items()},
        "strain_rate_error_per_s": abs(rates["tracked"] - rates["true"]),
    }


def _truth_metrics(truth: ClipTruth) -> Row:
    """Number of points, and their RMS displacement out of the plane at end-systole, um."""
    elevation = truth.displacement[truth.es, :, 2]
    rms = float(1e6 * truth.unit * np.sqrt(np.mean(elevation**2))) if elevation.size else np.nan
    return {"points": len(elevation), "through_plane_rms_um": rms}


def _sorts(case: Case) -> Row:
    """Labels of a case as text, its heart, and its diagnosis."""
    return {
        **{name: label_text(case.labels.get(name)) for name in SORTS},
        "heart": heart_of(case),
        "diagnosis": diagnosis(case.config),
    }
