"""Iterative Lucas-Kanade of scikit-image, unmodified (Le Besnerais and Champagnat 2005, ICIP, 1:137)."""

from functools import partial

import numpy as np
from skimage.registration import optical_flow_ilk

from echotruth.config.tracking import Ilk
from echotruth.tracking.accumulation import Path
from echotruth.tracking.flow import track_by_flow
from echotruth.tracking.tracker_input import TrackerInput


def track(clip: TrackerInput, settings: Ilk) -> Path:
    """Path of the points of a clip by the flow of the library, which has no quality: it follows from the images."""
    return track_by_flow(partial(optical_flow, radius=settings.radius_px), clip, settings.reference)


def optical_flow(first: np.ndarray, second: np.ndarray, radius: int = 7) -> np.ndarray:
    """Motion of every pixel from one image to another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral)
        Grey values from 0 to 1, all finite.
    radius : int
        Radius of the window around a pixel, px.

    Returns
    -------
    ndarray of shape (axial, lateral, 2), float32
        Lateral, axial, px.
    """
    return np.stack(optical_flow_ilk(first, second, radius=radius)[::-1], -1)
