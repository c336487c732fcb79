"""Tables of a repository for readers of any kind: its clips, and the checksums of all files of its store."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import numpy as np
import zarr
from numpy.typing import NDArray

from echotruth.repository import ledger
from echotruth.repository.description.facts import Facts
from echotruth.repository.description.files import damaged

CLIPS, CHECKSUMS = "clips.csv", "checksums.sha256"
"""Names of the tables."""

CLIP_COLUMNS = {
    "case": "id of the heart, as in cases.csv",
    "view": "name of the view",
    "size_px": "pixels along a side",
    "frames": "number of frames, the first at end-diastole",
    "frame_time_s": "time from one frame to the next, s",
    "pixel_axial_m": "height of a pixel, m",
    "pixel_lateral_m": "width of a pixel, m",
    "array": "path of the array in the store",
    "case_row": "index of the heart along the dimension case",
    "view_index": "index of the view along the dimension view",
    "path": "file with the whole clip, a shard of the array",
    "bytes": "size of that file",
    "sha256": "SHA-256 of that file",
}
"""Columns of the table of clips -> what they hold."""


def checksums(facts: Facts) -> bytes:
    """Checksums of all files of the store, as `sha256sum --check` takes them."""
    return "".join(f"{file.sha256}  {file.path}\n" for file in facts.files).encode()


def clips(facts: Facts) -> bytes:
    """Table of the clips: one row for each heart, view and size that has B-mode images."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CLIP_COLUMNS)
    writer.writerows(_rows(facts))
    return text.getvalue().encode()


def _rows(facts: Facts) -> Iterator[list[object]]:
    sizes = {file.path: file.size for file in facts.files}
    cases, views = (ledger.rows(facts.folder / name) for name in ("registry.txt", "views.txt"))
    views = views or {view: index for index, view in enumerate(facts.config.views)}
    grids: dict[str, tuple[NDArray[np.float64], float, float]] = {}
    for record, entries in facts.records:
        if record.stage != "bmode":
            continue
        for path, checksum in sorted(entries.get("sha256", {}).items(), key=lambda item: _size(item[0])):
            array = path.partition("/c/")[0]
            group = array.rpartition("/")[0]
            if group not in grids:
                grids[group] = _grid(facts, group)
            times, axial, lateral = grids[group]
            row, view = cases[record.case], views[str(record.view)]
            step = (times[row, -1] - times[row, 0]) / (times.shape[1] - 1) if times.shape[1] > 1 else 0.0
            file = f"{facts.store}/{path}"
            steps = (f"{x:.9g}" for x in (step, axial, lateral))
            clip = [record.case, record.view, _size(path), times.shape[1], *steps]
            yield [*clip, array, row, view, file, sizes[file], checksum]


def _size(path: str) -> int:
    """Size of the images in a group, as 512 in bmode/512/image."""
    return next(int(part) for part in path.split("/") if part.isdigit())


def _grid(facts: Facts, group: str) -> tuple[NDArray[np.float64], float, float]:
    """Times of the frames (case, frame), s, and height and width of a pixel, m."""
    store = facts.folder / facts.store
    times, axial, lateral = (_read(facts.folder, store / group / name) for name in ("time", "axial", "lateral"))
    return times, _step(axial), _step(lateral)


def _read(folder: Path, path: Path) -> NDArray[np.float64]:
    try:
        return np.asarray(zarr.open_array(path, mode="r")[...], dtype=float)
    except Exception:  # damaged arrays fail in many ways, for which Zarr and its codecs have errors of their own
        raise damaged(folder, path) from None


def _step(values: NDArray[np.float64]) -> float:
    return float((values[-1] - values[0]) / max(len(values) - 1, 1))
