"""Tracking from end-diastole both forwards and backwards; the last frame of a cycle is followed by the first."""

import numpy as np


def forward_backward(frames: int) -> tuple[list[int], list[int]]:
    """Order of the frames of a clip forwards and backwards in time, each starting at end-diastole (frame 0)."""
    return list(range(frames)), [0, *range(frames - 1, 0, -1)]


def inverse_variance_weight(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Weight w = var2 / (var1 + var2) with which the mean w first + (1 - w) second has the least variance.

    Parameters
    ----------
    first, second : ndarray of one shape
        Variances var1, var2 of the values, any unit; infinite where there is no value.

    Returns
    -------
    ndarray of the same shape
        From 0 to 1; 1/2 where both values are missing, or both variances are 0.
    """
    total = first + second
    weight = np.divide(second, total, out=np.full(np.shape(total), 0.5), where=np.isfinite(total) & (total > 0))
    weight[np.isinf(first) & np.isfinite(second)] = 0.0
    weight[np.isinf(second) & np.isfinite(first)] = 1.0
    return weight


def combined_variance(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Variance w^2 var1 + (1 - w)^2 var2 of the mean with the :func:`inverse_variance_weight`; arrays of one shape."""
    return mean_variance(inverse_variance_weight(first, second), first, second)


def mean_variance(weight: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Variance w^2 var1 + (1 - w)^2 var2 of a :func:`weighted_mean`; a value of weight 0 may have an infinite one."""
    total = np.zeros(np.broadcast(weight, first).shape)
    for factor, variance in ((weight, first), (1 - weight, second)):
        total += np.multiply(factor**2, variance, out=np.zeros_like(total), where=factor > 0)
    return total


def weighted_mean(weight: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """w first + (1 - w) second; a value of weight 0 may be NaN."""
    return np.where(weight > 0, weight * first, 0.0) + np.where(weight < 1, (1 - weight) * second, 0.0)
