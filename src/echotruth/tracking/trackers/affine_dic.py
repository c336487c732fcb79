"""Affine digital image correlation of one square subset about every point, by inverse compositional Gauss-Newton.

The initial estimate is the field of window deformation: on clips of a heart it was more accurate than a dense inverse
search where speckle decorrelates most. Where an alignment strays too far from it, the initial estimate is kept.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.config.tracking import AffineDic, WindowDeformation
from echotruth.imaging import spline
from echotruth.tracking import subset
from echotruth.tracking.accumulation import Path, follow
from echotruth.tracking.flow import interpolate_field
from echotruth.tracking.grey import MIN_STD, amplitudes
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers.window_deformation import PreparedImage, WindowDeformationTracker, window_passes
from echotruth.units import mm

MIN_HALF = 8
"""Smallest half side of a subset, px: six unknowns need more texture than two."""
BLUR = 0.8
"""Standard deviation of a Gaussian on the images, px: it removes what a spline cannot represent, and with it most of
the bias between pixels (Pan 2013, Opt Lasers Eng 51:1161)."""
SPREAD = 5
"""Pixels over which blur and spline spread a pixel without a value."""
INITIAL_WINDOWS = (1.5, 0.75)
"""Windows of the initial estimate, over the side of a subset."""


def track(clip: TrackerInput, settings: AffineDic) -> Path:
    """Path of the points of a clip, with the correlation of the subsets; raises as :func:`window_passes`."""
    half = max(MIN_HALF, round(settings.subset_mm * mm / clip.spacing / 2))
    sides = [ratio * 2e3 * half * clip.spacing for ratio in INITIAL_WINDOWS]
    windows = WindowDeformation(windows_mm=sides, final_passes=1)
    initial = WindowDeformationTracker(window_passes(windows, clip.shape, clip.spacing))
    images = amplitudes(clip.frames, settings.dynamic_range_dB)
    return follow(AffineTracker(half, initial), images, clip.points, settings.reference)


@dataclass(frozen=True)
class AffineTracker:
    """Affine correlation of two images, as :class:`echotruth.tracking.accumulation.PairTracker`.

    Attributes
    ----------
    half : int
        A subset has 2 half + 1 pixels a side.
    initial : WindowDeformationTracker
        Tracker that gives the initial estimate.
    """

    half: int
    initial: WindowDeformationTracker

    def prepare(self, image: np.ndarray) -> tuple[PreparedImage, np.ndarray, np.ndarray]:
        """Image for the initial estimate, spline of the blurred image, and centres of subsets with unknown pixels."""
        unknown = np.isnan(image)
        blurred = ndimage.gaussian_filter(np.where(unknown, np.float32(0), image), BLUR)
        affected = ndimage.maximum_filter(unknown, 2 * (self.half + SPREAD) + 1)
        return self.initial.prepare(image), spline.coefficients(blurred), affected

    def match(self, first: tuple, second: tuple, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points."""
        step, ncc = np.full((len(points), 2), np.nan), np.full(len(points), np.nan)
        initial = self.initial.field(first[0], second[0])[0].at(points)
        inside = np.isfinite(initial).all(1)
        warps, inside_ncc = np.zeros((inside.sum(), 6)), ncc[inside]
        warps[:, [0, 3]] = initial[inside]
        subset.align(first[1], second[1], points[inside], self.half, MIN_STD, warps, inside_ncc)
        step[inside], ncc[inside] = warps[:, [0, 3]], inside_ncc
        for affected, position in ((first[2], points), (second[2], points + step)):
            ncc[interpolate_field(affected[..., None].astype(float), position)[:, 0] != 0] = np.nan
        step[np.isnan(ncc)] = np.nan
        return step, np.maximum(ncc, 0)
