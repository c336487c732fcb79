"""MATLAB: a MAT-file of version 5, which every MATLAB since 7 and Octave read."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.repository import estimates
from echotruth.sharing.export.clip import Clip
from echotruth.sharing.export.error import ExportError

HEADER = b"MATLAB 5.0 MAT-file, written by echotruth".ljust(116)
"""In place of the one that holds the date, so that the bytes are the same twice."""

MAX_BYTES = 2**31 - 1
"""Largest variable of version 5, as a struct with all its fields is one (MathWorks, MAT-File Versions)."""


def write(clip: Clip, path: Path, trackers: Sequence[str]) -> None:
    """Write the struct `clip`: images and truth as (axial, lateral, ..., frame), and the displacement of trackers.

    Rows are axial and columns lateral, as MATLAB shows images. `tracked.TRACKER.displacement` is on the grid of the
    trackers, whose coordinates are `tracked.axial_m` and `tracked.lateral_m`.

    Parameters
    ----------
    clip : Clip
    path : Path
    trackers : sequence of str

    Raises
    ------
    ExportError
        If the struct is larger than version 5 can hold.
    """
    from scipy.io import savemat

    truth = clip.truth()
    values: dict[str, object] = {
        str(name): np.moveaxis(array.transpose("frame", "axial", "lateral", ...).values, 0, -1)
        for name, array in truth.data_vars.items()
        if {"frame", "axial", "lateral"} <= set(array.dims)
    }
    size = sum(array.nbytes for array in values.values() if isinstance(array, np.ndarray))
    if size > MAX_BYTES:
        raise ExportError(f"{clip.name} takes {size / 1e9:.1f} GB, and a MAT-file holds 2.1: use a smaller --size")
    values |= {"case": clip.case.id, "view": clip.view, "synthetic": True}
    values |= {"axial_m": clip.axial, "lateral_m": clip.lateral, "time_s": clip.time, "spacing_m": clip.spacing}
    values |= {"plane_origin_m": clip.plane.origin, "plane_axes": clip.plane.axes}
    values["vectors"] = np.array(["lateral", "axial", "elevation"], object)
    values["strain_components"] = np.array(["RR", "CC", "LL", "RC", "RL", "CL"], object)
    grid = {f"{name}_m": truth[f"grid_{name}"].values for name in ("axial", "lateral")}
    values["tracked"] = grid | {tracker: {"displacement": _displacement(clip, tracker)} for tracker in trackers}
    with path.open("wb") as file:
        savemat(file, {"clip": values}, long_field_names=True, do_compression=True, oned_as="column")
        file.seek(0)
        file.write(HEADER)


def _displacement(clip: Clip, tracker: str) -> NDArray[Any]:
    """Displacement since end-diastole by a tracker, (axial, lateral, 2, frame), m."""
    found = estimates.tracked(clip.repository, clip.case.id, clip.view, tracker, clip.size, "displacement")
    return np.moveaxis(found["displacement"], 0, -1)
