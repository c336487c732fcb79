"""Iterative Lucas-Kanade flow of scikit-image, unmodified (Le Besnerais and Champagnat 2005, IEEE ICIP, I-137)."""

from functools import partial

import numpy as np
from skimage.registration import optical_flow_ilk

from echotruth.config.tracking import OpticalFlowIlk
from echotruth.tracking.accumulation import Path
from echotruth.tracking.flow import track_by_flow
from echotruth.tracking.tracker_input import TrackerInput


def track(clip: TrackerInput, settings: OpticalFlowIlk) -> Path:
    """Path of the points of volumes by the flow of the library, which has no quality: it follows from the images."""
    return track_by_flow(partial(optical_flow, settings=settings), clip, settings.reference)


def optical_flow(first: np.ndarray, second: np.ndarray, settings: OpticalFlowIlk) -> np.ndarray:
    """Motion (depth, elevation, lateral, 3) of every voxel from one volume to another: lateral, elevation, depth."""
    flow = optical_flow_ilk(first, second, radius=settings.radius, num_warp=settings.warps, prefilter=False)
    return np.moveaxis(flow[::-1], 0, -1)
