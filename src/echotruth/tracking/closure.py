"""Whether a clip is a closed cycle, so that its last frame is followed by its first."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np

from echotruth.tracking.accumulation import step_variance
from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import decompress, even_gain, grey_levels, rms
from echotruth.tracking.trackers.dis import MIN_IMAGE_SIDE, optical_flow

MAX_SIDE = 128
"""Side of the block means that are compared, px: speckle is still there, and a pair takes milliseconds."""
DYNAMIC_RANGE = 45.0
"""Dynamic range by which log compression is undone, dB: grey values of speckle differ too little from one another
beside the edges of the wall, which look alike in all frames."""
GAIN_SHARE = 0.05
"""Distance over which the gain is made even, over the side of the image: else the brightest part of the wall decides,
which may be a scar that hardly moves."""
OPEN_VARIANCE = 1.5
"""Variance of the step from the last frame to the first over the largest of consecutive frames, above which a clip is
open. In hearts of the benchmark's half develop with realistic acoustics, whose speckle does not come back as it was, it
is up to 1.9 over the whole cycle, most often below 1, and 1.8 and more over its first half."""


def closing_correlation(frames: np.ndarray, mask: np.ndarray) -> tuple[float, float]:
    """Correlation of the last frame with the first, and the least of consecutive frames.

    Two frames are correlated in the wall after the motion from one to the other, a dense flow, is undone. What
    is left is the decorrelation of the speckle, which a step through a long time does not survive.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        Any real type; NaN is taken as the darkest value.
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole.

    Returns
    -------
    closing, consecutive : float
        From -1 to 1; NaN without texture, or in images that are too small for a dense flow.
    """
    side = max(1, min(mask.shape) // MAX_SIDE)
    size = tuple(length // side for length in mask.shape[::-1])
    if min(size) < MIN_IMAGE_SIDE or not mask.any():
        return np.nan, np.nan
    amplitudes = [_reduced(decompress(np.nan_to_num(frame), DYNAMIC_RANGE), size) for frame in grey_levels(frames)]
    inside = _reduced(mask.astype(np.float32), size) >= 0.5
    typical = rms(amplitudes[0][inside])
    amplitudes = [even_gain(amplitude, GAIN_SHARE * max(size), typical) for amplitude in amplitudes]
    images = list(np.array(amplitudes) / (np.max(amplitudes) or 1))
    consecutive = [_correlation(first, second, inside) for first, second in pairwise(images)]
    return _correlation(images[0], images[-1], inside), float(np.min(consecutive))


def is_open(closing: float, consecutive: float) -> bool:
    """Whether a clip with these correlations is no closed cycle; not if neither can be told, as it should be one.

    Correlations are compared by the variance of a shift that is found with them, see
    :func:`echotruth.tracking.accumulation.step_variance`.
    """
    last, largest = step_variance(np.array([closing, consecutive]))
    return bool(last > OPEN_VARIANCE * largest)


def _reduced(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Means over areas of pixels."""
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def _correlation(first: np.ndarray, second: np.ndarray, inside: np.ndarray) -> float:
    """Correlation of two images, where a point of the first is inside, after the motion between them is undone."""
    points = np.argwhere(inside)[:, ::-1].astype(float)
    moved = points + interpolate_field(optical_flow(first, second), points)
    values = interpolate_field(second[..., None], np.clip(moved, 0, np.array(second.shape[::-1]) - 1))[:, 0]
    pair = np.stack([first[inside], values])
    return float(np.corrcoef(pair)[0, 1]) if (pair.std(1) > 0).all() else np.nan
