"""OpenPIV's window deformation as it is, frame to frame, as a tracker for `echotruth evaluate`.

    pip install '.[openpiv]'
    echotruth evaluate out/demo --tracker examples.openpiv_tracker:track

OpenPIV is under the GPL-3; echotruth itself does not use it.
"""

from itertools import pairwise

import numpy as np
from openpiv.windef import PIVSettings, simple_multipass
from scipy.interpolate import RegularGridInterpolator


def track(frames, points, mask, spacing, frame_time, seed, windows_mm=(1.5, 0.75, 0.375), margin_mm=1.0):
    """Displacement of points (frame, n, 2) in px since the first frame; see docs/trackers.md."""
    passes = tuple(max(8, round(1e-3 * side / spacing)) for side in windows_mm)
    settings = PIVSettings(windowsizes=passes, overlap=tuple(side // 2 for side in passes), num_iterations=len(passes))
    corner, end = around(mask, round(1e-3 * margin_mm / spacing))
    frames = frames[:, corner[1] : end[1], corner[0] : end[0]]
    places = [points - corner]
    for first, second in pairwise(frames):
        places.append(places[-1] + step(first, second, places[-1], settings))
    return np.stack(places) - places[0]


def around(mask, margin):
    """First and last corner (lateral, axial; px) of the box about the wall: OpenPIV's validation rejects black."""
    inside = np.argwhere(mask)[:, ::-1]
    return np.maximum(inside.min(0) - margin, 0), inside.max(0) + margin + 1


def step(first, second, places, settings):
    """Motion from one frame to the next at places (n, 2), px; NaN beyond the outermost windows."""
    x, y, u, v, _ = simple_multipass(first, second, settings)
    # OpenPIV counts from the edge of the first pixel, and turns its result upside down, for an axis that points up.
    centres = y[::-1, 0] - 0.5, x[0] - 0.5
    field = RegularGridInterpolator(centres, np.stack([u, -v], axis=-1), bounds_error=False)
    return field(places[:, ::-1])
