"""Trackers over hearts: their order, paired differences, the ranks they allow, and limits of agreement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.agreement import Z
from echotruth.evaluation.resampling import CLIP, LEVELS, STATISTICS, draws, interval, means_of_hearts

LEAST_HEARTS = 5
"""Number of hearts from which on one tracker can surely be before another: in fewer, it is better in all of them by
chance in more than one case of twenty."""


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


def bland_altman(tracked: Floats, true: Floats) -> dict[str, float]:
    """Bias and limits of agreement over hearts, with their 95 % confidence intervals.

    The limits are those of :func:`limits_of_agreement`. With d and s the mean and the standard deviation of n
    differences that are normal, sqrt(n) (limit - d) / s of the true limit follows the noncentral t distribution with n
    - 1 degrees of freedom and noncentrality -/+ 1.96 sqrt(n), whose quantiles give the exact interval of each limit
    (Carkeet, Optom Vis Sci 2015; 92:e71, doi 10.1097/OPX.0000000000000513).

    Parameters
    ----------
    tracked, true : ndarray of shape (heart,)
        One value of each heart, as GLS; NaN where unknown.

    Returns
    -------
    dict of float
        bias, lower and upper (limit), in the unit of the values, each with its interval as `_low` and `_high`; and
        hearts, the number of those of which both are known. NaN with fewer than two of them, but for the bias of one.
    """
    from scipy.stats import nct, t

    difference = np.asarray(tracked, float) - np.asarray(true, float)
    difference = difference[np.isfinite(difference)]
    n = len(difference)
    names = [f"{name}{end}" for name in ("bias", "lower", "upper") for end in ("", "_low", "_high")]
    if n < 2:
        return dict.fromkeys(names, np.nan) | {"bias": float(difference.sum()) if n else np.nan, "hearts": float(n)}
    mean, deviation = float(np.mean(difference)), float(np.std(difference, ddof=1))
    error = deviation / np.sqrt(n)
    values = [mean, *(mean + error * t.ppf(LEVELS, n - 1))]
    for z in (-Z, Z):
        # The quantiles are those of the upper limit, mirrored for the lower one: SciPy's are exact for positive ones.
        quantiles = nct.ppf(LEVELS, n - 1, Z * np.sqrt(n))
        values += [mean + z * deviation, *(mean + error * (quantiles if z > 0 else -quantiles[::-1]))]
    return dict(zip(names, map(float, values), strict=True)) | {"hearts": float(n)}
