"""Ratios of the scores of trackers over the same hearts, with simultaneous intervals, and the ranks that they allow.

The logarithm of the ratio of two scores is d_i in heart i, d-bar on average. Two trackers are equal if d is as often
positive as negative by the same amount; then its sign can be flipped in every heart. All comparisons share the signs,
since the scores of one heart depend on each other. The largest |t| of all comparisons is compared with that under
flipped signs, so that any of some equal trackers are ordered in 5 % of cases at most, however many there are and
whatever the distribution of d (Westfall & Young, Resampling-Based Multiple Testing, Wiley 1993; on signs Romano & Wolf,
J Am Stat Assoc 2005; 100:94, doi 10.1198/016214504000000539). With two trackers the test is exact (Fisher, The Design
of Experiments, 1935).

An interval holds the ratios that the test does not reject. For a true value d-bar + x of one comparison and the
estimates of the others, the t of the comparison under flipped signs s reaches that of the data if x is at most

    max(sum(s e) / (n + sum(s)), -sum(s e) / (n - sum(s))),    e_i = d_i - d-bar

and that of another comparison reaches it if x is at most m sqrt(sum(e^2) / (n (1 - m^2))), with m the largest
|sum(s e)| / sqrt(n sum(e^2)) of the others, of which t is sqrt(n - 1) m / sqrt(1 - m^2). The interval ends at the 95th
percentile of the larger of the two over the signs.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats

LEVEL = 0.05
"""Probability that any of some equal trackers are ordered."""

LEAST_HEARTS = 6
"""Least number of hearts in which trackers can be ordered: one of 2^5 = 32 sets of signs is below 5 %, of 16 not."""

ALL_SIGNS = 12
"""Number of hearts up to which all signs are tried; of more, as many are drawn."""

LEAST_SCORE = 0.01
"""NRMSE, %, below which a score counts as this, as a logarithm is needed: far below any rounding of the images."""


class Interval(NamedTuple):
    """Mean logarithms of ratios and the ends of their simultaneous intervals, each (comparison,)."""

    mean: Floats
    low: Floats
    high: Floats

    @property
    def ratios(self) -> Floats:
        """Geometric mean ratio, lower and upper end, (3, comparison)."""
        return np.exp(np.stack(self))


def log_scores(percent: pd.Series) -> pd.Series:
    """Logarithm of a score, %."""
    return np.log(percent.clip(lower=LEAST_SCORE))


def pairs(trackers: int) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Indices of the first and the second tracker of every pair."""
    return np.triu_indices(trackers, 1)


def simultaneous_intervals(differences: ArrayLike) -> Interval:
    """Intervals that all hold at once with a probability of 95 %.

    Parameters
    ----------
    differences : array_like of shape (heart, comparison)
        Of logarithms of scores; all known.

    Returns
    -------
    Interval
        Infinite ends with fewer than `LEAST_HEARTS`; no mean (NaN) with none.
    """
    values = np.asarray(differences, float)
    hearts, comparisons = values.shape
    mean = values.mean(axis=0) if hearts else np.full(comparisons, np.nan)
    if hearts < LEAST_HEARTS or not comparisons:
        return Interval(mean, np.full(comparisons, -np.inf), np.full(comparisons, np.inf))
    residual = values - mean
    squares = (residual**2).sum(axis=0)
    signs = sign_vectors(hearts)
    sums, balance = signs @ residual, signs.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        others = _largest_of_others(np.nan_to_num(np.abs(sums) / np.sqrt(hearts * squares)))
        by_others = others * np.sqrt(squares / (hearts * np.maximum(1 - others**2, np.finfo(float).eps)))
        ends = [
            np.fmax(np.fmax(way * sums / (hearts + balance), -way * sums / (hearts - balance)), by_others)
            for way in (1, -1)
        ]
    place = int(LEVEL * len(signs) + 1e-9)  # the rounding of a product
    for end in ends:
        end[0] = np.inf  # the signs of the data reach themselves whatever the value
        end.partition(len(signs) - 1 - place, axis=0)
    high, low = (end[len(signs) - 1 - place] for end in ends)
    return Interval(mean, mean - low, mean + high)


def rank_ranges(scores: Floats) -> tuple[Floats, Floats]:
    """First and last rank that a tracker can have: those surely before it and those surely behind it are counted.

    Parameters
    ----------
    scores : ndarray of shape (heart, tracker)
        Logarithms, small ones being good.

    Returns
    -------
    first, last : ndarray of shape (tracker,)
        NaN for a tracker that has no score in some heart.
    """
    known = np.flatnonzero(np.isfinite(scores).all(axis=0))
    one, other = pairs(len(known))
    _, low, high = simultaneous_intervals(scores[:, known[one]] - scores[:, known[other]])
    first, last = np.full(scores.shape[1], np.nan), np.full(scores.shape[1], np.nan)
    first[known], last[known] = 1, len(known)
    for better, worse in ((known[one][high < 0], known[other][high < 0]), (known[other][low > 0], known[one][low > 0])):
        np.add.at(first, worse, 1)
        np.add.at(last, better, -1)
    return first, last


@lru_cache(maxsize=4)
def sign_vectors(hearts: int) -> Floats:
    """Signs of the hearts, (flip, heart), first those of the data; opposite ones count once."""
    if hearts <= ALL_SIGNS:
        bits = np.arange(2 ** (hearts - 1))[:, None] >> np.arange(hearts) & 1
        return np.where(bits, -1.0, 1.0)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (2**ALL_SIGNS, hearts))
    signs[0] = 1
    return signs


def _largest_of_others(values: Floats) -> Floats:
    """Largest value of each row (flip, comparison) but that of the comparison itself; 0 if there is no other."""
    if values.shape[1] < 2:
        return np.zeros_like(values)
    second, largest = np.partition(values, values.shape[1] - 2, axis=1)[:, -2:].T
    return np.where(values == largest[:, None], second[:, None], largest[:, None])
