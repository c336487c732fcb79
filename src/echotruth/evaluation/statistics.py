"""Statistics of values at points of the wall over masks; NaN values are left out.

Values have the shape (..., point, k), masks (mask, point) and results (..., mask, k), with NaN where a mask holds too
few points.
"""

import numpy as np


def mean(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Mean over the points of each mask, sum(x_i) / n, in the unit of the values."""
    parts = [value[..., mask, :] for mask in masks]
    total = np.stack([np.nansum(part, axis=-2) for part in parts], -2)
    return ratio(total, np.stack([np.isfinite(part).sum(-2) for part in parts], -2))


def rms(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Root mean square, sqrt(mean(x_i^2)), in the unit of the values."""
    return np.sqrt(mean(value**2, masks))


def standard_deviation(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Standard deviation, sqrt(mean((x_i - mean(x))^2)), in the unit of the values; NaN for a single point."""
    count = np.stack([np.isfinite(value[..., mask, :]).sum(-2) for mask in masks], -2)
    return np.where(count > 1, np.sqrt(_covariance(value, value, masks)), np.nan)


def correlation(first: np.ndarray, second: np.ndarray, masks: np.ndarray, rounding: float) -> np.ndarray:
    """Pearson correlation, cov(x, y) / (sd(x) sd(y)).

    Parameters
    ----------
    first, second : ndarray of shape (..., point, k)
        In the same unit.
    masks : ndarray of shape (mask, point), bool
    rounding : float
        Standard deviation, in the unit of the values, that rounding alone can cause; values that vary no more are
        constant. The rounding of single precision, in which results are stored, is always taken into account.

    Returns
    -------
    ndarray of shape (..., mask, k)
        From -1 to 1, over the points of each mask at which both are known; NaN where either is constant.
    """
    known = np.isfinite(first) & np.isfinite(second)
    first, second = (np.where(known, value, np.nan) for value in (first, second))
    deviations = [_deviation_above(rounding, value, masks) for value in (first, second)]
    return ratio(_covariance(first, second, masks), np.prod(deviations, axis=0))


def quantile(value: np.ndarray, masks: np.ndarray, probability: float) -> np.ndarray:
    """Quantile over the points of each mask: (point,), (mask, point) to (mask,)."""
    parts = (value[mask & np.isfinite(value)] for mask in masks)
    return np.array([np.quantile(part, probability) if part.size else np.nan for part in parts])


def ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Quotient, NaN where the denominator is zero or NaN."""
    denominator = np.asarray(denominator, float)
    return np.divide(numerator, denominator, out=np.full(denominator.shape, np.nan), where=denominator > 0)


def _deviation_above(rounding: float, value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Standard deviation, 0 where it is no larger than the rounding."""
    deviation = np.sqrt(_covariance(value, value, masks))
    threshold = np.maximum(rounding, np.finfo(np.float32).eps * rms(value, masks))
    return np.where(deviation <= threshold, 0, deviation)


def _covariance(first: np.ndarray, second: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Covariance, mean((x_i - mean(x)) (y_i - mean(y)))."""
    product = [
        mean((first - mean(first, mask)) * (second - mean(second, mask)), mask) for mask in np.asarray(masks)[:, None]
    ]
    return np.concatenate(product, -2)
