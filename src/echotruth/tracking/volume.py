"""Digital image correlation of the whole wall of a volume at once: :mod:`.trackers.bspline_dic` in three dimensions.

J, its robust weights, templates, and both ways around the cycle are the same. The differences are:

- the motion is trilinear between knots (:mod:`.trilinear`), and the equations are solved by conjugate gradients
  (:mod:`.volume_region`);
- the bending energy is of the components of the motion along the axes of the volume, so that affine fields have none,
  and its weight is not found by the evidence;
- the start is the motion of the frame before, without a dense flow, and images are not blurred but for that start;
- forces are by the mean slope of image and template, so that speckle that changes does not thicken the wall;
- it is not looked for shadows.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import ndimage

from echotruth.config.tracking import BsplineDic
from echotruth.threads import each
from echotruth.tracking import bidirectional
from echotruth.tracking.grey import decompress, even_gain, grey_levels, rms
from echotruth.tracking.ncc import NormalizedCrossCorrelation
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers.bspline_dic import COARSE_BLUR, BothWays, Template, WallTracker
from echotruth.tracking.volume_region import SMOOTHNESS, coefficients, volume_region
from echotruth.units import mm, um

KNOTS = 0.8
"""Knot spacing over that of the cubic field of flat images: hat functions are narrower than cubic ones."""
BLUR_REACH = 3
"""Standard deviations at which a blur is cut off."""


class Amplitudes(Sequence[np.ndarray]):
    """Amplitudes of each volume of a clip, made whenever they are asked for: all would take four times its memory."""

    def __init__(self, frames: np.ndarray, decibels: float):
        self._frames, self._decibels = frames if frames.dtype == np.uint8 else grey_levels(frames), decibels

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, frame: Any) -> Any:
        volume = self._frames[frame]
        grey = grey_levels(volume) if volume.dtype == np.uint8 else np.nan_to_num(volume)
        return decompress(grey, self._decibels)


class VolumeTracker(WallTracker):
    """Tracker of the wall through volumes."""

    def _predict(self, now: int, before: int, coefficients: np.ndarray, template: Template) -> np.ndarray:
        """Coefficients of the frame before: the blurred images take the step from there."""
        return coefficients

    def _aligned_to(self, template: Template) -> np.ndarray:
        """Its grey values and their derivatives."""
        return template.warped


def follow_volume(clip: TrackerInput, settings: BsplineDic) -> BothWays:
    """Track the wall of volumes, which must have some, both ways or forwards only; lengths in the finest spacing."""
    spacing, finest = np.asarray(clip.spacing)[::-1], float(np.min(clip.spacing))
    knots, margin = settings.knots_mm * mm / finest, settings.margin_um * um / finest
    region = volume_region(clip.mask, clip.ratio, KNOTS * knots, margin, settings.transmural_scale)
    points, decibels = clip.points * clip.ratio, settings.dynamic_range_dB
    ncc = NormalizedCrossCorrelation(region.positions, region.inside, points, 2 * knots, decibels)
    amplitudes = Amplitudes(clip.frames, decibels)
    typical = rms(amplitudes[0][clip.mask])

    def prepare(frame: int) -> tuple[np.ndarray, np.ndarray]:
        even = amplitudes[frame]
        if settings.gain_mm:
            even = even_gain(even, settings.gain_mm * mm / spacing, typical)
        blurred = ndimage.gaussian_filter(even, COARSE_BLUR * settings.knots_mm * mm / spacing, truncate=BLUR_REACH)
        return coefficients(even), coefficients(blurred)

    images, blurred = map(list, zip(*each(prepare, range(len(amplitudes))), strict=True))
    settings = settings.model_copy(update={"smoothness": settings.smoothness or SMOOTHNESS})
    tracker = VolumeTracker(region, ncc, None, np.empty(0), 1, images, blurred, amplitudes, settings)
    is_both = settings.reference == "bidirectional" and len(clip.frames) > 2
    trajectories = each(tracker.track, bidirectional.forward_backward(len(clip.frames))[: 1 + is_both])
    return BothWays(region, points, amplitudes, trajectories[0], trajectories[-1])
