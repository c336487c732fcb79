"""Statistics over the points of parts of the wall; values that are not numbers are left out.

Values are of shape (..., point, k) and masks of shape (mask, point); results are of shape (..., mask, k), NaN where a
mask holds too few points.
"""

from __future__ import annotations

import numpy as np


def mean(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Mean over the points of each mask, in the unit of the values."""
    parts = [value[..., mask, :] for mask in masks]
    total = np.stack([np.nansum(part, axis=-2) for part in parts], -2)
    return ratio(total, np.stack([np.isfinite(part).sum(-2) for part in parts], -2))


def rms(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Root mean square, in the unit of the values."""
    return np.sqrt(mean(value**2, masks))


def deviation(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Standard deviation about the mean of each mask, in the unit of the values; one point has none."""
    spread = np.sqrt(_variance(value, value, masks))
    count = np.stack([np.isfinite(value[..., mask, :]).sum(-2) for mask in masks], -2)
    return np.where(count > 1, spread, np.nan)


def correlation(first: np.ndarray, second: np.ndarray, masks: np.ndarray, alike: float) -> np.ndarray:
    """Pearson correlation.

    Parameters
    ----------
    first, second : ndarray of shape (..., point, k)
        In one unit.
    masks : ndarray of shape (mask, point), bool
    alike : float
        Standard deviation, in the unit of the values, up to which they are alike, for so much is rounding. That of
        single precision, in which results are kept, is rounding in any case.

    Returns
    -------
    ndarray of shape (..., mask, k)
        Over the points of each mask at which both are known, from -1 to 1; NaN where either is alike at all points.
    """
    both = np.isfinite(first) & np.isfinite(second)
    first, second = (np.where(both, value, np.nan) for value in (first, second))
    spreads = (_spread(value, masks, alike) for value in (first, second))
    return ratio(_variance(first, second, masks), np.prod(list(spreads), axis=0))


def quantile(value: np.ndarray, masks: np.ndarray, share: float) -> np.ndarray:
    """Value that a share of the points of each mask does not exceed: (point,), (mask, point) to (mask,)."""
    parts = (value[mask & np.isfinite(value)] for mask in masks)
    return np.array([np.quantile(part, share) if part.size else np.nan for part in parts])


def ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Quotient, NaN where the divisor is zero or NaN."""
    whole = np.asarray(whole, float)
    return np.divide(part, whole, out=np.full(whole.shape, np.nan), where=whole > 0)


def _spread(value: np.ndarray, masks: np.ndarray, alike: float) -> np.ndarray:
    """Standard deviation, 0 where it is rounding."""
    spread = np.sqrt(_variance(value, value, masks))
    rounding = np.maximum(alike, np.finfo(np.float32).eps * rms(value, masks))
    return np.where(spread <= rounding, 0, spread)


def _variance(first: np.ndarray, second: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Mean product of the deviations of two values from their means."""
    product = [
        mean((first - mean(first, mask)) * (second - mean(second, mask)), mask) for mask in np.asarray(masks)[:, None]
    ]
    return np.concatenate(product, -2)
