"""Grey values of clips: normalisation, inversion of the log compression, gain, and local correlation of two images."""

from math import log
from typing import Any

import numpy as np

DYNAMIC_RANGE = 45.0
"""Dynamic range by which log compression is undone, dB, where a clip is judged: grey values of speckle differ too
little from one another beside the edges of the wall, which look alike in all frames."""
MIN_GAIN_DB = -30.0
"""Gain over a typical one that :func:`even_gain` makes up for at most."""
PIXELS_PER_DEVIATION = 4
"""Pixels per standard deviation with which a Gaussian mean is computed, at least."""
MIN_STD = 1 / 255
"""Standard deviation of grey values below which a window has no texture: one level of an 8-bit image."""


def grey_levels(frames: np.ndarray) -> np.ndarray:
    """Grey values from 0 to 1.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        Any real type.

    Returns
    -------
    ndarray of the same shape, float32
        8-bit values over 255; for any other type (value - min) / (max - min) of the clip. NaN where not finite.
    """
    if frames.dtype == np.uint8:
        return frames * np.float32(1 / 255)
    known = np.isfinite(frames)
    values = np.where(known, frames, np.nan).astype(float)
    low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
    return ((values - low) / ((high - low) or 1.0)).astype(np.float32)


def decompress(grey: np.ndarray, decibels: float) -> np.ndarray:
    """Amplitude of the echoes, from log-compressed grey values.

    a = (exp(k g) - 1) / k with k = decibels ln(10) / 20: 0 for black, and equal to g in the limit of small g.

    Parameters
    ----------
    grey : ndarray of any shape
        Grey values g from 0 to 1.
    decibels : float
        Dynamic range from black to white, dB; 0 returns the grey values.

    Returns
    -------
    ndarray of the same shape and type
    """
    k = _nepers(decibels)
    return (np.exp(k * grey) - 1) / k if k else grey


def amplitudes(frames: np.ndarray, decibels: float) -> np.ndarray:
    """Amplitudes (frame, axial, lateral) of a clip of any real type, see :func:`grey_levels` and :func:`decompress`."""
    return decompress(grey_levels(frames), decibels)


def rms(values: np.ndarray) -> float:
    """Root mean square of values of any shape; 0 of none."""
    return float(np.sqrt(np.mean(np.square(values, dtype=float)))) if values.size else 0.0


def even_gain(amplitude: np.ndarray, deviation: Any, typical: float) -> np.ndarray:
    """Amplitudes of the same brightness everywhere: over their local RMS, times a typical one.

    Shadow, depth and obliquity of the wall change the gain slowly from place to place. Where it is low, speckle is as
    good as elsewhere, but would not count in least squares. Compare the divisive normalisation of Jarrett et al. 2009,
    IEEE ICCV, 2146. Black pixels say nothing of the gain and do not count. Below `MIN_GAIN_DB` it is made up for only
    in part, lest noise becomes as bright as tissue.

    Parameters
    ----------
    amplitude : ndarray of shape (axial, lateral) or (depth, elevation, lateral), float32
    deviation : float or ndarray of shape (3,)
        Standard deviation of the Gaussian weights of the local RMS, px; of a volume along each axis.
    typical : float
        Typical RMS of the amplitude in the wall.

    Returns
    -------
    ndarray of the same shape and type
        The amplitudes as they are if `typical` is 0.
    """
    if not typical > 0:
        return amplitude
    power = _local_power(amplitude, deviation) if amplitude.ndim == 2 else _volume_power(amplitude, deviation)
    return amplitude / np.sqrt(power / np.float32(typical**2) + np.float32(10 ** (MIN_GAIN_DB / 10)))


def _local_power(amplitude: np.ndarray, deviation: float) -> np.ndarray:
    import cv2  # whoever brings a tracker needs none

    size = amplitude.shape[::-1]
    # The mean is so smooth that a few pixels per standard deviation give it.
    side = max(1, int(deviation / PIXELS_PER_DEVIATION))
    reduced = tuple(max(1, length // side) for length in size)
    total = np.stack([amplitude * amplitude, (amplitude > 0).astype(amplitude.dtype)], -1)
    total = cv2.resize(total, reduced, interpolation=cv2.INTER_AREA)
    total = cv2.GaussianBlur(total, (0, 0), deviation / side, borderType=cv2.BORDER_REFLECT)
    mean = total[..., 0] / np.maximum(total[..., 1], np.float32(1e-6))
    return cv2.resize(mean, size, interpolation=cv2.INTER_LINEAR)


def _volume_power(amplitude: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    from scipy import ndimage  # whoever brings a tracker needs none

    side = np.maximum(1, (deviation / PIXELS_PER_DEVIATION).astype(int))
    reduced = np.maximum(1, amplitude.shape // side)
    kept = amplitude[tuple(map(slice, np.minimum(reduced * side, amplitude.shape)))]
    blocks = np.stack([kept.shape // reduced, reduced])[::-1].T.ravel()
    total = [
        ndimage.gaussian_filter(values.reshape(blocks).mean((1, 3, 5)), deviation / side)
        for values in (kept * kept, (kept > 0).astype(kept.dtype))
    ]
    mean = total[0] / np.maximum(total[1], np.float32(1e-6))
    zoom = np.array(amplitude.shape) / reduced
    return ndimage.zoom(mean, zoom, order=1, mode="nearest", grid_mode=True)


def decompression_slope(amplitude: np.ndarray, decibels: float) -> np.ndarray:
    """Derivative da/dg = 1 + k a of :func:`decompress` at amplitudes a; same shape."""
    return 1 + _nepers(decibels) * amplitude


def _nepers(decibels: float) -> float:
    return decibels * log(10) / 20


def local_ncc(first: np.ndarray, second: np.ndarray, side: int) -> np.ndarray:
    """Zero-normalised cross-correlation of two images in a square around every pixel.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral)
        Grey values from 0 to 1.
    side : int
        Side of the square, px, odd; images are mirrored at their borders.

    Returns
    -------
    ndarray of shape (axial, lateral)
        From -1 to 1; NaN where the square has no texture in either image, or contains a pixel without a value.
    """
    import cv2

    known = np.isfinite(first) & np.isfinite(second)
    a, b = (np.where(known, image, 0).astype(float) for image in (first, second))
    # OpenCV takes running sums, whose rounding depends on where a thread begins.
    cv2.setNumThreads(1)
    images = (a, b, a * a, b * b, a * b, 1.0 - known)
    a, b, aa, bb, ab, unknown = (cv2.blur(image, (side, side), borderType=cv2.BORDER_REFLECT) for image in images)
    variances = aa - a**2, bb - b**2
    valid = (np.minimum(*variances) > MIN_STD**2) & (unknown < 0.5 / side**2)
    product = np.where(valid, variances[0] * variances[1], np.nan)
    return np.clip((ab - a * b) / np.sqrt(product), -1, 1)
