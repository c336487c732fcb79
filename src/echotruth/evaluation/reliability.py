"""Whether the quality that trackers give is the probability of being right: that of an error below a distance.

A tracker is calibrated if of the points of which it is sure to 0.8, 80 % are right (DeGroot & Fienberg, The
Statistician 1983; 32:12, doi 10.2307/2987588).
"""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.statistics import ratio

BINS = 10
"""Number of equal steps of quality from 0 to 1."""

WITHIN = 1.0
"""Error below which a point is right, 1/256 of the side of the image."""

COUNTS = ("count", "quality_sum", "within_count")
"""Columns that are added over clips."""

COLUMNS = ("quality_low", "quality_high", *COUNTS)
"""Columns of the rows of steps."""


def judged(quality: Floats, displacement: Floats) -> slice:
    """Frames in which a quality (frame, ...) is judged: all but the first; none of a tracker that finds a displacement
    (frame, ...) and states no quality."""
    is_stated = bool(np.isfinite(quality).any() or np.isnan(displacement).all())
    return slice(1 if is_stated else len(quality), None)


def counts(quality: Floats, within: NDArray[np.bool_]) -> list[dict[str, float]]:
    """Number of points by their quality, and how many of them are right.

    Parameters
    ----------
    quality : ndarray of any shape
        0 to 1; NaN, of a point without an estimate, counts as 0.
    within : ndarray of the same shape, bool
        Whether the point is right.

    Returns
    -------
    list of dict
        One for each step of quality, with quality_low, quality_high, count, quality_sum and within_count.
    """
    return [
        {"quality_low": k / BINS, "quality_high": (k + 1) / BINS} | dict(zip(COUNTS, map(float, values), strict=True))
        for k, values in enumerate(zip(*_counts(quality, within), strict=True))
    ]


def summary(quality: Floats, within: NDArray[np.bool_]) -> dict[str, float]:
    """Calibration of one clip.

    Parameters
    ----------
    quality, within
        As for :func:`counts`.

    Returns
    -------
    dict of float
        quality_percent, the mean quality; within_percent, the share of right points; calibration_error_percent, the
        expected calibration error (Naeini et al., Proc AAAI 2015; 29, doi 10.1609/aaai.v29i1.9602); brier_score, the
        mean of (quality - right)^2 (Brier, Mon Weather Rev 1950; 78:1).
    """
    stated = np.clip(np.nan_to_num(quality, nan=0.0), 0, 1)
    nothing = not stated.size
    return {
        "quality_percent": np.nan if nothing else float(100 * np.mean(stated)),
        "within_percent": np.nan if nothing else float(100 * np.mean(within)),
        "calibration_error_percent": expected_error(*_counts(quality, within)),
        "brier_score": np.nan if nothing else float(np.mean((stated - within) ** 2)),
    }


def _counts(quality: Floats, within: NDArray[np.bool_]) -> list[Floats]:
    """Columns of `COUNTS`, each (step,)."""
    stated = np.clip(np.nan_to_num(quality, nan=0.0), 0, 1).ravel()
    step = np.minimum((stated * BINS).astype(int), BINS - 1)
    weights = np.ones(stated.size), stated, within.ravel().astype(float)
    return [np.asarray(np.bincount(step, weight, BINS), float) for weight in weights]


def expected_error(count: Floats, quality_sum: Floats, within_count: Floats) -> float:
    """Mean difference of stated and observed share over the points, in %, from counts by step (step,)."""
    apart = np.abs(quality_sum - within_count).sum()
    return float(100 * ratio(np.asarray(apart, float), np.asarray(count.sum(), float)))
