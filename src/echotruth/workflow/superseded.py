"""Arrays of trackers that no longer fit the configuration, set aside until their results were taken over.

The numbers of trackers and of image sizes are lengths of their arrays. If one changes, the arrays are created anew and
empty, but the results of trackers at sizes that stay the same need not be made anew: jobs find them here.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from echotruth.config import Config
from echotruth.repository.tracked import TRACKING

FOLDER = "scratch/superseded"


def set_aside(folder: Path, config: Config) -> None:
    """Set aside the arrays whose number of trackers or of image sizes is not that of a configuration.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
        The configuration for which arrays are about to be laid out.
    """
    generation = folder / FOLDER / str(len(list(folder.glob(f"{FOLDER}/*"))))
    wanted = {"size": len(config.bmode.sizes), "tracker": len(config.tracking.trackers)}
    for array in TRACKING:
        name = f"tracking/{array.name}"
        stored = folder / f"{config.name}.zarr" / name
        if any(_length(stored, dimension) not in (None, length) for dimension, length in wanted.items()):
            (generation / name).parent.mkdir(parents=True, exist_ok=True)
            stored.rename(generation / name)


def roots(folder: Path, store: Path) -> Iterator[Path]:
    """Folders below which results of trackers may stand: the store, then what was set aside, the latest first."""
    yield store
    yield from sorted(folder.glob(f"{FOLDER}/*"), key=lambda path: int(path.name), reverse=True)


def _length(array: Path, dimension: str) -> int | None:
    """Length of a dimension of an array on disk; None if there is no such array."""
    try:
        metadata = json.loads((array / "zarr.json").read_text(encoding="utf-8"))
        return int(metadata["shape"][metadata["dimension_names"].index(dimension)])
    except (FileNotFoundError, KeyError, ValueError):
        return None
