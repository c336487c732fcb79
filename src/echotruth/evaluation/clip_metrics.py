"""Metrics of all clips of a repository by every tracker, as tables.

They are made when they are read, from the displacement, the quality and the strain that are stored: a repository of an
earlier version has them too, and one that is not finished has those of its finished clips.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import zarr
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.cases import Case, diagnosis
from echotruth.config.loading import load
from echotruth.evaluation import kept, point_tracks, reliability, segment_strain
from echotruth.evaluation.agreement import REFERENCES
from echotruth.evaluation.choice import cases_of, chosen, hearts_of, image_size, jobs_of, label_text
from echotruth.evaluation.clip import grid_points, grid_positions
from echotruth.evaluation.courses import rate, systolic_rate
from echotruth.evaluation.curves import REFERENCE
from echotruth.evaluation.leaderboard import KEYS, failures_of, scores_of_guests
from echotruth.evaluation.scoring import metrics
from echotruth.evaluation.segment_strain import Row
from echotruth.imaging.labels import unpack
from echotruth.imaging.tracks import visible
from echotruth.loop.cycle import read_loop
from echotruth.repository.ledger import repository_folder
from echotruth.repository.schema import LABELS
from echotruth.repository.tracked import EVALUATION_PACKS
from echotruth.workflow.job import Job

if TYPE_CHECKING:
    import pandas as pd


SORTS = ("heart", "split", "group", "acoustics", "variation")
"""Labels of the table of cases that sort clips; `heart` is the one that hearts are told apart by."""

BEGIN = (*KEYS[:2], "plane", *KEYS[2:], *SORTS, "diagnosis")
"""Columns with which every table begins."""

COURSES = ("segment_strain", "line_strain")
"""Curves that are read, by their names less `tracked_` and `true_`."""

SCORES = next(pack.names for pack in EVALUATION_PACKS if pack.array.name == "scores")
"""Arrays from which the metrics of the leaderboard are made."""

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


def clip_metrics(
    repository: str | Path,
    cases: Sequence[str] | None = None,
    views: Sequence[str] | None = None,
    sizes: Sequence[int] | None = None,
    trackers: Sequence[str] | None = None,
) -> ClipMetrics:
    """Read the metrics of all clips and trackers, as benchmarks of trackers and of strain print them (docs/metrics.md).

    Parameters
    ----------
    repository : str or Path
        A repository, finished or not.
    cases, views, sizes, trackers : sequence, optional
        Those to include. Default: all that was evaluated.

    Returns
    -------
    ClipMetrics
        Three tables. `clips` has a row per case, view, size_px and tracker; `segments` one per clip, tracker, AHA
        segment and component of strain; `reliability` one per clip, tracker and tenth of quality. docs/metrics.md
        tells their columns, which name their units. All begin with case, view, plane, size_px and tracker, and with
        heart, split, group, acoustics and variation, which are labels of the table of cases, "" where it has none
        (without a label, heart is that of the first case with the same motion), and the diagnosis.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view, size or tracker, or the scores of one from outside cannot be read.

    Examples
    --------
    >>> import echotruth as et
    >>> clips = et.clip_metrics("out/demo", views=["mid"], sizes=[128], trackers=["dis", "bspline_dic"]).clips
    >>> list(clips["tracker"]), bool(clips["delta_avg_percent"].between(0, 100).all())
    (['dis', 'bspline_dic'], True)
    """
    folder = repository_folder(repository)
    config = load(folder / "config.yaml")
    chosen_sizes = [image_size(config, size) for size in sizes or config.bmode.sizes]
    guests = scores_of_guests(folder, config.tracking.trackers)
    known = [*kept.trackers(folder, config), *guests["tracker"].unique()]
    chosen_trackers = chosen("tracker", trackers, list(dict.fromkeys(known)))
    by_id = cases_of(folder, config)
    hearts = hearts_of(by_id)
    found: tuple[list[Row], list[Row], list[Row]] = ([], [], [])
    for job in jobs_of(folder, config, by_id, cases, views, "evaluation"):
        keys: Row = {"case": job.case.id, "view": str(job.view_name), "plane": job.view.plane}
        keys |= _sorts(job.case, hearts[job.case.id])
        for rows in _of_view(job, chosen_sizes, chosen_trackers, guests):
            for table, more in zip(found, rows, strict=True):
                table += [keys | row for row in more]
    clips, segments, steps = found
    return ClipMetrics(_table(clips), _table(segments, segment_strain.COLUMNS), _table(steps, reliability.COLUMNS))


def _table(rows: list[Row], columns: Sequence[str] = ()) -> pd.DataFrame:
    """A table of which the columns of `BEGIN` are first, and then those that are given, also without rows."""
    import pandas as pd

    names = dict.fromkeys([*BEGIN, *columns, *(name for row in rows for name in row)])
    return pd.DataFrame(rows).reindex(columns=list(names))


def clip_truth(job: Job) -> ClipTruth:
    """Read what is true of a view.

    Parameters
    ----------
    job : Job
        Of the stage tracking of the view, which was evaluated.
    """
    config, largest = job.case.config, job.case.config.bmode.sizes[0]
    unit = config.bmode.si().field_of_view / point_tracks.SIDE
    stored = job.read("evaluation", "true_displacement", *(f"true_{name}" for name in COURSES))
    # Only those of frame 0, of which each frame is a chunk.
    labels = zarr.open_array(job.store.path, path=f"truth/{largest}/labels", mode="r")
    at_ed = unpack(np.asarray(labels[(*job.index, 0)]))
    lateral, axial = np.moveaxis(grid_points(config, largest).round().astype(int), -1, 0)
    tissue = {name: values[axial, lateral] for name, values in at_ed.items()}
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
        plane=job.view.plane,
        time=read_loop(config.loop).time,
        es=int(job.store.read("mechanics", job.row, names=("es_frame",))["es_frame"]),
        curves={"segment_strain": segments, "line_strain": stored["true_line_strain"].astype(float)},
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
    job: Job, sizes: list[int], trackers: list[str], guests: pd.DataFrame
) -> Iterator[tuple[list[Row], list[Row], list[Row]]]:
    """Rows of the three tables, less those columns that all clips of a view share."""
    truth = clip_truth(job)
    failures = failures_of(job.folder, job.case.id, str(job.view_name))
    scored = guests[(guests["case"] == job.case.id) & (guests["view"] == job.view_name)]
    told = {(row["size_px"], row["tracker"]): row for row in scored.to_dict("records")}
    for size, tracker, found in _tracked(job, sizes, trackers):
        keys: Row = {"size_px": size, "tracker": tracker}
        of_guest = told.pop((size, tracker), {})
        reason = failures.get(f"{tracker}/{size}", of_guest.get("failure", ""))
        clip, segments, steps = _of_clip(found, truth)
        yield [{**keys, "failure": reason, **clip}], [keys | row for row in segments], [keys | step for step in steps]
    for (size, tracker), row in told.items():
        if size in sizes and tracker in trackers:
            values = {name: value for name, value in row.items() if name not in KEYS[:2]}
            yield [values | _truth_metrics(truth)], [], []


def _of_clip(found: Arrays, truth: ClipTruth) -> tuple[Row, list[Row], list[Row]]:
    """Rows of the three tables of one clip and tracker, less their keys."""
    displacement, quality = (found[name][:, truth.inside].astype(float) for name in ("displacement", "quality"))
    displacement /= truth.unit
    within = np.linalg.norm(displacement - truth.displacement[..., :2], axis=-1) < reliability.WITHIN
    tracked = found["tracked_segment_strain"][:, _ENGINEERING].astype(float)
    true = truth.curves["segment_strain"]
    segments = segment_strain.segment_rows(tracked, true, truth.tissue, truth.plane, truth.time, truth.es)
    clip: Row = {
        **_truth_metrics(truth),
        **metrics(found, truth.plane),
        **track_metrics(displacement, quality, truth),
        **reliability.summary(quality[1:], within[1:]),
        **_line_strain(found, truth),
        **segment_strain.errors(segments),
    }
    return clip, segments, [dict(step) for step in reliability.counts(quality[1:], within[1:])]


def _tracked(job: Job, sizes: list[int], trackers: list[str]) -> Iterator[tuple[int, str, Arrays]]:
    """What trackers found in the clips of a view; those from outside that did not keep it are left out."""
    names = {
        "tracking": ("displacement", "quality"),
        "evaluation": (*SCORES, *(f"tracked_{name}" for name in COURSES)),
    }
    stored = kept.trackers(job.folder, job.case.config)
    for size, tracker, found in kept.read_each(job, sizes, [name for name in trackers if name in stored], names):
        # One from outside may have been evaluated at other sizes only.
        if tracker in job.case.config.tracking.trackers or np.isfinite(found["nrmse_all"]).any():
            yield size, tracker, found


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


def _sorts(case: Case, heart: str) -> Row:
    """Labels of a case as text, its heart, and its diagnosis."""
    return {
        **{name: label_text(case.labels.get(name)) for name in SORTS},
        "heart": heart,
        "diagnosis": diagnosis(case.config),
    }
