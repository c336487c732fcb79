"""Call of any tracker."""

import logging
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from echotruth.config.tracking import OUTSIDE, VOLUMETRIC, BsplineCnn
from echotruth.extras import explained
from echotruth.section import Section
from echotruth.tracking import trackers
from echotruth.tracking.accumulation import Path
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.quality import error_model
from echotruth.tracking.tracker_input import TrackerInput


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float | np.ndarray,
    frame_time: np.ndarray,
    seed: int,
    settings: Section,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame, as a tracker estimates it.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        B-mode clip, any real type; frame 0 is end-diastole. One whose last frame is unlike the first is tracked
        forwards only, with a warning. Or volumes, (frame, depth, elevation, lateral), of a
        cycle that is taken to be closed; all vectors then have three components: lateral, elevation, depth.
    points : ndarray of shape (n, 2)
        Positions at end-diastole: lateral, axial, px (0 is the centre of the first pixel).
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole, as a reader of the image would draw it.
    spacing : float, or ndarray of shape (3,)
        Distance of pixel centres, the same along both axes, m; of volumes along lateral, elevation, depth.
    frame_time : ndarray of shape (frame,)
        Time since end-diastole, s.
    seed : int
        Seed of the tracker's random numbers.
    settings : Section
        One of the sections in `config/tracking.py`; it names the method.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        Since end-diastole, of the tissue that was at the point then: lateral, axial, px, positive for motion of the
        tissue; NaN where unknown, as for points outside the image.
    quality : ndarray of shape (frame, n)
        Probability that the displacement is right within 1/256 of the longer side of the image, as the tracker sees it
        (:mod:`echotruth.tracking.quality`; a tracker from outside may mean something else), from 0 to 1; NaN where
        there is no displacement, and everywhere of a tracker that does not say how sure it is.

    Raises
    ------
    ValueError
        If there are fewer than two frames, or points, mask, spacing or times are invalid.
    TrackerFailed
        If the method cannot process the clip, as flat trackers cannot process volumes, or an external tracker raises or
        returns an invalid result.
    """
    arrays = np.asarray(frames), np.asarray(points, float), np.asarray(mask, bool)
    clip = TrackerInput(*arrays, spacing, np.asarray(frame_time), seed)
    try:
        displacement, quality = _track(clip, settings)
    except ValueError as error:
        raise TrackerFailed(str(error)) from error
    half = np.array(clip.shape[::-1]) / 2
    inside = (np.abs(clip.points + 0.5 - half) <= half).all(1)
    lost = ~(np.isfinite(displacement).all(-1) & inside)
    displacement[lost], quality[lost] = np.nan, np.nan
    return displacement, quality


def _track(clip: TrackerInput, settings: Any) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and quality of the points of a clip, by a method of ours or from outside."""
    if clip.is_volume and type(settings) not in VOLUMETRIC:
        raise ValueError(f"{settings.method} tracks slices: volumes need bspline_dic, or a function or program")
    if isinstance(settings, OUTSIDE):
        return trackers.function(settings.method)(clip, settings)
    with explained(f"the tracker {settings.method}"):
        from echotruth.tracking.speckle import speckle_length

        trackers.function(settings.method)  # a limit holds for libraries that are loaded
        # The rounding of BLAS sums depends on the number of threads, but results must not.
        with threadpool_limits(1):
            path = tracked_path(clip, settings)
            speckle = speckle_length(clip.frames[0], clip.mask, clip.ratio)
    quality = error_model(settings, clip.is_volume).probability(path, speckle, (clip.side,))
    return path.displacement / clip.ratio, quality


def tracked_path(clip: TrackerInput, settings: Any) -> Path:
    """Path of the points of a clip by a method of ours.

    If the tissue of the last frame cannot be followed to the first, it is tracked forwards only. Volumes are not looked
    at for that.
    """
    both_ways = getattr(settings, "reference", None) == "bidirectional" and not clip.is_volume
    if both_ways or isinstance(settings, BsplineCnn):
        from echotruth.tracking.closure import closure

        closing = closure(clip.frames, clip.mask)
        clip = replace(clip, is_closed=not closing.is_surely_open)
        if both_ways and closing.is_open:
            ways = "both ways, as they are alike" if closing.is_followed else "forwards only"
            logging.getLogger("echotruth").warning(f"the clip is no closed cycle ({closing}): tracked {ways}")
        if both_ways and not closing.is_followed:
            settings = settings.model_copy(update={"reference": "previous"})
    return trackers.function(settings.method)(clip, settings)
