"""Errors of the motion from frame to frame, as benchmarks of optical flow print them (Baker et al., Int J Comput Vis
2011; 92:1, doi 10.1007/s11263-010-0390-2).
"""

from __future__ import annotations

import numpy as np

from echotruth.arrays import Floats


def flow_error(tracked: Floats, true: Floats) -> dict[str, float]:
    """Mean end-point error and mean angular error of the steps of points from each frame to the next.

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
