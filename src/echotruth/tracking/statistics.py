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


def correlation(first: np.ndarray, second: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Pearson correlation over the points of each mask at which both are known, from -1 to 1."""
    both = np.isfinite(first) & np.isfinite(second)
    first, second = (np.where(both, value, np.nan) for value in (first, second))
    product = np.sqrt(_variance(first, first, masks) * _variance(second, second, masks))
    return ratio(_variance(first, second, masks), product)


def quantile(value: np.ndarray, masks: np.ndarray, share: float) -> np.ndarray:
    """Value that a share of the points of each mask does not exceed: (point,), (mask, point) to (mask,)."""
    parts = (value[mask & np.isfinite(value)] for mask in masks)
    return np.array([np.quantile(part, share) if part.size else np.nan for part in parts])


def ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Quotient, NaN where the divisor is zero or NaN."""
    whole = np.asarray(whole, float)
    return np.divide(part, whole, out=np.full(whole.shape, np.nan), where=whole > 0)


def _variance(first: np.ndarray, second: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Mean product of the deviations of two values from their means."""
    product = [
        mean((first - mean(first, mask)) * (second - mean(second, mask)), mask) for mask in np.asarray(masks)[:, None]
    ]
    return np.concatenate(product, -2)
