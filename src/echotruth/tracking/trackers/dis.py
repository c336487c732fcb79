"""Dense inverse search of OpenCV as it is (Kroeger et al. 2016, ECCV, LNCS 9908:471)."""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np

from echotruth.config.tracking import Dis
from echotruth.tracking.flow import follow

SMALLEST = 32
"""Least side of an image, px; on flat ones of 24 px OpenCV 5.0 reads beyond its memory."""
PRESETS = {
    "ultrafast": cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST,
    "fast": cv2.DISOPTICAL_FLOW_PRESET_FAST,
    "medium": cv2.DISOPTICAL_FLOW_PRESET_MEDIUM,
}


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: Dis,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame: see :func:`echotruth.tracking.tracker.track`.

    The library says nothing of quality; :mod:`echotruth.tracking.flow` does.
    """
    return follow(partial(flow, preset=settings.preset), frames, points, spacing, settings.reference)


def flow(first: np.ndarray, second: np.ndarray, preset: str = "medium") -> np.ndarray:
    """Motion of every pixel from one image to another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral)
        Grey values from 0 to 1, all finite.
    preset : {"ultrafast", "fast", "medium"}
        Of OpenCV.

    Returns
    -------
    ndarray of shape (axial, lateral, 2), float32
        Lateral, axial, px.

    Raises
    ------
    ValueError
        If the image is smaller than OpenCV can do with.
    """
    if min(first.shape) < SMALLEST:
        raise ValueError(f"Dense inverse search needs images of {SMALLEST} px or more, not {first.shape}.")
    # The library cuts the image into as many stripes as there are threads, and their seams show in the motion.
    cv2.setNumThreads(1)
    images = ((255 * image).round().astype(np.uint8) for image in (first, second))
    return cv2.DISOpticalFlow_create(PRESETS[preset]).calc(*images, None)
