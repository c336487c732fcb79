"""Leaderboard of trackers: means over the hearts of a repository, with bootstrap intervals, and ranges of ranks.

Of several cases of one heart, the heart has the mean over the clips of all of them.

Trackers are ranked by `nrmse_all_percent`, in which a point without an estimate counts as one that did not move: a
tracker gains nothing by leaving out difficult points, and one that fails has 100 %. Where every point has an estimate
it is the NRMSE. Its means are geometric, so that a heart counts by the ratio of two trackers in it and not by how
difficult it is. Which ranks are possible follows from the ratios (:mod:`.paired_ratios`): equal trackers are ordered in
5 % of leaderboards at most, and none is with fewer than six hearts. A metric that a tracker lacks on one clip is
missing from its mean too, since the mean of its other clips would be too good. Intervals of means are the middle 95 %
of a bootstrap over hearts (:mod:`.resampling`); a single heart has none.
"""

import logging
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from echotruth.config.imaging import ALL_VIEWS
from echotruth.evaluation.no_estimate import of_scores
from echotruth.evaluation.paired_ratios import log_scores, rank_ranges
from echotruth.evaluation.resampling import draws, interval, means_of_hearts, ranks
from echotruth.evaluation.scoring import metrics
from echotruth.repository import estimates, schema
from echotruth.repository.reader import Repository
from echotruth.tracking.external_program import in_one_line

log = logging.getLogger("echotruth")

KEYS = ("case", "view", "size_px", "tracker")
"""Columns that identify a row of :func:`rows`."""

SCORES = tuple(
    name
    for name, array in schema.arrays_of("tracking/SIZE").items()
    if "tracker" in array.dims and "frame" not in array.dims
)
"""Arrays from which the metrics are made."""

HEART = "heart"
"""Column that tells the hearts apart."""

RANKED_BY = "nrmse_all_percent"
"""Metric by which trackers are ranked."""


def rows(repository: Repository) -> pd.DataFrame:
    """Scores of every clip by every tracker, external ones included, of the hearts that are shown.

    Parameters
    ----------
    repository : Repository
        Its folder `external` holds scores of external trackers.

    Returns
    -------
    DataFrame
        Columns of `KEYS`, those of :func:`echotruth.evaluation.scoring.metrics`, `failure`: why the tracker failed,
        or ""; and `no_estimate`: why it lacks a strain that the view shows, or "". Without a heart there are no rows,
        and no columns of metrics.

    Raises
    ------
    ValueError
        If a table of an external tracker cannot be read or lacks a column.
    """
    clips = ((case, view) for case in repository.shown for view in repository.views)
    found = [row for clip in clips for row in _builtin_rows(repository, *clip)]
    ordered = sorted(found, key=lambda row: repository.sizes.index(row["size_px"]))
    builtin = pd.DataFrame(ordered, columns=None if found else [*KEYS, "failure"])
    clip, tables = ["case", "view", "size_px"], [builtin]
    known = pd.MultiIndex.from_frame(builtin[clip])
    for file in _files_of_guests(repository):
        table = _external_rows(repository, file, builtin.columns)
        table = table[~table["tracker"].isin(builtin["tracker"]) & pd.MultiIndex.from_frame(table[clip]).isin(known)]
        tables += [table] if len(table) else []
    table, views = pd.concat(tables, ignore_index=True), repository.config.views
    why = [of_scores(row, views[row["view"]].plane, repository.config) for row in table.to_dict("records")]
    return table.assign(no_estimate=why)


def standings(rows: pd.DataFrame, seed: int, hearts: Mapping[str, str] | None = None) -> pd.DataFrame:
    """The leaderboard.

    Parameters
    ----------
    rows : DataFrame
        As :func:`rows` returns them.
    seed : int
        Seed of the bootstrap.
    hearts : mapping, optional
        Case to heart. Default: every case is one.

    Returns
    -------
    DataFrame
        One row for every image size, view (`all`: the mean over the views of a heart) and tracker, the best first:
        `rank` (equal trackers share one; NaN for a tracker that was not evaluated on every case and view), `hearts`
        and `failures` (number of clips), the mean over the hearts of every metric, NaN where the tracker has no
        value on a clip on which another tracker has one or it failed; `rank_low` and `rank_high`, the ranks that are
        possible; and `_low` and `_high` of `nrmse_all_percent` and of the RMS errors of strain: the bootstrap interval,
        NaN with a single heart and where there is no mean.
    """
    heart = rows["case"] if hearts is None else rows["case"].map(hearts)
    rows = rows.drop(columns="no_estimate", errors="ignore").assign(
        **{HEART: heart, RANKED_BY: log_scores(rows[RANKED_BY])}
    )
    cases_of = rows.groupby(HEART, sort=False)["case"].nunique()
    views, resamples = list(dict.fromkeys(rows["view"])), draws(len(cases_of), seed)
    tables = []
    for size in dict.fromkeys(rows["size_px"]):
        of_size = rows[rows["size_px"] == size]
        for view in (ALL_VIEWS, *views):
            clips = of_size if view == ALL_VIEWS else of_size[of_size["view"] == view]
            clips_of = cases_of * (len(views) if view == ALL_VIEWS else 1)
            tables.append(_table(clips, clips_of, resamples).assign(size_px=size, view=view))
    table = pd.concat(tables, ignore_index=True)
    others = [name for name in rows if name not in (*KEYS, HEART, "failure", RANKED_BY)]
    first = ("size_px", "view", "tracker", "hearts", "failures")
    values = [f"{name}{suffix}" for name in ("rank", RANKED_BY, *others) for suffix in ("", "_low", "_high")]
    return table[[*first, *(name for name in values if name in table)]]


