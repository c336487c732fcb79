"""Tables of a repository for readers of any kind: its clips, and the checksums of all files of its store."""

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import zarr
from numpy.typing import NDArray

from echotruth.repository.description.facts import Facts
from echotruth.repository.description.files import damaged

CLIPS, CHECKSUMS = "clips.csv", "checksums.sha256"
"""Names of the tables."""


def checksums(facts: Facts) -> bytes:
    """Checksums of all files of the store, as `sha256sum --check` takes them."""
    return "".join(f"{file.sha256}  {file.path}\n" for file in facts.files).encode()


def clips(facts: Facts, columns: Iterable[str]) -> bytes:
    """Table of the clips: one row for each heart, view and size that has B-mode images.

    Parameters
    ----------
    facts : Facts
    columns : iterable of str
        Names of the columns, in order.
    """
    return pd.DataFrame(_rows(facts), columns=list(columns)).to_csv(index=False).encode()


def _rows(facts: Facts) -> Iterator[dict[str, object]]:
    repository = facts.repository
    sizes = {file.path: file.size for file in facts.files}
    read = cache(lambda path: _read(repository.folder, path))
    images = [(job, *item) for job, written in facts.images.items() for item in written.items()]
    for record, path, checksum in sorted(images, key=lambda image: (image[0].path, _size(image[1]))):
        array, row = path.partition("/c/")[0], repository.rows[record.case]
        group = (repository.store / array).parent
        file = f"{facts.store}/{path}"
        yield {
            "case": record.case,
            "view": record.view,
            "size_px": _size(path),
            "frames": read(group / "time").shape[1],
            "frame_time_s": _step(read(group / "time")[row]),
            "pixel_axial_m": _step(read(group / "axial")),
            "pixel_lateral_m": _step(read(group / "lateral")),
            "array": array,
            "case_row": row,
            "view_index": repository.views[str(record.view)],
            "path": file,
            "bytes": sizes[file],
            "sha256": checksum,
        }


def _size(path: str) -> int:
    """Size of the images in a group, as 512 in bmode/512/image."""
    return next(int(part) for part in path.split("/") if part.isdigit())


def _read(folder: Path, path: Path) -> NDArray[np.float64]:
    try:
        return np.asarray(zarr.open_array(path, mode="r", zarr_format=3)[...], dtype=float)
    except Exception:  # damaged arrays fail in many ways, for which Zarr and its codecs have errors of their own
        raise damaged(folder, path) from None


def _step(values: NDArray[np.float64]) -> str:
    """From one of evenly spaced values to the next."""
    return f"{(values[-1] - values[0]) / max(len(values) - 1, 1):.9g}"
