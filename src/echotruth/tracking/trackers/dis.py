"""Dense inverse search of OpenCV, unmodified (Kroeger et al. 2016, ECCV, LNCS 9908:471)."""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np

from echotruth.config.tracking import Dis
from echotruth.tracking.flow import track_by_flow

MIN_IMAGE_SIDE = 32
"""Smallest side of an image, px; for flat ones of 24 px OpenCV 5.0 reads beyond its memory."""
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

    The quality is that of :mod:`echotruth.tracking.flow`; the library has none.
    """
    return track_by_flow(partial(optical_flow, preset=settings.preset), frames, points, spacing, settings.reference)


def optical_flow(first: np.ndarray, second: np.ndarray, preset: str = "medium") -> np.ndarray:
    """Motion of every pixel from one image to another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral)
        Grey values from 0 to 1, all finite.
    preset : {"ultrafast", "fast", "medium"}
        Preset of OpenCV.

    Returns
    -------
    ndarray of shape (axial, lateral, 2), float32
        Lateral, axial, px.

    Raises
    ------
    ValueError
        If the image is smaller than OpenCV can process.
    """
    if min(first.shape) < MIN_IMAGE_SIDE:
        raise ValueError(f"Dense inverse search needs images of {MIN_IMAGE_SIDE} px or more, not {first.shape}.")
    # The library cuts the image into as many stripes as there are threads, and their seams show in the motion.
    cv2.setNumThreads(1)
    before, after = ((255 * image).round().astype(np.uint8) for image in (first, second))
    # OpenCV takes None for a flow that it is to allocate.
    return cv2.DISOpticalFlow.create(PRESETS[preset]).calc(before, after, None)  # type: ignore[call-overload]
