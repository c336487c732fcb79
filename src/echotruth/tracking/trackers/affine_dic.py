"""Digital image correlation of one square subset about every point, affine, by inverse compositional Gauss-Newton.

The start is the field of deformed windows: on clips of a heart it stayed nearer to the truth than a dense inverse
search where speckle decorrelates most. Where an alignment strays from its start, the start stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.config.tracking import AffineDic, WindowDeformation
from echotruth.imaging import spline
from echotruth.tracking import subset
from echotruth.tracking.accumulation import accumulate
from echotruth.tracking.flow import sample
from echotruth.tracking.grey import FAINTEST, levels
from echotruth.tracking.trackers.window_deformation import Prepared, WindowPairs, arranged

SMALLEST_HALF = 8
"""Pixels of the smallest subset to either side of its middle: six unknowns ask for more texture than two."""
BLUR = 0.8
"""Standard deviation of a Gaussian on the images, px: it takes away what a spline cannot hold, and with it most of the
bias between pixels (Pan 2013, Opt Lasers Eng 51:1161)."""
REACH = 5
"""Pixels to which blur and spline spread a pixel without a value."""
START = (1.5, 0.75)
"""Windows from whose field the alignment starts, over the side of a subset."""


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: AffineDic,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame: see :func:`echotruth.tracking.tracker.track`.

    The quality is the correlation of the subsets, none below 0.

    Raises
    ------
    ValueError
        As :func:`echotruth.tracking.trackers.window_deformation.arranged`.
    """
    half = max(SMALLEST_HALF, round(settings.si().subset / spacing / 2))
    windows = WindowDeformation(windows_mm=[share * 2e3 * half * spacing for share in START], sweeps=1)
    start = WindowPairs(arranged(windows, frames.shape[1:], spacing))
    return accumulate(AffinePairs(half, start), levels(frames), points, settings.reference)


@dataclass(frozen=True)
class AffinePairs:
    """Affine correlation of two images, as :class:`echotruth.tracking.accumulation.Pairs`.

    Attributes
    ----------
    half : int
        A subset has 2 half + 1 pixels a side.
    start : WindowPairs
        Tracker from whose field the alignment starts.
    """

    half: int
    start: WindowPairs

    def prepare(self, image: np.ndarray) -> tuple[Prepared, np.ndarray, np.ndarray]:
        """The image for the start, the spline of its blur, and where a subset would reach a pixel without a value."""
        unknown = np.isnan(image)
        blurred = ndimage.gaussian_filter(np.where(unknown, np.float32(0), image), BLUR)
        near = ndimage.maximum_filter(unknown, 2 * (self.half + REACH) + 1)
        return self.start.prepare(image), spline.coefficients(blurred), near

    def match(self, first: tuple, second: tuple, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points."""
        motion, alike = np.full((len(points), 6), np.nan), np.full(len(points), np.nan)
        begin = self.start.field(first[0], second[0])[0].at(points)
        inside = np.isfinite(begin).all(1)
        refined, found = np.zeros((inside.sum(), 6)), alike[inside]
        refined[:, [0, 3]] = begin[inside]
        subset.align(first[1], second[1], points[inside], self.half, FAINTEST, refined, found)
        motion[inside], alike[inside] = refined, found
        step = motion[:, [0, 3]]
        for unknown, place in ((first[2], points), (second[2], points + step)):
            alike[sample(unknown[..., None].astype(float), place)[:, 0] != 0] = np.nan
        step[np.isnan(alike)] = np.nan
        return step, np.maximum(alike, 0)
