"""Trackers over hearts: their order and the ratios of their scores."""

from __future__ import annotations

import numpy as np
import pandas as pd

from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.paired_ratios import log_scores, pairs, rank_ranges, simultaneous_intervals
from echotruth.evaluation.resampling import CLIP, means_of_hearts


def by_heart(clips: pd.DataFrame, column: str) -> pd.DataFrame:
    """One metric as a table of hearts and trackers.

    Parameters
    ----------
    clips : DataFrame
        As :attr:`echotruth.evaluation.clip_metrics.ClipMetrics.clips`, of the clips that are to count.
    column : str
        A metric.

    Returns
    -------
    DataFrame
        Hearts as rows and trackers as columns, both in the order of the clips: the mean over the clips of the heart.
        NaN where a tracker was not tried on one, or has no value where another one has one or where it failed. A
        metric in which points without an estimate count has a value where a tracker failed, and counts as that. Hearts
        in whose clips no tracker has the metric are left out.
    """
    hearts, trackers = (list(dict.fromkeys(clips[name])) for name in ("heart", "tracker"))
    means = means_of_hearts(clips, [column], "heart")[column].unstack("tracker").reindex(hearts, columns=trackers)
    tried = clips.groupby(["heart", "tracker"]).size().unstack("tracker").reindex(hearts, columns=trackers)
    keys = ["heart", *(name for name in CLIP if name in clips)]
    wanted = clips.drop_duplicates(keys).groupby("heart").size().reindex(hearts)
    found = means.where(tried.eq(wanted, axis=0))
    known = clips[column].notna().groupby(clips["heart"]).any().reindex(hearts)
    return found[known.to_numpy(bool)]


def scores(clips: pd.DataFrame, column: str = RANKED_BY) -> pd.DataFrame:
    """Logarithm of the geometric mean of a score, %, over the clips of each heart, as :func:`by_heart` returns it."""
    return by_heart(clips.assign(**{column: log_scores(clips[column])}), column)


def ranking(scores: pd.DataFrame) -> pd.DataFrame:
    """Order of trackers, the ranks that are possible, and ratios to the first.

    Parameters
    ----------
    scores : DataFrame
        Hearts by trackers, as :func:`scores` returns them.

    Returns
    -------
    DataFrame
        Trackers as rows, the best first; those with a heart without a score last, in the order given. `score`, the
        geometric mean over the hearts, %; `rank_first` and `rank_last`; and `ratio` to the score of the first with
        `low` and `high`, which hold for all pairs of trackers at once (:mod:`echotruth.evaluation.paired_ratios`). NaN
        where there is no score.
    """
    table = scores.to_numpy(float)
    mean = np.where(np.isfinite(table).all(axis=0), table.mean(axis=0), np.nan) if len(table) else np.nan * table.sum(0)
    order = np.argsort(mean, kind="stable")  # NaN is sorted last
    table, known = table[:, order], int(np.isfinite(mean).sum())
    first, last = rank_ranges(table) if len(table) else 2 * (mean,)
    found = pd.DataFrame(
        {"score": np.exp(mean[order]), "rank_first": first, "rank_last": last},
        index=pd.Index(scores.columns[order], name="tracker"),
    )
    one, other = pairs(known)
    ratios = np.full((3, len(order)), np.nan)
    if known and len(table):
        ratios[:, :1] = 1.0
        ratios[:, 1:known] = simultaneous_intervals(table[:, other] - table[:, one]).ratios[:, one == 0]
    return found.assign(**dict(zip(RATIO, ratios, strict=True)))


def against(scores: pd.DataFrame, reference: str) -> pd.DataFrame:
    """Ratios of the score of each other tracker to that of one, with intervals that hold for all of them at once.

    This is what Dunnett's test is for (J Am Stat Assoc 1955; 50:1096, doi 10.1080/01621459.1955.10501294): to compare
    with one tracker takes fewer hearts than to order all.

    Parameters
    ----------
    scores : DataFrame
        Hearts by trackers, as :func:`scores` returns them.
    reference : str

    Returns
    -------
    DataFrame
        The other trackers that have a score in every heart, the best first: `score`, `ratio`, `low` and `high`.
    """
    known = scores.loc[:, scores.notna().all().to_numpy(bool)]
    others = known.drop(columns=reference)
    ratios = simultaneous_intervals(others.to_numpy(float) - known[[reference]].to_numpy(float)).ratios
    found = pd.DataFrame(dict(zip(RATIO, ratios, strict=True)), index=others.columns)
    return found.assign(score=np.exp(others.mean())).sort_values("ratio", kind="stable")


RATIO = ("ratio", "low", "high")


def deviation(scores: pd.DataFrame) -> float:
    """Standard deviation over the hearts of the logarithm of the ratio of two scores: median over pairs of trackers."""
    table = scores.loc[:, scores.notna().all().to_numpy(bool)].to_numpy(float)
    one, other = pairs(table.shape[1])
    if len(table) < 2 or not len(one):
        return np.nan
    return float(np.median(np.std(table[:, one] - table[:, other], axis=0, ddof=1)))
