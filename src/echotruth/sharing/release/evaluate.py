"""Errors of tracked points in a clip against their true motion; needs NumPy alone.

    python evaluate.py healthy_mid_256.npz tracked.npz

The first file is a clip of the release. Its arrays:

    frames (frame, axial, lateral)  uint8, B-mode; depth downwards; frame 0 is end-diastole
    mask (axial, lateral)           bool, the wall in frame 0
    points (point, 2)               px: lateral (column), axial (row), in frame 0
    spacing_m, frame_time_s         distance of pixel centres; time of each frame
    seed                            for trackers that draw random numbers
    displacement (frame, point, 2)  px: true motion since frame 0, lateral, axial
    es_frame                        frame of end-systole
    frame_step                      every so manieth frame was given to the trackers of the leaderboard

The second file holds what a tracker found: `displacement` (frame, point, 2), px, of the same points; NaN where it found
nothing. The errors are those of the leaderboard of echotruth, at end-systole unless something else is said.
"""

import json
import sys

import numpy as np


def evaluate(tracked, true, spacing_m, es_frame):
    """Compare tracked with true displacement.

    Parameters
    ----------
    tracked, true : ndarray of shape (frame, point, 2), px
        Displacement since frame 0; NaN where unknown.
    spacing_m : float
        Distance of pixel centres, m.
    es_frame : int
        Frame of end-systole.

    Returns
    -------
    dict of float
        nrmse_percent: RMS length of the error over that of the true displacement, of the points that are tracked;
        nrmse_all_percent: the same of all points, of which those that are not tracked count as displaced by 0;
        nrmse_cycle_percent: of all frames together. epe_um, epe_median_um: mean and median length of the error.
        drift_um: RMS length of the error in the last frame. coverage_percent: share of the points that are tracked.

    Raises
    ------
    ValueError
        If the shapes differ.
    """
    tracked, true = np.asarray(tracked, float), np.asarray(true, float)
    if tracked.shape != true.shape:
        raise ValueError(f"displacement has the shape {tracked.shape}, and must have {true.shape}: frame, point, 2")
    error, length = np.linalg.norm(tracked - true, axis=-1), np.linalg.norm(true, axis=-1)
    known, in_wall = np.isfinite(error), np.isfinite(length)
    filled = np.where(known, error, length)  # the error of a point that is said not to move
    es = es_frame
    return {
        "nrmse_percent": _percent(error[es][known[es]], length[es][known[es]]),
        "nrmse_all_percent": _percent(filled[es][in_wall[es]], length[es][in_wall[es]]),
        "nrmse_cycle_percent": _percent(error[known], length[known]),
        "epe_um": 1e6 * spacing_m * _of(np.mean, error[es][known[es]]),
        "epe_median_um": 1e6 * spacing_m * _of(np.median, error[es][known[es]]),
        "drift_um": 1e6 * spacing_m * _of(_rms, error[-1][known[-1]]),
        "coverage_percent": 100 * float(known[es].sum() / max(in_wall[es].sum(), 1)),
    }


def _rms(values):
    return np.sqrt(np.mean(values**2))


def _of(statistic, values):
    """A statistic, NaN of no values."""
    return float(statistic(values)) if values.size else float("nan")


def _percent(error, true):
    whole = _of(_rms, true)
    return 100 * _of(_rms, error) / whole if whole > 0 else float("nan")


def main(clip_path, tracked_path):
    """Print the errors as JSON."""
    try:
        with np.load(clip_path, allow_pickle=False) as clip, np.load(tracked_path, allow_pickle=False) as found:
            errors = evaluate(
                found["displacement"], clip["displacement"], float(clip["spacing_m"]), int(clip["es_frame"])
            )
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"evaluate.py: {clip_path}, {tracked_path}: {' '.join(str(error).split())}")
    print(json.dumps(errors, indent=1))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
