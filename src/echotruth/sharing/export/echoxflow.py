"""Recordings of EchoXFlow: grey levels of the lines before scan conversion, as Zarr, and the catalogue of all.

Stenhede et al. 2026, EchoXFlow: A Beamspace Echocardiography Dataset for Cardiac Motion, Flow, and Function,
arXiv:2605.05447. The layout is what their loader reads (github.com/Ahus-AIM/EchoXFlow, b782e0a).
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray

from echotruth.imaging.bmode import clip_gain, eight_bit, envelope, log_compress
from echotruth.seeds import generator
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError
from echotruth.sharing.export.rf import open_rf

NAME = "2d_brightness_mode"
FRAMES, TIMES = f"data/{NAME}", f"timestamps/{NAME}"


def write(clip: ExportedClip, path: Path) -> None:
    """Write the B-mode of a view in beamspace, its times and its sector."""
    rf = open_rf(clip)
    if rf.attrs["scan"] != "sector":
        raise ExportError(f"{clip.name}: has parallel lines, and echoxflow holds sectors: export it as uff or zea")
    about = {"exam_id": clip.case.id, "recording_id": clip.name, "source_recording_id": None, "synthetic": True}
    group = zarr.create_group(path, zarr_format=3, attributes=about | {"recording_manifest": _manifest(rf)})
    levels = group.create_array(FRAMES, data=_levels(clip, rf))
    levels.attrs["content_type"] = NAME
    group.create_array(TIMES, data=clip.time.astype(np.float32))


def _manifest(rf: xr.Dataset) -> dict[str, Any]:
    """What the recording holds, and the sector: ranges of its samples in m, angles of its lines in rad."""
    first, last = map(float, rf.line_angle.values[[0, -1]])
    depth = dict(zip(("depth_start_m", "depth_end_m"), map(float, rf.range.values[[0, -1]]), strict=True))
    sector = {
        "semantic_id": "bmode",
        "frames": {"array_path": FRAMES, "format": "zarr_array"},
        "timestamps": {"array_path": TIMES, "format": "zarr_array"},
        "geometry": depth | {"tilt_rad": (first + last) / 2, "width_rad": last - first},
    }
    return {"manifest_type": "2d", "sectors": [sector]}


def _levels(clip: ExportedClip, rf: xr.Dataset) -> NDArray[np.uint8]:
    """Grey levels (frame, range, line): those of the B-mode, without what it does to pixels."""
    config, lines = clip.case.config, rf.lines.values
    random = generator(clip.case, clip.view, "dropout")
    gain = clip_gain(config.probe, config.bmode, lines.shape[:2], rf.range.values, random)
    levels = log_compress(envelope(lines, gain), config.bmode.dynamic_range_dB, config.bmode.gain_dB)
    return eight_bit(levels, config.bmode).transpose(0, 2, 1)


def write_summary(clips: Sequence[ExportedClip], path: Path, trackers: Sequence[str]) -> None:
    """Write the catalogue by which the loader finds the recordings beside it: the record set of Croissant."""
    records = {"@type": "cr:RecordSet", "@id": "recordings", "name": "recordings", "data": [*map(_record, clips)]}
    path.write_text(json.dumps({"recordSet": [records]}, indent=2), encoding="utf-8")


def _record(clip: ExportedClip) -> dict[str, Any]:
    values = {
        "exam_id": clip.case.id,
        "recording_id": clip.name,
        "zarr_path": f"{clip.name}.zarr",
        "modes": [NAME],
        "content_types": [NAME],
        "frame_counts_by_content_type": {NAME: len(clip.time)},
        "median_delta_time_by_content_type": {NAME: clip.frame_time},
        "array_paths": [FRAMES, TIMES],
    }
    return {f"recordings/{name}": value for name, value in values.items()}
