"""What a repository is and holds, at a glance: read from its configuration, tables and records, not from its arrays."""

from __future__ import annotations

import os
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.repository.inventory import files_below
from echotruth.repository.ledger import repository_folder, rows

UNFINISHED = "unfinished"
"""Status of a case that no run has published."""


@dataclass(frozen=True)
class Overview:
    """A repository at a glance."""

    folder: Path
    """`out/NAME`."""
    config: Config
    statuses: dict[str, int]
    """Status -> number of cases that have it, those of earlier configurations (`retired`) included."""
    example: str
    """First complete case; "" if there is none."""
    external: list[str]
    """Trackers from outside that were evaluated on it."""
    packages: dict[str, str]
    """Versions of the packages that made it; empty if it is not published yet."""
    files: int
    """Number of all its files."""
    bytes: int
    """Size of all its files."""


def overview(repository: str | Path) -> Overview:
    """Look at a repository.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    ConfigError
        If its configuration cannot be read.
    """
    folder = repository_folder(repository)
    config = load(folder / "config.yaml")
    store = folder / f"{folder.resolve().name}.zarr"
    files, size = _size(folder)
    external = sorted({path.stem for path in (folder / "external").glob("[!.]*") if path.suffix in (".csv", ".zarr")})
    statuses = _statuses(folder, store)
    counted = dict(Counter(statuses.values()).most_common())
    example = next((case for case, status in statuses.items() if status == "complete"), "")
    return Overview(folder, config, counted, example, external, _packages(store), files, size)


def _statuses(folder: Path, store: Path) -> dict[str, str]:
    """Status of every case that was ever registered."""
    registered = list(rows(folder / "registry.txt"))
    found: list[str] = []
    if (store / "cases/status/zarr.json").is_file():
        values = np.asarray(zarr.open_array(store, path="cases/status", mode="r")[...])
        found = [str(value) or UNFINISHED for value in values]
    return dict(zip(registered, [*found, *[UNFINISHED] * (len(registered) - len(found))], strict=False))


def _packages(store: Path) -> dict[str, str]:
    if not (store / "zarr.json").is_file():
        return {}
    attributes: dict[str, Any] = zarr.open_group(store, mode="r").attrs.asdict()
    return dict(attributes.get("packages", {}))


def _size(folder: Path) -> tuple[int, int]:
    """Number and size of the files below a folder; those that vanish meanwhile are left out."""
    number = size = 0
    for path in files_below(folder):
        with suppress(FileNotFoundError):
            size += os.lstat(f"{folder}/{path}").st_size
            number += 1
    return number, size
