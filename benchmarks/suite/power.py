"""Which differences between trackers a number of hearts can show, by simulation.

Logarithms of scores are drawn from normal distributions, of equal trackers, and compared as those of the hearts are
(:mod:`echotruth.evaluation.paired_ratios`). An effect moves a comparison by the logarithm of the ratio and leaves the
width of its interval, so that one simulation serves all effects.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echotruth.arrays import Floats
from echotruth.evaluation.paired_ratios import pairs, simultaneous_intervals

SAMPLES = 1000
"""Number of simulated boards."""

TRACKERS = 8
"""Number of trackers in them."""

FOUND = 0.8
"""Power at which an effect is said to be shown."""


class Power(NamedTuple):
    """Simulated boards of equal trackers.

    Attributes
    ----------
    low : ndarray of shape (sample, comparison)
        Lower end of the interval of the logarithm of a ratio, of which the truth is 0.
    high : ndarray of shape (sample, comparison)
    """

    low: Floats
    high: Floats

    @property
    def false_order(self) -> float:
        """Share of the boards in which two equal trackers are ordered."""
        return float(np.mean(((self.low > 0) | (self.high < 0)).any(axis=1)))

    def of(self, less: float) -> float:
        """Probability that a tracker is distinguished from one whose score it undercuts by a share, as 0.1."""
        return float(np.mean(self.low > np.log1p(-less)))

    @property
    def least(self) -> float:
        """Share less that is found with the probability `FOUND`."""
        return float(1 - np.exp(np.quantile(self.low, 1 - FOUND)))


def simulate(hearts: int, deviation: float, is_against_one: bool) -> Power:
    """Simulate boards.

    Parameters
    ----------
    hearts : int
        At least :data:`echotruth.evaluation.paired_ratios.LEAST_HEARTS`.
    deviation : float
        Standard deviation of the logarithm of the ratio of two scores over hearts.
    is_against_one : bool
        Whether the trackers are compared with one of them, and not each with each.

    Returns
    -------
    Power
    """
    one, other = pairs(TRACKERS)
    if is_against_one:
        one, other = one[one == 0], other[one == 0]
    random = np.random.default_rng(hearts)
    low, high = [], []
    for _ in range(SAMPLES):
        scores = random.normal(0, deviation / np.sqrt(2), (hearts, TRACKERS))
        interval = simultaneous_intervals(scores[:, one] - scores[:, other])
        low.append(interval.low)
        high.append(interval.high)
    return Power(np.array(low), np.array(high))
