"""Metrics of point tracks and of their steps, as benchmarks of trackers of any point and of optical flow print them.

Lengths are in 1/256 of the side of the image, the pixels of TAP-Vid, whose images are 256 by 256. Points are given in
frame 0, which does not count.
"""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.statistics import ratio

SIDE = 256
"""Pixels along the side of an image of TAP-Vid."""

THRESHOLDS = (1, 2, 4, 8, 16)
"""Distances within which a point counts as right."""

LOST = 50
"""Distance at which PointOdyssey takes a track for lost: a fifth of the image, which no wall moves."""

LOST_IN_A_WALL = 8
"""Distance at which a track has left its part of the wall: less than half of the thickness of the default one."""

SURE = 0.5
"""Quality from which a tracker says that it sees a point."""


def tap_vid(error: Floats, visible: NDArray[np.bool_], claimed: NDArray[np.bool_]) -> dict[str, float]:
    """Position and occlusion as TAP-Vid judges them (Doersch et al. 2022, arXiv 2211.03726).

    Parameters
    ----------
    error : ndarray of shape (frame, point)
        Distance of the tracked from the true position, 1/256 of the side; NaN where there is no estimate, which is
        never right.
    visible : ndarray of shape (frame, point), bool
        Whether the image shows the point.
    claimed : ndarray of shape (frame, point), bool
        Whether the tracker says so.

    Returns
    -------
    dict of float
        delta_D_percent, the share of the visible points with an error below D, and their mean delta_avg_percent;
        delta_all_avg_percent, the mean of these shares of all points, hidden ones included;
        average_jaccard_percent, the mean over D of true positives / (visible + false positives), where a true positive
        is visible, claimed and within D, and a false one is claimed and either hidden or not within D;
        occlusion_accuracy_percent, the share of points of which it is said rightly whether they are visible;
        visible_percent, the share of those that are. NaN where no point is visible, or there is none.
    """
    error, visible, claimed = np.where(np.isfinite(error), error, np.inf)[1:], visible[1:], claimed[1:]
    shown = visible.sum(dtype=float)
    shares, jaccard = {}, []
    for distance in THRESHOLDS:
        right = visible & (error < distance)
        shares[f"delta_{distance}_percent"] = _percent(right.sum(), shown)
        jaccard.append(_percent((right & claimed).sum(), shown + (claimed & ~right).sum()))
    return shares | {
        "delta_avg_percent": float(np.mean(list(shares.values()))),
        "delta_all_avg_percent": float(np.mean([_percent((error < limit).sum(), error.size) for limit in THRESHOLDS])),
        "average_jaccard_percent": float(np.mean(jaccard)),
        "occlusion_accuracy_percent": _percent((claimed == visible).sum(), visible.size),
        "visible_percent": _percent(shown, visible.size),
    }


def median_trajectory_error(error: Floats) -> float:
    """Median over the frames of the error of a track, mean over the tracks (Zheng et al. 2023, arXiv 2307.15055).

    Parameters
    ----------
    error : ndarray of shape (frame, point)
        Distance of the tracked from the true position, visible or not.

    Returns
    -------
    float
        In the unit of the error; NaN without points or frames.
    """
    tracks = error[1:]
    return float(np.mean(np.median(tracks, axis=0))) if tracks.size else np.nan


def survival(error: Floats, lost: float = LOST) -> float:
    """Share of the frames until a track is lost, mean over the tracks (Zheng et al. 2023, arXiv 2307.15055).

    Parameters
    ----------
    error : ndarray of shape (frame, point)
        Distance of the tracked from the true position; a track without an estimate is lost.
    lost : float
        Error from which a track is lost, in the unit of the error.

    Returns
    -------
    float
        In %; NaN without points or frames.
    """
    alive = np.logical_and.accumulate(error[1:] <= lost, axis=0)
    return _percent(alive.sum(), alive.size)


def flow_error(tracked: Floats, true: Floats) -> dict[str, float]:
    """Mean end-point error and mean angular error of the steps of points from each frame to the next.

    Benchmarks of optical flow print both (Baker et al., Int J Comput Vis 2011; 92:1, doi 10.1007/s11263-010-0390-2).
    The true step is that of the same tissue, wherever the tracker has it. The angle is that between the directions (u,
    v, 1) of the two steps in space and time, so that it depends on the unit of length.

    Parameters
    ----------
    tracked, true : ndarray of shape (frame, point, 2)
        Displacement since the first frame, 1/256 of the side of the image; NaN where unknown.

    Returns
    -------
    dict of float
        flow_epe_px256, 1/256 of the side, and flow_angular_error_deg; over the steps at which both are known, NaN where
        there is none.
    """
    step, true_step = (np.diff(np.asarray(values, float), axis=0) for values in (tracked, true))
    known = np.isfinite(step).all(-1) & np.isfinite(true_step).all(-1)
    if not known.any():
        return {"flow_epe_px256": np.nan, "flow_angular_error_deg": np.nan}
    step, true_step = step[known], true_step[known]
    return {
        "flow_epe_px256": float(np.mean(np.linalg.norm(step - true_step, axis=-1))),
        "flow_angular_error_deg": float(np.mean(np.degrees(_angle(step, true_step)))),
    }


def _angle(first: Floats, second: Floats) -> Floats:
    """Angle between (u, v, 1) of two arrays of steps (n, 2), rad; exact for small ones, unlike the arc cosine."""
    one, other = (np.column_stack([step, np.ones(len(step))]) for step in (first, second))
    angle: Floats = np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), np.sum(one * other, axis=-1))
    return angle


def _percent(part: float, whole: float) -> float:
    return float(100 * ratio(np.asarray(part, float), np.asarray(whole, float)))
