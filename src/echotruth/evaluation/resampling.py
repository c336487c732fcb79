"""Bootstrap over hearts: intervals of means and medians, paired differences of trackers, and the ranks they allow.

Clips of one heart resemble each other, so that hearts and not clips are drawn with replacement (Efron, Ann Stat 1979;
7:1, doi 10.1214/aos/1176344552; Field & Welsh, J R Stat Soc B 2007; 69:369, doi 10.1111/j.1467-9868.2007.00593.x, on
clusters). Intervals are the middle 95 % of the statistics of the samples, in which all trackers share the hearts. With
few hearts they are too narrow: of normal values, those of the mean of 6, 12 and 24 hold it in 86, 90 and 93 of 100
cases, those of the median in 93, 94 and 94.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

if TYPE_CHECKING:
    import pandas as pd

RESAMPLES = 2000
"""Number of bootstrap samples."""

LEVELS = (0.025, 0.975)
"""Quantiles at which an interval ends."""

STATISTICS: dict[str, Callable[..., Floats]] = {"mean": np.mean, "median": np.median}
"""What is said of the values of the hearts; a value that is not known makes it unknown."""

LEAST_HEARTS = 5
"""Number of hearts from which on one tracker can surely be before another: in fewer, it is better in all of them by
chance in more than one case of twenty."""

CLIP = ("repository", "case", "view", "size_px")
"""Columns that identify a clip; tables of a single repository lack the first."""


def draws(hearts: int, seed: int) -> NDArray[np.int64]:
    """Indices of the hearts of every bootstrap sample, (sample, heart), drawn with replacement.

    Parameters
    ----------
    hearts : int
        Their number.
    seed : int
    """
    return np.random.default_rng(seed).integers(hearts, size=(RESAMPLES, hearts))


def interval(values: Floats, resamples: NDArray[np.integer], statistic: str = "mean") -> tuple[Floats, Floats]:
    """Bootstrap interval of the mean or median over hearts.

    Parameters
    ----------
    values : ndarray of shape (heart, k)
        Any unit.
    resamples : ndarray of shape (sample, heart), integer
        Indices of the hearts drawn with replacement.
    statistic : {"mean", "median"}

    Returns
    -------
    low, high : ndarray of shape (k,)
        2.5th and 97.5th percentile; NaN with a single heart, and where a value is NaN.
    """
    if len(values) < 2:
        return np.full(values.shape[1], np.nan), np.full(values.shape[1], np.nan)
    return percentiles(STATISTICS[statistic](values[resamples], axis=1), len(values))


def percentiles(samples: Floats, hearts: int) -> tuple[Floats, Floats]:
    """2.5th and 97.5th percentile of bootstrap samples (sample, k), each (k,); NaN with fewer than two hearts."""
    if hearts < 2:
        return np.full(samples.shape[1], np.nan), np.full(samples.shape[1], np.nan)
    low, high = np.quantile(samples, LEVELS, axis=0, method="inverted_cdf")
    return low, high


def ranks(values: Floats) -> Floats:
    """Rank along the last axis, 1 for the smallest; equal values share the better rank, NaN has none."""
    better = (values[..., None, :] < values[..., :, None]).sum(-1)
    return np.where(np.isfinite(values), 1.0 + better, np.nan)


def means_of_hearts(clips: pd.DataFrame, columns: Sequence[str], heart: str = "case") -> pd.DataFrame:
    """Means over the clips of each heart; NaN where a clip lacks a value.

    Clips in which no tracker has the metric, such as the short axis for E_LL, are left out, unless a tracker failed.

    Parameters
    ----------
    clips : DataFrame
        Columns `tracker`, `failure`, those of `CLIP`, and the metrics.
    columns : sequence of str
        Metrics.
    heart : str
        Column that tells the hearts apart.

    Returns
    -------
    DataFrame
        Columns as given; one row per `tracker` and heart.
    """
    columns = list(columns)
    missing, failed = clips[columns].isna(), (clips["failure"] != "").to_numpy()[:, None]
    measurable = (~missing).groupby([clips[name] for name in CLIP if name in clips]).transform("any")
    rows = [clips["tracker"], clips[heart]]
    incomplete = (missing & (measurable | failed)).groupby(rows, sort=False).any()
    return clips[columns].groupby(rows, sort=False).mean().mask(incomplete)


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


def standing(values: pd.DataFrame, seed: int = 1, statistic: str = "median", descending: bool = False) -> pd.DataFrame:
    """Order of trackers, with what is known of it.

    Parameters
    ----------
    values : DataFrame
        Hearts as rows, trackers as columns, as :func:`by_heart` returns it.
    seed : int
        Of the bootstrap.
    statistic : {"mean", "median"}
        Over the hearts.
    descending : bool
        Whether large values are good.

    Returns
    -------
    DataFrame
        Trackers as rows, the best first; those with a heart without a value last, in the order given. `hearts`, their
        number; `value`, the statistic, with its interval `low` to `high`; `difference`, the statistic over the hearts
        of the value less that of the first tracker, with `difference_low` and `difference_high`; `p_value`, that of
        Wilcoxon's signed-rank test of these differences, adjusted for the number of trackers (Holm, Scand J Stat 1979;
        6:65); and `rank_first` to `rank_last`, the ranks that are possible: a tracker is surely before another one if
        the interval of their paired difference does not reach 0, which takes :data:`LEAST_HEARTS`. NaN where there is
        no value, and intervals of a single heart.
    """
    import pandas as pd

    sign = -1.0 if descending else 1.0
    table = sign * values.to_numpy(float)
    resamples, middle = draws(len(table), seed), STATISTICS[statistic]
    known = np.isfinite(table).all(axis=0) & (len(table) > 0)
    value = middle(table, axis=0) if len(table) else np.full(table.shape[1], np.nan)
    order = np.argsort(np.where(known, value, np.inf), kind="stable")
    table, known, value = table[:, order], known[order], value[order]
    low, high = interval(table, resamples, statistic)
    ahead, behind = _sure(table, resamples, statistic)
    difference = table - table[:, :1]
    differs_low, differs_high = interval(difference, resamples, statistic)
    p_value = [np.nan, *_holm([_signed_rank(column) for column in difference.T[1:]])]
    found = {
        "hearts": len(table),
        "value": sign * np.where(known, value, np.nan),
        "low": sign * (high if descending else low),
        "high": sign * (low if descending else high),
        "difference": sign * middle(difference, axis=0) if len(table) else np.nan,
        "difference_low": sign * (differs_high if descending else differs_low),
        "difference_high": sign * (differs_low if descending else differs_high),
        "p_value": p_value[: len(order)],
        "rank_first": np.where(known, 1.0 + behind, np.nan),
        "rank_last": np.where(known, known.sum() - ahead, np.nan),
    }
    return pd.DataFrame(found, index=pd.Index(values.columns[order], name="tracker"))


def paired(values: pd.DataFrame, seed: int = 1, statistic: str = "median") -> pd.DataFrame:
    """Differences of all pairs of trackers, over the same hearts.

    Parameters
    ----------
    values, seed, statistic
        As for :func:`standing`.

    Returns
    -------
    DataFrame
        A row per pair, in the order of the columns: `first`, `second`, `hearts`, and of the first less the second
        `difference`, `low`, `high` and `p_value`, as :func:`standing` has them, adjusted for the number of pairs.
    """
    import pandas as pd

    names, table = list(values.columns), values.to_numpy(float)
    one, other = np.triu_indices(len(names), 1)
    difference = table[:, one] - table[:, other]
    low, high = interval(difference, draws(len(table), seed), statistic)
    found = {
        "first": [names[i] for i in one],
        "second": [names[i] for i in other],
        "hearts": len(table),
        "difference": STATISTICS[statistic](difference, axis=0) if len(table) else np.nan,
        "low": low,
        "high": high,
        "p_value": _holm([_signed_rank(column) for column in difference.T]),
    }
    return pd.DataFrame(found)


def _sure(values: Floats, resamples: NDArray[np.integer], statistic: str) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Number of columns that each of (heart, k) is surely before, and surely behind."""
    hearts, k = values.shape
    difference = (values[:, :, None] - values[:, None, :]).reshape(hearts, k * k)
    _, high = interval(difference, resamples, statistic)
    before = (high.reshape(k, k) < 0) & (hearts >= LEAST_HEARTS)
    return before.sum(axis=1), before.sum(axis=0)


def _signed_rank(difference: Floats) -> float:
    """P-value of Wilcoxon's signed-rank test, two-sided; NaN with fewer than two hearts or a value not known."""
    if len(difference) < 2 or not np.isfinite(difference).all():
        return np.nan
    if not difference.any():
        return 1.0
    from scipy.stats import wilcoxon

    return float(wilcoxon(difference).pvalue)


def _holm(p_values: Sequence[float]) -> Floats:
    """P-values adjusted for their number by Holm's method; NaN stays and does not count."""
    adjusted = np.array(p_values, float)
    rising = np.argsort(adjusted)[: np.isfinite(adjusted).sum()]  # NaN is sorted last
    tests_left = np.arange(len(rising), 0, -1)
    adjusted[rising] = np.maximum.accumulate(np.minimum(1.0, tests_left * adjusted[rising]))
    return adjusted
