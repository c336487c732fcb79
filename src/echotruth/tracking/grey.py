"""Grey values of clips, and where they tell one place from another."""

from __future__ import annotations

from math import log

import cv2
import numpy as np

FAINTEST = 1 / 255
"""Standard deviation of a window below which it counts as without texture: a level of an 8-bit image."""


def levels(frames: np.ndarray) -> np.ndarray:
    """Grey values from 0 to 1.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        Any real type.

    Returns
    -------
    ndarray of the same shape, float32
        8-bit values over 255; of any other type, the range of the clip over its width. NaN where not finite.
    """
    if frames.dtype == np.uint8:
        return frames * np.float32(1 / 255)
    known = np.isfinite(frames)
    values = np.where(known, frames, np.nan).astype(float)
    low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
    return ((values - low) / ((high - low) or 1.0)).astype(np.float32)


def amplitudes(values: np.ndarray, decibels: float) -> np.ndarray:
    """Amplitudes of the echoes whose logarithm an image shows.

    Parameters
    ----------
    values : ndarray of any shape
        Grey values from 0 to 1.
    decibels : float
        From black to white; 0 leaves the grey values as they are.

    Returns
    -------
    ndarray of the same shape and type
        Less that of black, in such a unit that the faintest are their grey values.
    """
    nepers = _nepers(decibels)
    return (np.exp(nepers * values) - 1) / nepers if nepers else values


def steepness(bright: np.ndarray, decibels: float) -> np.ndarray:
    """Change of :func:`amplitudes` with the grey value, where they are `bright`; of the same shape."""
    return 1 + _nepers(decibels) * bright


def _nepers(decibels: float) -> float:
    return decibels * log(10) / 20


def similarity(first: np.ndarray, second: np.ndarray, side: int) -> np.ndarray:
    """Zero-normalised cross-correlation of two images about every pixel.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral)
        Grey values from 0 to 1.
    side : int
        Side of the square over which they are compared, px, odd; images are mirrored at their borders.

    Returns
    -------
    ndarray of shape (axial, lateral)
        From -1 to 1; NaN where the square of either image has no texture or holds a pixel without a value.
    """
    known = np.isfinite(first) & np.isfinite(second)
    a, b = (np.where(known, image, 0).astype(float) for image in (first, second))
    every = (a, b, a * a, b * b, a * b, 1.0 - known)
    # Running sums, whose rounding depends on where a thread begins.
    cv2.setNumThreads(1)
    over = [cv2.blur(image, (side, side), borderType=cv2.BORDER_REFLECT) for image in every]
    variances = over[2] - over[0] ** 2, over[3] - over[1] ** 2
    told = (np.minimum(*variances) > FAINTEST**2) & (over[5] < 0.5 / side**2)
    product = np.where(told, variances[0] * variances[1], np.nan)
    return np.clip((over[4] - over[0] * over[1]) / np.sqrt(product), -1, 1)
