"""Size of the speckle in the image of a wall, which says how well a place can be found there."""

from typing import Any

import cv2
import numpy as np
from scipy import ndimage

from echotruth.tracking.grey import DYNAMIC_RANGE, decompress, even_gain, grey_levels, rms

GAIN_SHARE, MEAN_SHARE = 0.05, 0.02
"""Standard deviations of the Gaussian weights of the local gain, and of the local mean from which speckle is counted,
over the side of the image: several speckles, and less than the wall."""


def speckle_length(frame: np.ndarray, mask: np.ndarray, ratio: Any = 1.0) -> float:
    """Correlation length l of the speckle in the wall, the quadratic mean of those along all axes, px.

    A Gaussian correlation function exp(-x^2 / 2 l^2) has the mean square derivative var / l^2. By the bound of Cramer
    and Rao, a shift between two images of correlation rho has a variance in proportion to l^2 (1 / rho^2 - 1) along
    each axis (Walker and Trahey 1995, IEEE Trans Ultrason Ferroelectr Freq Control 42:301). Across the beam l is larger
    than along it.

    Parameters
    ----------
    frame : ndarray of shape (axial, lateral) or (depth, elevation, lateral)
        Any real type; NaN is taken as the darkest value.
    mask : ndarray of the same shape, bool
        The wall.
    ratio : ndarray of shape (3,), optional
        Of a volume, see :attr:`.tracker_input.TrackerInput.ratio`; the length is in the finest spacing.

    Returns
    -------
    float
        1 without texture.
    """
    amplitude = decompress(np.nan_to_num(grey_levels(frame[None])[0]), DYNAMIC_RANGE)
    pixel = np.broadcast_to(ratio, mask.ndim)[::-1]
    side = max(np.array(mask.shape) * pixel)
    even = even_gain(amplitude, GAIN_SHARE * side / (pixel if mask.ndim == 3 else 1), rms(amplitude[mask]))
    weight = mask.astype(np.float32)
    blurred = [_blurred(image, MEAN_SHARE * side / pixel) for image in (even * weight, weight)]
    variance = np.mean((even - blurred[0] / np.maximum(blurred[1], 1e-6))[mask] ** 2) if mask.any() else 0.0
    gradients = np.gradient(even, *pixel)
    slopes = [float(np.mean(slope[mask] ** 2)) for slope in gradients] if variance > 0 else [0.0]
    return float(np.sqrt(np.mean(variance / np.array(slopes)))) if min(slopes) > 0 else 1.0


def _blurred(image: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """An image or a volume blurred by a Gaussian, of which the standard deviation is given along each axis, px."""
    if image.ndim == 2:
        return cv2.GaussianBlur(image, (0, 0), float(deviation[0]))
    return ndimage.gaussian_filter(image, deviation)
