"""Dense optical flow by polynomial expansion (Farneback 2003, LNCS 2749:363, as OpenCV has it), as a tracker.

    echotruth evaluate out/demo --tracker examples.farneback:track

The benchmark has it, as a method that is in wide use and knows nothing of ultrasound. The window is that of OpenCV's
documentation but for its side, which is given in mm, so that it is the same tissue at every image size.
"""

from functools import partial

import cv2
import numpy as np

from echotruth.tracking.flow import track_by_flow
from echotruth.tracking.tracker_input import TrackerInput

LEVELS, ITERATIONS, NEIGHBOURHOOD, SMOOTHING = 3, 5, 7, 1.5
"""Levels of the pyramid, iterations at each, pixels of the polynomial and standard deviation of its weights."""
MIN_WINDOW = 9


def track(frames, points, mask, spacing, frame_time, seed, window_mm=1.0):
    """Displacement of points (frame, n, 2) in px since the first frame; see docs/trackers.md."""
    flow = partial(optical_flow, window=max(MIN_WINDOW, round(1e-3 * window_mm / spacing)))
    clip = TrackerInput(frames, points, mask, spacing, frame_time, seed)
    return track_by_flow(flow, clip, "bidirectional").displacement


def optical_flow(first, second, window):
    """Motion (axial, lateral, 2), px, of every pixel from one image of grey values from 0 to 1 to another."""
    before, after = ((255 * image).round().astype(np.uint8) for image in (first, second))
    return cv2.calcOpticalFlowFarneback(
        before, after, None, 0.5, LEVELS, window, ITERATIONS, NEIGHBOURHOOD, SMOOTHING, 0
    )
