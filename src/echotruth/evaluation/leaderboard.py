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

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from echotruth.config.imaging import ALL_VIEWS
from echotruth.evaluation.no_estimate import of_scores
from echotruth.evaluation.paired_ratios import log_scores, rank_ranges
from echotruth.evaluation.resampling import draws, interval, means_of_hearts, ranks
from echotruth.evaluation.scoring import metrics
from echotruth.repository import estimates, schema
from echotruth.repository.reader import Repository

KEYS = ("case", "view", "size_px", "tracker")
"""Columns that identify a row of :func:`rows`."""

STRAIN_ERRORS = [f"{of}e_{component}_rms_pp" for of in ("", "segment_") for component in ("cc", "ll", "rr")]
"""Metrics whose means have an interval: RMS errors of strain, in volumes of that of segments."""

HEART = "heart"
"""Column that distinguishes the hearts."""

RANKED_BY = "nrmse_all_percent"
"""Metric by which trackers are ranked."""


def rows(repository: Repository) -> pd.DataFrame:
    """Scores of every clip by every tracker, of the hearts that are shown.

    Parameters
    ----------
    repository : Repository

    Returns
    -------
    DataFrame
        Columns of `KEYS`, those of :func:`echotruth.evaluation.scoring.metrics`, `failure`: why the tracker failed,
        or ""; and `no_estimate`: why it lacks a strain that the view shows, or "". Without a heart there are no rows,
        and no columns of metrics.
    """
    clips = ((case, view) for case in repository.shown for view in repository.views)
    found = [row for clip in clips for row in rows_of(repository, *clip, repository.trackers)]
    ordered = sorted(found, key=lambda row: repository.sizes.index(row["size_px"]))
    return pd.DataFrame(ordered, columns=None if found else [*KEYS, "failure", "no_estimate"])


def rows_of(repository: Repository, case: str, view: str, trackers: Sequence[str]) -> Iterator[dict]:
    """Rows of one view of a heart by some trackers, those of the largest images first."""
    failures, config = estimates.failures(repository, case, view), repository.config
    names, plane = ["score", "scores"] if config.has_volumes else [*schema.SCORES], config.views[view].plane
    for size, tracker, score in estimates.each(repository, case, view, repository.sizes, trackers, *names):
        row = dict(zip(KEYS, (case, view, size, tracker), strict=True))
        row |= dict(zip(*score.values(), strict=True)) if config.has_volumes else metrics(score, plane)
        row["failure"] = failures.get((tracker, size), "")
        yield row | {"no_estimate": "" if config.has_volumes else of_scores(row, plane, config)}


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
    for name in [name for name in (RANKED_BY, *STRAIN_ERRORS) if name in means]:
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
