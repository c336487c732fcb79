"""How alike the images of a clip are along a motion: a measure by which the images choose between two of them."""

from collections.abc import Sequence

import cv2
import numpy as np

from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import MIN_STD, grey_levels

LAGS = (1, 2, 3, 5)
"""Frames between two images that are compared; each is also compared with the first."""
BLUR, WINDOW = 1 / 16, 1 / 8
"""Standard deviations of the Gaussians of the blur and of the local mean and contrast, over the wall's thickness."""
MAX_NCC = 0.9999
"""Correlation at most: images may be the same."""


def even_contrast(frames: np.ndarray, thickness: float) -> list[np.ndarray]:
    """Images of the same mean and contrast everywhere, lest a bright border that moves by itself outweighs speckle.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        Grey values of any real type; NaN is taken as black.
    thickness : float
        Of the wall, px.

    Returns
    -------
    list of ndarray of shape (axial, lateral)
        Grey values less their local mean, over their local standard deviation, a number.
    """
    return [_even(np.nan_to_num(frame), BLUR * thickness, WINDOW * thickness) for frame in grey_levels(frames)]


def _even(grey: np.ndarray, blur: float, window: float) -> np.ndarray:
    def mean(image: np.ndarray, deviation: float) -> np.ndarray:
        return cv2.GaussianBlur(image, (0, 0), deviation, borderType=cv2.BORDER_REFLECT)

    blurred = mean(grey, blur)
    local = mean(blurred, window)
    variance = np.maximum(mean(blurred**2, window) - local**2, 0)
    return (blurred - local) / np.sqrt(variance + MIN_STD**2)


def similarity(images: Sequence[np.ndarray], places: np.ndarray) -> float:
    """Mean of -log(1 - r) over pairs of frames, with the correlation r of the images at the places of both.

    Parameters
    ----------
    images : sequence of ndarray of shape (axial, lateral)
        Of each frame.
    places : ndarray of shape (frame, n, 2)
        Of the same tissue in each frame: lateral, axial, px; outside the image its border counts.

    Returns
    -------
    float
        A number, larger for images that are more alike; 0 without texture.
    """
    inside = np.clip(places, 0, np.array(images[0].shape[::-1]) - 1)
    values = np.array([interpolate_field(image[..., None], at)[:, 0] for image, at in zip(images, inside, strict=True)])
    values -= values.mean(1, keepdims=True)
    values /= np.maximum(np.linalg.norm(values, axis=1, keepdims=True), MIN_STD)
    pairs = [(values[:-lag], values[lag:]) for lag in LAGS if lag < len(values)] + [(values[:1], values[1:])]
    return float(np.mean([-np.log1p(-np.minimum((a * b).sum(1), MAX_NCC)).mean() for a, b in pairs]))
