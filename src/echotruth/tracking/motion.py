"""Motion of points through a clip: the tracker's steps, gathered along the path of the tissue."""

from __future__ import annotations

import numpy as np

from echotruth.config import Tracker
from echotruth.tracking.phase_correlation import displacement, phases
from echotruth.tracking.windows import SMALLEST, Windows, arrange


def track(frames: np.ndarray, points: np.ndarray, tracker: Tracker, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame, as a tracker sees it.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        B-mode clip, any real type; frame 0 is end-diastole.
    points : ndarray of shape (point, 2)
        Where the points are at end-diastole: lateral, axial, px (0 is the centre of the first pixel).
    tracker : Tracker
        Settings. Against `ED` every frame is compared with frame 0 at the points' first place; against `previous`
        each step is read where the point then is, and the steps are added.
    spacing : float
        Distance of pixel centres, the same along both axes, m.

    Returns
    -------
    displacement : ndarray of shape (frame, point, 2)
        Lateral, axial, m, positive for motion of the tissue; NaN where there is no texture to track
        (and, against `previous`, ever after).
    quality : ndarray of shape (frame, point)
        Height of the correlation peak; 1 at frame 0.

    Raises
    ------
    ValueError
        If there is no pair of frames, a window does not fit, or the points or the spacing make no sense.
    """
    frames, points = np.asarray(frames), np.asarray(points, float)
    _check(frames, points, spacing)
    windows = arrange(frames.shape[1:], window_side(tracker, spacing), tracker.stride)
    finite = frames[np.isfinite(frames)] if frames.dtype.kind == "f" else frames
    contrast = float(finite.max()) - float(finite.min()) if finite.size else 0.0
    return _gather(frames, points, windows, tracker, (spacing, contrast))


def window_side(tracker: Tracker, spacing: float) -> int:
    """Side of a tracker's window at one image size.

    Parameters
    ----------
    tracker : Tracker
        Settings, the window in pixels or in millimetres of tissue.
    spacing : float
        Distance of pixel centres, m.

    Returns
    -------
    int
        px; a window in millimetres is rounded to an even number, 8 at least.
    """
    if tracker.window_px is not None:
        return tracker.window_px
    return max(SMALLEST, 2 * round(tracker.si().window / spacing / 2))


def _gather(
    frames: np.ndarray, points: np.ndarray, windows: Windows, tracker: Tracker, scale: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Walk through the clip; the scale is that of a pixel in metres and of the grey values."""
    spacing, contrast = scale
    total = np.zeros((len(frames), *points.shape))
    quality = np.ones(total.shape[:2])
    reference = phases(frames[0], windows, tracker.taper, contrast)
    for t in range(1, len(frames)):
        current = phases(frames[t], windows, tracker.taper, contrast)
        moved, peak = displacement(reference, current, windows.side)
        field = np.concatenate([moved, peak[..., None]], -1)
        start = total[t - 1] if tracker.reference == "previous" else np.zeros_like(points)
        step = windows.interpolate(field, points + start)
        total[t], quality[t] = start + step[:, :2], step[:, 2]
        if tracker.reference == "previous":
            reference = current
    return total * spacing, quality


def _check(frames: np.ndarray, points: np.ndarray, spacing: float) -> None:
    if frames.ndim != 3 or len(frames) < 2:
        raise ValueError(f"A clip of two or more frames (frame, axial, lateral) is needed, not one of {frames.shape}.")
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"Points must be of shape (point, 2), not {points.shape}.")
    if not (np.isfinite(spacing) and spacing > 0):
        raise ValueError(f"The pixel spacing must be a positive length in metres, not {spacing}.")
