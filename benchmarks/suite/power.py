"""Which differences between trackers a number of hearts can show, by simulation.

Logarithms of scores are drawn from normal distributions, of equal trackers, and compared as those of the hearts are
(:mod:`echotruth.evaluation.paired_ratios`). An effect moves a comparison by the logarithm of the ratio and leaves the
width of its interval, so that one simulation serves all effects.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from echotruth.arrays import Floats
from echotruth.evaluation.paired_ratios import pairs, simultaneous_intervals

SAMPLES = 1000
"""Number of simulated boards."""

TRACKERS = 10
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


DISEASE_EFFECT = 0.05
"""Standard deviation over diseases of what the hearts of one share of the logarithm of a ratio: 0.05 to 0.07 in the
trackers of the suite. It has no mean over the hearts, since ranks are those in this mix of diseases."""


def simulate(groups: ArrayLike, deviation: float, is_against_one: bool, disease_effect: float = 0.0) -> Power:
    """Simulate boards.

    Parameters
    ----------
    groups : array_like of shape (heart,)
        Disease of each heart; at least :data:`echotruth.evaluation.paired_ratios.LEAST_HEARTS`.
    deviation : float
        Standard deviation of the logarithm of the ratio of two scores over hearts.
    is_against_one : bool
        Whether the trackers are compared with one of them, and not each with each.
    disease_effect : float
        As :data:`DISEASE_EFFECT`, of which the deviation is then made up too.

    Returns
    -------
    Power
    """
    one, other = pairs(TRACKERS)
    if is_against_one:
        one, other = one[one == 0], other[one == 0]
    diseases, of_heart = np.unique(groups, return_inverse=True)
    random = np.random.default_rng(len(of_heart))
    own = np.sqrt((deviation**2 - disease_effect**2) / 2)
    low, high = [], []
    for _ in range(SAMPLES):
        shared = random.normal(0, disease_effect / np.sqrt(2), (len(diseases), TRACKERS))[of_heart]
        scores = random.normal(0, own, shared.shape) + shared - shared.mean(axis=0)
        interval = simultaneous_intervals(scores[:, one] - scores[:, other])
        low.append(interval.low)
        high.append(interval.high)
    return Power(np.array(low), np.array(high))
