"""A clip followed from end-diastole forwards and backwards, for after its last frame the first would come again."""

from __future__ import annotations

import numpy as np


def ways(frames: int) -> tuple[list[int], list[int]]:
    """Numbers of the frames of a clip as they come forwards and as they come backwards, both from end-diastole on."""
    return list(range(frames)), [0, *range(frames - 1, 0, -1)]


def share(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Weight of a value in its mean with another that makes the variance of the mean least.

    Parameters
    ----------
    ours, theirs : ndarray of one shape
        Variances of the two, of any unit; infinite where there is no value.

    Returns
    -------
    ndarray of the same shape
        From 0 to 1; a half where neither value is there, or neither has a variance.
    """
    total = ours + theirs
    result = np.divide(theirs, total, out=np.full(np.shape(total), 0.5), where=np.isfinite(total) & (total > 0))
    result[np.isinf(ours) & np.isfinite(theirs)] = 0.0
    result[np.isinf(theirs) & np.isfinite(ours)] = 1.0
    return result


def blend(share: np.ndarray, ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Mean of two arrays of one shape, ours with the weight `share`; what has no weight need not be a number."""
    return np.where(share > 0, share * ours, 0.0) + np.where(share < 1, (1 - share) * theirs, 0.0)
