"""The one way to call any tracker, and what is asked of its input and its answer."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from echotruth.section import Section
from echotruth.tracking.failure import TrackerFailed

Track = Callable[..., tuple[np.ndarray, np.ndarray]]


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: Section,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame, as a tracker sees it.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        B-mode clip of one cycle, any real type; frame 0 is end-diastole, and would follow the last.
    points : ndarray of shape (n, 2)
        Where the points are at end-diastole: lateral, axial, px (0 is the centre of the first pixel).
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole, as one who looks at the image would draw it.
    spacing : float
        Distance of pixel centres, the same along both axes, m.
    frame_time : ndarray of shape (frame,)
        Time since end-diastole, s.
    seed : int
        Start of whatever a tracker draws at random.
    settings : Section
        One of the sections in `config/tracking.py`; it names the method.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        Since end-diastole of the tissue that was at the point then: lateral, axial, px, positive for motion of the
        tissue; NaN where there is none, as for points outside the image.
    quality : ndarray of shape (frame, n)
        How sure the tracker is, from 0 to 1; NaN where there is no displacement.

    Raises
    ------
    ValueError
        If there is no pair of frames, or points, mask, spacing or times make no sense.
    TrackerFailed
        If the method cannot do with such a clip, or a guest raises or does not answer as asked.
    """
    clip = (np.asarray(frames), np.asarray(points, float), np.asarray(mask, bool), spacing, np.asarray(frame_time))
    _check(*clip)
    try:
        displacement, quality = _method(settings)(*clip, seed)
    except ValueError as error:
        raise TrackerFailed(str(error)) from error
    half = np.array(clip[2].shape[::-1]) / 2
    inside = (np.abs(clip[1] + 0.5 - half) <= half).all(1)
    lost = ~(np.isfinite(displacement).all(-1) & inside)
    displacement[lost], quality[lost] = np.nan, np.nan
    return displacement, quality


def _method(settings: Any) -> Track:
    """The function of a method; each is imported only where it is used, for some take long to import."""
    match settings.method:
        case "phase_correlation":
            from echotruth.tracking.trackers import phase_correlation as module
        case "window_deformation":
            from echotruth.tracking.trackers import window_deformation as module
        case "affine_dic":
            from echotruth.tracking.trackers import affine_dic as module
        case "bspline_dic":
            from echotruth.tracking.trackers import bspline_dic as module
        case "dis":
            from echotruth.tracking.trackers import dis as module
        case "ilk":
            from echotruth.tracking.trackers import ilk as module
        case "guest":
            from echotruth.tracking.trackers import external as module
    return partial(module.track, settings=settings)


def _check(frames: np.ndarray, points: np.ndarray, mask: np.ndarray, spacing: float, frame_time: np.ndarray) -> None:
    if frames.ndim != 3 or len(frames) < 2:
        raise ValueError(f"A clip of two or more frames (frame, axial, lateral) is needed, not one of {frames.shape}.")
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"Points must be of shape (point, 2), not {points.shape}.")
    if mask.shape != frames.shape[1:]:
        raise ValueError(f"The mask must have the shape of a frame, {frames.shape[1:]}, not {mask.shape}.")
    if not (np.isfinite(spacing) and spacing > 0):
        raise ValueError(f"The pixel spacing must be a positive length in metres, not {spacing}.")
    if frame_time.shape != frames.shape[:1] or not (np.diff(frame_time) > 0).all():
        raise ValueError(f"There must be {len(frames)} rising times of frames, not {frame_time}.")
