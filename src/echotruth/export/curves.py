"""Curves as CSV: one row a frame, one column a quantity with its unit in its name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.export.clip import Clip
from echotruth.export.tracked import tracked
from echotruth.fem.volume import cell_volumes

COMPONENTS = ("RR", "CC", "LL")
"""Of the heart's strain: radial, circumferential, longitudinal."""

IMAGE_COMPONENTS = ("RR", "TT", "RT")
"""Of strain in the image: radial, tangential, shear."""

CURVES = {
    "pressure_kPa": ("mechanics", "pressure", 1e-3),
    "volume_uL": ("mechanics", "volume", 1e9),
    "active_tension_kPa": ("mechanics", "active_tension", 1e-3),
    "rotation_base_deg": ("physiology", "rotation_base", np.degrees(1)),
    "rotation_apex_deg": ("physiology", "rotation_apex", np.degrees(1)),
    "twist_deg": ("physiology", "twist", np.degrees(1)),
    "apex_motion_um": ("physiology", "apex_motion", 1e6),
    "base_motion_um": ("physiology", "base_motion", 1e6),
}
"""Column -> group and array of the heart, and factor from SI to the unit of the column."""


def write(clip: Clip, path: Path, trackers: Sequence[str]) -> None:
    """Write the curves of the heart, and what each tracker found in the clip beside its truth.

    Empty cells are unknown: the pressure of a prescribed motion, or a segment that a view does not show.

    Parameters
    ----------
    clip : Clip
    path : Path
    trackers : sequence of str
    """
    columns: dict[str, NDArray[np.generic]] = {"frame": np.arange(len(clip.time)), "time_ms": 1e3 * clip.time}
    for name, (group, array, factor) in CURVES.items():
        columns[name] = factor * clip.job.read(group, array)[array]
    columns |= _heart_strain(clip)
    for tracker in trackers:
        columns |= _tracked_strain(clip, tracker)
    pd.DataFrame(columns).to_csv(path, index=False, float_format="%.9g", lineterminator="\n")


def _heart_strain(clip: Clip) -> dict[str, Floats]:
    """Strain of the wall and of its segments since end-diastole, %."""
    strain, wall = (clip.job.read("kinematics", name)[name] for name in ("strain", "strain_mean"))
    columns = {f"strain_{name}_percent": 100 * wall[:, k] for k, name in enumerate(COMPONENTS)}
    volume, segment = cell_volumes(clip.heart.nodes, clip.heart.cells), clip.heart.arrays["fibres"]["segment"]
    for number in range(1, 18):
        share = np.where(segment == number, volume, 0.0)
        for k, name in enumerate(COMPONENTS):
            mean = strain[..., k] @ (share / share.sum()) if share.any() else np.full(len(strain), np.nan)
            columns[f"segment_{number:02d}_strain_{name}_percent"] = 100 * mean
    return columns


def _tracked_strain(clip: Clip, tracker: str) -> dict[str, Floats]:
    """Strain in the image by a tracker, and that of the heart at the points where it has one, %."""
    columns = {}
    for what in ("tracked", "true"):
        means = tracked(clip, "evaluation", f"{what}_global_strain", tracker)
        segments = tracked(clip, "evaluation", f"{what}_segment_strain", tracker)
        if what == "true":  # by each reference; the first is the heart
            means, segments = means[0], segments[0]
        for k, name in enumerate(IMAGE_COMPONENTS):
            columns[f"{tracker}_{what}_strain_{name}_percent"] = 100 * means[:, k]
            for number, values in enumerate(segments[..., k].T, start=1):
                columns[f"{tracker}_segment_{number:02d}_{what}_strain_{name}_percent"] = 100 * values
    return columns
