"""Whether a clip is a closed cycle, so that its last frame is followed by its first."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from echotruth.tracking.accumulation import step_variance
from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import DYNAMIC_RANGE, decompress, even_gain, grey_levels, rms
from echotruth.tracking.trackers.dis import MIN_IMAGE_SIDE, optical_flow

MAX_SIDE = 128
"""Side of the block means that are compared, px: speckle is still there, and a pair takes milliseconds."""
GAIN_SHARE = 0.05
"""Distance over which the gain is made even, over the side of the image: else the brightest part of the wall decides,
which may be a scar that hardly moves."""
OPEN_DISPLACEMENT = 0.5
"""Displacement that is left in the last frame, over the largest, above which a clip is open. In realistic and ideal
hearts it is 0.45 at most over the whole cycle, and 0.85 at least over its first half (docs/tracking.md)."""
SURELY_OPEN_DISPLACEMENT = 0.75
"""The same above which there is no doubt: 232 whole cycles of the benchmark have 0.71 at most."""
DOUBTFUL_VARIANCE = 1.5
"""Variance of the step from the last frame to the first over the largest of consecutive frames, above which an open
clip, in which this step is a long one, is not followed backwards. Over the first half of a cycle it is above 1.5 in
most hearts, and where it is below, tracking both ways has the smaller error."""
LEAST_MOTION = 0.5
"""RMS displacement below which nothing moves that could come back, px of the block means."""


@dataclass(frozen=True)
class Closure:
    """How the last frame of a clip differs from its first.

    Attributes
    ----------
    displacement : float
        RMS displacement of the wall from the first frame to the last, over the largest from the first to any; NaN where
        nothing moves, and of two frames.
    closing, consecutive : float
        Correlation of the last frame with the first, and the least of consecutive frames, in the wall, after the motion
        between the two is undone; from -1 to 1, NaN without texture.
    """

    displacement: float = np.nan
    closing: float = np.nan
    consecutive: float = np.nan

    @property
    def is_open(self) -> bool:
        """Whether the clip is no closed cycle; not if that is unknown, as it should be one.

        That speckle has changed does not make it open: the wall may have come back all the same.
        """
        return self.displacement > OPEN_DISPLACEMENT

    @property
    def is_surely_open(self) -> bool:
        """Whether the clip is no closed cycle, beyond doubt."""
        return self.displacement > SURELY_OPEN_DISPLACEMENT

    @property
    def is_followed(self) -> bool:
        """Whether the tissue of the last frame can be followed to the first, so that a clip can be tracked backwards.

        In an open clip this is a long step, which only images that are as alike as consecutive ones allow: by the
        variance of a shift that is found with them, see :func:`echotruth.tracking.accumulation.step_variance`.
        """
        last, largest = step_variance(np.array([self.closing, self.consecutive]))
        return not self.is_open or not last > DOUBTFUL_VARIANCE * largest

    def __str__(self) -> str:
        alike = f"its last frame correlates with the first by {self.closing:.2f}, consecutive ones by"
        text = f"{alike} {self.consecutive:.2f} or more"
        left = f"{100 * self.displacement:.0f} % of its largest displacement is left there"
        return text if np.isnan(self.displacement) else f"{text}, and {left}"


def closure(frames: np.ndarray, mask: np.ndarray) -> Closure:
    """Compare the last frame of a clip with its first.

    Dense flows from each frame to the next, and from the first to the last, give the motion between them. What is left
    in the last frame is the mean of what the last flow and the sum of the others say: the one errs towards no motion
    where speckle is new, the other drifts.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        Any real type; NaN is taken as the darkest value.
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole.

    Returns
    -------
    Closure
        Without values for images that are too small for a dense flow.
    """
    side = max(1, min(mask.shape) // MAX_SIDE)
    size = tuple(length // side for length in mask.shape[::-1])
    inside = _reduced(mask.astype(np.float32), size) >= 0.5
    if min(size) < MIN_IMAGE_SIDE or not inside.any():
        return Closure()
    amplitudes = [_reduced(decompress(np.nan_to_num(frame), DYNAMIC_RANGE), size) for frame in grey_levels(frames)]
    typical = rms(amplitudes[0][inside])
    amplitudes = [even_gain(amplitude, GAIN_SHARE * max(size), typical) for amplitude in amplitudes]
    images = list(np.array(amplitudes) / (np.max(amplitudes) or 1))
    flows = [optical_flow(first, second) for first, second in pairwise(images)]
    last = optical_flow(images[0], images[-1])
    correlations = [_correlation(*pair, flow, inside) for pair, flow in zip(pairwise(images), flows, strict=True)]
    # A frame without texture, as a black one, tells nothing.
    known = [correlation for correlation in correlations if np.isfinite(correlation)]
    return Closure(
        _remaining(flows, last, inside),
        _correlation(images[0], images[-1], last, inside),
        float(min(known, default=np.nan)),
    )


def _reduced(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Means over areas of pixels."""
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def _remaining(flows: list[np.ndarray], last: np.ndarray, inside: np.ndarray) -> float:
    """RMS displacement from the first frame to the last, by the flow between them and by all others, over the largest.

    The largest is that of any frame, of points that the flows from frame to frame carry.
    """
    points = _points(inside)
    position, farthest = points, 0.0
    for flow in flows:
        position = position + interpolate_field(flow, _within(position, inside.shape))
        farthest = max(farthest, _length(position - points))
    left = (_length(last[inside]) + _length(position - points)) / 2
    return left / farthest if len(flows) > 1 and farthest > LEAST_MOTION else np.nan


def _correlation(first: np.ndarray, second: np.ndarray, flow: np.ndarray, inside: np.ndarray) -> float:
    """Correlation of two images, where a point of the first is inside, after the motion between them is undone."""
    moved = _points(inside) + flow[inside]
    values = interpolate_field(second[..., None], _within(moved, second.shape))[:, 0]
    pair = np.stack([first[inside], values])
    return float(np.corrcoef(pair)[0, 1]) if (pair.std(1) > 0).all() else np.nan


def _points(inside: np.ndarray) -> np.ndarray:
    """Centres of the pixels that are inside, (n, 2): lateral, axial, px."""
    return np.argwhere(inside)[:, ::-1].astype(float)


def _within(points: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Points, moved to the edge of the image where they are beside it."""
    return np.clip(points, 0, np.array(shape[::-1]) - 1)


def _length(vectors: np.ndarray) -> float:
    """RMS length of vectors (n, 2)."""
    return float(np.sqrt((vectors**2).sum(-1).mean()))
