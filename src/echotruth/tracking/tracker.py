"""Call of any tracker, with checks of its input."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from echotruth.section import Section
from echotruth.tracking.failure import TrackerFailed


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: Section,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame, as a tracker estimates it.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        B-mode clip, any real type; frame 0 is end-diastole. A clip that is no closed cycle is told, and tracked
        forwards only unless its last frame is like the first.
    points : ndarray of shape (n, 2)
        Positions at end-diastole: lateral, axial, px (0 is the centre of the first pixel).
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole, as a reader of the image would draw it.
    spacing : float
        Distance of pixel centres, the same along both axes, m.
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
        there is no displacement.

    Raises
    ------
    ValueError
        If there are fewer than two frames, or points, mask, spacing or times are invalid.
    TrackerFailed
        If the method cannot process the clip, or an external tracker raises or returns an invalid result.
    """
    clip = (np.asarray(frames), np.asarray(points, float), np.asarray(mask, bool), spacing, np.asarray(frame_time))
    _check(*clip)
    try:
        displacement, quality = _method(_suited(settings, clip[0], clip[2]))(*clip, seed)
    except ValueError as error:
        raise TrackerFailed(str(error)) from error
    half = np.array(clip[2].shape[::-1]) / 2
    inside = (np.abs(clip[1] + 0.5 - half) <= half).all(1)
    lost = ~(np.isfinite(displacement).all(-1) & inside)
    displacement[lost], quality[lost] = np.nan, np.nan
    return displacement, quality


def _suited(settings: Section, frames: np.ndarray, mask: np.ndarray) -> Section:
    """The settings, without the way backwards if the tissue of the last frame cannot be followed to the first."""
    if getattr(settings, "reference", None) != "bidirectional":
        return settings
    from echotruth.tracking.closure import closure

    found = closure(frames, mask)
    if found.is_open:
        ways = "both ways, as they are alike" if found.is_followed else "forwards only"
        logging.getLogger("echotruth").warning(f"the clip is no closed cycle ({found}): tracked {ways}")
    return settings if found.is_followed else settings.model_copy(update={"reference": "previous"})


def _method(settings: Any) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """Function `track` of a method; its module is imported only here, because some take long to import."""
    function: Callable[..., tuple[np.ndarray, np.ndarray]]
    match settings.method:
        case "phase_correlation":
            from echotruth.tracking.trackers.phase_correlation import track as function
        case "window_deformation":
            from echotruth.tracking.trackers.window_deformation import track as function
        case "affine_dic":
            from echotruth.tracking.trackers.affine_dic import track as function
        case "bspline_dic":
            from echotruth.tracking.trackers.bspline_dic import track as function
        case "dis":
            from echotruth.tracking.trackers.dis import track as function
        case "ilk":
            from echotruth.tracking.trackers.ilk import track as function
        case "external":
            from echotruth.tracking.trackers.external import track as function
    return partial(function, settings=settings)


def _check(frames: np.ndarray, points: np.ndarray, mask: np.ndarray, spacing: float, frame_time: np.ndarray) -> None:
    if frames.ndim != 3 or len(frames) < 2:
        raise ValueError(f"A clip needs two or more frames, shape (frame, axial, lateral), not {frames.shape}.")
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"Points must have the shape (point, 2), not {points.shape}.")
    if mask.shape != frames.shape[1:]:
        raise ValueError(f"The mask must have the shape of a frame, {frames.shape[1:]}, not {mask.shape}.")
    if not (np.isfinite(spacing) and spacing > 0):
        raise ValueError(f"The pixel spacing must be a positive length in metres, not {spacing}.")
    if frame_time.shape != frames.shape[:1] or not (np.diff(frame_time) > 0).all():
        raise ValueError(f"The {len(frames)} frames need {len(frames)} increasing times, not {frame_time}.")
