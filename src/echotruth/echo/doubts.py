"""What of a tracked echo should make one doubt its strain."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.aha import SEGMENT_NAMES
from echotruth.arrays import Floats
from echotruth.tracking.periodicity import repetition, rms_length
from echotruth.tracking.plausibility import REFERENCE_WALL_MM

LARGEST_FIRST, LARGEST_DRIFT, LEAST_COVERAGE = 1.1, 20.0, 90.0
"""Largest cavity of the cycle over that of the first frame; drift, %; and share of points with an estimate at
end-systole, %: beyond these a note says so. An infarct that bulges before the valve opens makes a cavity 1.08 times as
large, in truth, in the short axis of the sample."""
LEAST_DRIFT_PX = 1 / 3
"""RMS displacement in the last frame below which there is no note of drift."""

LEAST_MOTION = 0.1
"""RMS displacement of the frame in which it is largest, over the thickness of the wall, below which a note says so; it
is a third and more in hearts."""

LEAST_QUALITY = 0.25
"""Mean quality at end-systole below which a note says so (docs/own_echo.md has that of noise and of clips)."""

FEWEST_A_CYCLE = 10
"""Frames of a cycle below which a note says so. End-systole is up to half a frame from the next frame: of a strain that
goes as sin(pi t)^2 over the cycle a share sin(pi / 2 n)^2 is missed then, 2 % with n = 10 frames and 10 % with 5."""
LARGEST_STEP = 0.25
"""RMS displacement from one frame to the next, over the thickness of the wall, above which a note says so."""

UNEVEN, LEAST_DIFFERENCE = 3.0, 0.05
"""Ratio of the strains of two segments from which a note says so, if they differ by this much at least."""

LINE_STEPS = 200
"""Pieces of a line between which crossings are sought."""

REFERENCE_CYCLE = 0.12
"""Duration of a cycle of the heart with the wall `REFERENCE_WALL_MM`, s."""
LARGEST_DEPARTURE = 4.0
"""Thickness of the wall over that which suits the duration of the cycle, or the inverse, beyond which a note says so.
In mammals the heart's lengths go with the cube root of the body's mass, the duration of a cycle with the fourth root
(Dawson 2014, Systems 2:168, doi 10.3390/systems2020168), thus the thickness with the duration to the power of 4/3."""


def doubts(strain: xr.Dataset, thickness: float) -> list[str]:
    """What should make one doubt.

    Parameters
    ----------
    strain : Dataset
        As :func:`.strain.speckle_tracking` returns it, but for its notes.
    thickness : float
        Of the wall at end-diastole, m.

    Returns
    -------
    list of str
        A plain sentence each, without a full stop.
    """
    moved, time = strain["displacement"].values, strain["time"].values
    found = (
        _size(thickness, time),
        _beats(moved, time),
        _rate(moved, thickness),
        _stillness(moved, thickness),
        _beginning(strain["cavity_area"].values),
        _drift(strain, moved),
        _estimates(strain),
        _folds(strain),
        _segments(strain),
    )
    return [text for text in found if text]


def _size(thickness: float, time: Floats) -> str:
    """Of a wall of a thickness (m) that does not suit the duration of the cycle: the scale is wrong."""
    duration = float(time[-1] - time[0]) * len(time) / (len(time) - 1)
    suited = REFERENCE_WALL_MM * (duration / REFERENCE_CYCLE) ** (4 / 3)
    if 1 / LARGEST_DEPARTURE <= 1e3 * thickness / suited <= LARGEST_DEPARTURE:
        return ""
    return (
        f"a wall {1e3 * thickness:.2g} mm thick does not go with a cycle of {1e3 * duration:.0f} ms, as a heart has "
        f"whose wall is about {suited:.2g} mm thick: are spacing and frame time right, and is it one cycle?"
    )


def _beats(moved: Floats, time: Floats) -> str:
    """Of a motion that comes again."""
    if not (period := repetition(moved)):
        return ""
    return (
        f"the motion comes again after {1e3 * (time[period] - time[0]):.0f} ms, so that the clip holds "
        f"{len(moved) / period:.2g} beats: choose a cycle of {period} frames"
    )


def _rate(moved: Floats, thickness: float) -> str:
    """Of too few frames."""
    if len(moved) < FEWEST_A_CYCLE:
        missed = 100 * np.sin(np.pi / 2 / len(moved)) ** 2
        return (
            f"the cycle has only {len(moved)} frames, so that {missed:.0f} % of the strain may be missed between two: "
            f"record {FEWEST_A_CYCLE} or more"
        )
    steps = rms_length(np.diff(moved, axis=0)) / thickness
    if not np.nanmax(steps, initial=0) > LARGEST_STEP:
        return ""
    return (
        f"the wall moves by {100 * np.nanmax(steps):.0f} % of its thickness up to frame {np.nanargmax(steps) + 1} from "
        "the one before: record more frames a second"
    )


def _stillness(moved: Floats, thickness: float) -> str:
    """Of a wall that hardly moves."""
    largest = np.nanmax(rms_length(moved), initial=0) / thickness
    if not np.isfinite(moved).any() or largest >= LEAST_MOTION:
        return ""
    return f"the wall moves by {100 * largest:.2g} % of its thickness at most, as if nothing moved: is it a heart?"


def _beginning(area: Floats) -> str:
    """Of a cavity, (frame,), that is largest elsewhere."""
    if not np.nanmax(area, initial=0) > LARGEST_FIRST * area[0]:
        return ""
    where = f"the cavity is largest in frame {np.nanargmax(area)}, by {100 * (np.nanmax(area) / area[0] - 1):.0f} %"
    return f"{where} more than in the first: begin the cycle at end-diastole"


def _drift(strain: xr.Dataset, moved: Floats) -> str:
    """Of a motion that does not close; the last frame is one step before the end of the cycle."""
    length, drift = rms_length(moved), strain.attrs["drift_percent"]
    step = 100 * np.nanmax(rms_length(np.diff(moved, axis=0)), initial=0) / (np.nanmax(length, initial=0) or 1)
    if not drift > max(LARGEST_DRIFT, step) or length[-1] < LEAST_DRIFT_PX * strain.attrs["spacing"]:
        return ""
    return f"{drift:.0f} % of the largest displacement is left in the last frame: is it one whole cycle?"


def _estimates(strain: xr.Dataset) -> str:
    """Of points without an estimate at end-systole, or with a poor one."""
    quality = strain["quality"].values[strain.attrs["es_frame"]]
    if not np.isfinite(strain["quality"]).any() and np.isfinite(strain["displacement"]).any():
        return "the tracker does not say how sure it is: nothing tells a motion that it has not found"
    known = np.isfinite(strain["displacement"].values[strain.attrs["es_frame"]]).all(axis=-1)
    if (coverage := 100 * known.mean()) < LEAST_COVERAGE:
        return f"only {coverage:.0f} % of the points have an estimate at end-systole"
    if (mean := quality[np.isfinite(quality)].mean()) < LEAST_QUALITY:
        return f"the quality at end-systole is {mean:.2f}, and below {LEAST_QUALITY} in noise: the motion is not found"
    return ""


def _folds(strain: xr.Dataset) -> str:
    """Of a line of the wall that crosses itself."""
    contour = strain["line_contour"].values
    for number, name in enumerate(strain["contour"].values):
        line = strain["line_position"].values[:, contour == number]
        step = max(1, line.shape[1] // LINE_STEPS)
        frames = np.flatnonzero([_crosses(points[::step]) for points in line])
        if len(frames):
            where = "as it was drawn" if frames[0] == 0 else f"in {len(frames)} frames, first in {frames[0]}"
            return f"the {name} line crosses itself {where}: see there whether the wall is drawn and followed right"
    return ""


def _crosses(line: Floats) -> bool:
    """Whether a line (n, 2) crosses itself; pieces that are not known do not."""
    start, piece = line[:-1], np.diff(line, axis=0)
    sides = [_cross(piece[:, None], ends[None] - start[:, None]) for ends in (start, line[1:])]
    apart = sides[0] * sides[1] < 0
    return bool((apart & apart.T).any())


def _cross(first: Floats, second: Floats) -> Floats:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def _segments(strain: xr.Dataset) -> str:
    """Of segments that differ."""
    at_end = strain["segment_strain"].isel(frame=strain.attrs["es_frame"])
    values: NDArray[np.float64] = at_end.sel(measure="engineering", wall_component="TT").values
    if not np.isfinite(values).any():
        return ""
    ordered = values * (np.sign(np.nansum(values)) or 1)
    least, most = int(np.nanargmin(ordered)), int(np.nanargmax(ordered))
    if UNEVEN * ordered[least] > ordered[most] or ordered[most] - ordered[least] < LEAST_DIFFERENCE:
        return ""
    named = (f"{strain['aha'].values[one]} {SEGMENT_NAMES[one]} {100 * values[one]:.0f} %" for one in (least, most))
    return f"segments differ threefold or more ({', '.join(named)}): disease, or a wall that is not followed"
