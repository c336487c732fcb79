"""Block matching with medians of neighbours, as speckle tracking began, as a tracker.

    echotruth evaluate out/demo --tracker examples.block_matching:track

The benchmark has it. Blocks about the points are sought in the next frame by normalised cross-correlation (Bohs and
Trahey 1991, IEEE Trans Biomed Eng 38:280), between pixels by a parabola through the largest value and its neighbours,
and each displacement is replaced by the median of those within a block of it (as in Westerweel and Scarano 2005, Exp
Fluids 39:1096, who find outliers by it).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from echotruth.tracking.accumulation import accumulate
from echotruth.tracking.grey import grey_levels

MIN_HALF = 4
"""Smallest half side of a block, px."""
REACH = 0.4
"""Largest step from frame to frame, over the side of a block."""


def track(frames, points, mask, spacing, frame_time, seed, block_mm=1.0):
    """Displacement of points (frame, n, 2) in px since the first frame; see docs/trackers.md."""
    half = max(MIN_HALF, round(1e-3 * block_mm / spacing / 2))
    return accumulate(BlockMatching(half), grey_levels(frames), points, "bidirectional")[0]


@dataclass(frozen=True)
class BlockMatching:
    """Blocks of 2 half + 1 pixels a side, as :class:`echotruth.tracking.accumulation.PairTracker`."""

    half: int

    def prepare(self, image):
        """The image in single precision, with its border repeated as far as a block may be sought."""
        image = np.nan_to_num(image).astype(np.float32)
        return cv2.copyMakeBorder(image, *4 * (self.margin,), cv2.BORDER_REPLICATE)

    @property
    def reach(self):
        """Largest step, px."""
        return max(2, round(REACH * (2 * self.half + 1)))

    @property
    def margin(self):
        """Pixels about the image."""
        return self.half + self.reach + 1

    def match(self, first, second, points):
        """Step (n, 2) in px and correlation (n,) of points."""
        step, quality = np.full((len(points), 2), np.nan), np.full(len(points), np.nan)
        inside = (points > -0.5).all(1) & (points < np.array(first.shape[::-1]) - 2 * self.margin - 0.5).all(1)
        for place in np.flatnonzero(inside):
            step[place], quality[place] = self._found(first, second, *np.rint(points[place]).astype(int) + self.margin)
        return self._medians(points, step), np.maximum(quality, 0)

    def _found(self, first, second, lateral, axial):
        """Step and correlation of the block about a pixel of the images with their borders."""
        block, area = (
            image[axial - size : axial + size + 1, lateral - size : lateral + size + 1]
            for image, size in ((first, self.half), (second, self.half + self.reach + 1))
        )
        correlation = cv2.matchTemplate(area, block, cv2.TM_CCOEFF_NORMED)
        row, column = np.unravel_index(correlation[1:-1, 1:-1].argmax(), np.array(correlation.shape) - 2)
        around = correlation[row : row + 3, column : column + 3]
        between = peak_of_parabola(around[1]), peak_of_parabola(around[:, 1])
        return np.array([column, row]) - self.reach + between, around[1, 1]

    def _medians(self, points, step):
        """Median of the steps within a block of each point whose step is known; NaN elsewhere."""
        found, known = np.full_like(step, np.nan), np.flatnonzero(np.isfinite(step).all(1))
        if len(known):
            tree = cKDTree(points[known])
            for place, near in zip(known, tree.query_ball_point(points[known], 2 * self.half + 1), strict=True):
                found[place] = np.median(step[known[near]], axis=0)
        return found


def peak_of_parabola(values):
    """Place of the largest value of a parabola through three values at -1, 0 and 1, of which the middle is largest."""
    before, middle, after = map(float, values)
    curvature = before - 2 * middle + after
    return float(np.clip((before - after) / (2 * curvature), -0.5, 0.5)) if curvature < 0 else 0.0