def best(standings: pd.DataFrame) -> list[str]:
    """Trackers from the best to the worst at the largest image size, over all views; those without a rank are last."""
    table = standings[(standings["view"] == ALL_VIEWS) & (standings["size_px"] == standings["size_px"].max())]
    return list(table.sort_values("rank", kind="stable", na_position="last")["tracker"])


def _table(clips: pd.DataFrame, clips_of: pd.Series, resamples: np.ndarray) -> pd.DataFrame:
    """Rows of one image size and view, in which the hearts have so many clips."""
    columns = [str(name) for name in clips if name not in (*KEYS, HEART, "failure")]
    # Hearts with a missing clip are left out: their mean would be over other clips than that of other trackers.
    every_clip = clips.groupby(["tracker", HEART], sort=False).size().eq(clips_of, level=HEART)
    means = means_of_hearts(clips, columns, HEART)[every_clip]
    trackers = list(dict.fromkeys(clips["tracker"]))
    table = pd.DataFrame({"tracker": trackers}).set_index("tracker")
    table["hearts"] = every_clip.groupby("tracker").sum()
    table["failures"] = (clips["failure"] != "").groupby(clips["tracker"]).sum()
    for name in (RANKED_BY, "e_cc_rms_pp", "e_ll_rms_pp", "e_rr_rms_pp"):
        values = means[name].unstack(HEART).reindex(index=trackers, columns=clips_of.index).to_numpy().T
        if name == RANKED_BY:
            table["rank"] = ranks(values.mean(0))
            table["rank_low"], table["rank_high"] = rank_ranges(values)
        table[f"{name}_low"], table[f"{name}_high"] = interval(values, resamples)
    by_tracker = means.groupby("tracker", sort=False)
    known_for_all = by_tracker.count().eq(by_tracker.size(), axis=0)
    table = table.join(by_tracker.mean().where(known_for_all))
    geometric = [f"{RANKED_BY}{end}" for end in ("", "_low", "_high")]
    table[geometric] = np.exp(table[geometric])
    return table.sort_values("rank", kind="stable", na_position="last").reset_index()


def failures_of(repository: Repository, case: str, view: str) -> dict[tuple[str, int], str]:
    """Why trackers of a repository failed on a view of a heart, by tracker and image size; others are not in it."""
    about = {size: repository.attributes(f"tracking/{size}", case, view) for size in repository.sizes}
    return {(name, size): why for size, found in about.items() for name, why in found.get("failures", {}).items()}


def _builtin_rows(repository: Repository, case: str, view: str) -> Iterator[dict]:
    """Rows of the repository's own trackers on one view of a heart."""
    failures, plane = failures_of(repository, case, view), repository.config.views[view].plane
    own = list(repository.config.tracking.trackers)
    for size, tracker, score in estimates.each(repository, case, view, repository.sizes, own, *SCORES):
        keys = dict(zip(KEYS, (case, view, size, tracker), strict=True))
        yield keys | metrics(score, plane) | {"failure": failures.get((tracker, size), "")}


def scores_of_guests(repository: Repository) -> pd.DataFrame:
    """Scores that `echotruth evaluate` wrote of trackers from outside, on images that have not changed since.

    Scores of trackers that have the name of one of the repository's own do not count.

    Parameters
    ----------
    repository : Repository

    Returns
    -------
    DataFrame
        Columns of `KEYS`, the metrics that the tables have, and `failure`.

    Raises
    ------
    ValueError
        If a table cannot be read or lacks a column.
    """
    files = [file for file in _files_of_guests(repository) if file.stem not in repository.config.tracking.trackers]
    tables = [_external_rows(repository, file, _columns(file)) for file in files]
    return pd.concat([pd.DataFrame(columns=[*KEYS, "failure"]), *(table for table in tables if len(table))])


def is_current(repository: Repository, case: str, view: str, version: str) -> bool:
    """Whether a clip is there in a version (:meth:`.Repository.version`)."""
    known = case in repository.rows and view in repository.views
    return known and repository.version(case, view) == version


def _files_of_guests(repository: Repository) -> list[Path]:
    """Tables of scores of trackers from outside."""
    return [] if repository.is_remote else sorted((repository.folder / "external").glob("*.csv"))


def _columns(file: Path) -> pd.Index:
    """Columns of a table of scores, and those that it must have."""
    try:
        given = [str(name) for name in pd.read_csv(file, nrows=0) if name != "clip"]
    except (ValueError, OSError):  # told where the table is read
        given = []
    return pd.Index([*KEYS, *(name for name in given if name not in (*KEYS, "failure")), "failure"])


def _external_rows(repository: Repository, file: Path, columns: pd.Index) -> pd.DataFrame:
    """Scores of an external tracker, named by the file, on clips that have not changed since they were scored."""
    text = ("case", "view", "tracker", "failure", "clip")
    types = {name: str if name in text else float for name in (*columns, "clip")} | {"size_px": int}
    try:
        # Only an empty number is NaN: a view may be called "null".
        missing_values = {name: "" for name, kind in types.items() if kind is float}
        table = pd.read_csv(file, dtype=types, keep_default_na=False, na_values=missing_values)
    except (ValueError, OSError) as error:
        raise ValueError(f"{file}: cannot be read ({in_one_line(str(error))}): evaluate that tracker again") from error
    missing = [name for name in columns if name not in table]
    if missing:
        raise ValueError(f"{file}: has no column {missing[0]}: evaluate that tracker again")
    clips = zip(table["case"], table["view"], table.get("clip", [""] * len(table)), strict=True)
    current = np.array([is_current(repository, *one) for one in clips], bool)
    if not current.all():
        older = f"{(~current).sum()} of {len(current)} rows are of older images or other points"
        log.warning("external/%s: %s: evaluate that tracker again", file.name, older)
    return table[current].assign(tracker=file.stem)[list(columns)]
