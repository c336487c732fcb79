"""Farneback's dense optical flow (OpenCV), from frame to frame."""

from itertools import pairwise

import cv2
import numpy as np
from scipy.ndimage import map_coordinates


def track(frames, points, mask, spacing, frame_time, seed, window_mm=1.0):
    """Displacement (frame, n, 2) of points since frame 0, px: lateral, axial."""
    window = round(1e-3 * window_mm / spacing)
    positions = [points]
    for first, second in pairwise(frames):
        flow = cv2.calcOpticalFlowFarneback(first, second, None, 0.5, 3, window, 5, 7, 1.5, 0)
        place = positions[-1][:, ::-1].T  # row, column
        step = [map_coordinates(flow[..., k], place, order=1, mode="nearest") for k in (0, 1)]
        positions.append(positions[-1] + np.stack(step, axis=1))
    return np.stack(positions) - points
