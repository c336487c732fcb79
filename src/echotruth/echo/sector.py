"""The part of a recording that the ultrasound image fills, without the writing and the scales about it."""

import cv2
import numpy as np
from numpy.typing import NDArray

LEAST_CHANGE = 8
"""Change of a grey level over the frames above which a pixel belongs to the image: compression changes fewer levels."""
GAP_PX = 9
"""Width up to which dark gaps of the image are closed, and bridges to what else changes are cut."""
LEAST_SHARE = 0.1
"""Share of a frame that a sector has at least: what is smaller may be a trace of the ECG."""
MARGIN = 0.02
"""Of what is cropped about the sector, as a share of its longer side."""


def find(frames: NDArray[np.uint8]) -> tuple[int, int, int, int]:
    """Find the box about the largest connected part of the frames that changes.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral), uint8

    Returns
    -------
    tuple of int
        Left, top, right, bottom, px; that of the whole frame where no part is large enough.
    """
    height, width = frames.shape[1:]
    changes = (frames.max(axis=0).astype(int) - frames.min(axis=0) > LEAST_CHANGE).astype(np.uint8)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (GAP_PX, GAP_PX))
    for operation in (cv2.MORPH_CLOSE, cv2.MORPH_OPEN):
        changes = cv2.morphologyEx(changes, operation, kernel)
    boxes = cv2.connectedComponentsWithStats(changes)[2][1:]  # left, top, width, height, area; 0 is the background
    largest = max(boxes.tolist(), key=lambda box: box[4], default=[0] * 5)
    if largest[4] < LEAST_SHARE * height * width:
        return 0, 0, width, height
    left, top, across, along, _ = largest
    margin = round(MARGIN * max(across, along))
    right, bottom = min(width, left + across + margin), min(height, top + along + margin)
    return max(0, left - margin), max(0, top - margin), right, bottom
