"""Arrays of a repository, opened where they are read: the same in every process, after a fork and after a spawn."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.repository.ledger import repository_folder, rows
from echotruth.repository.store import schema_of


class Reader:
    """Reads parts of the arrays of a repository, without more chunks than it needs.

    An array is opened when a process first reads from it, and no process uses what another one opened: Zarr has a
    thread for reading, which a forked process does not inherit. So a reader may be copied, pickled, or made before
    workers start.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    """

    def __init__(self, repository: str | Path) -> None:
        self.folder = repository_folder(repository).resolve()
        self.path = self.folder / f"{self.folder.name}.zarr"
        self._opened: dict[str, zarr.Array[Any]] = {}
        self._process = os.getpid()

    def __getstate__(self) -> dict[str, Any]:
        return {"folder": self.folder, "path": self.path, "_opened": {}, "_process": 0}

    @property
    def config(self) -> Config:
        """Configuration of the repository."""
        return load(self.folder / "config.yaml")

    @property
    def cases(self) -> dict[str, int]:
        """Row of every case that was ever registered."""
        return rows(self.folder / "registry.txt")

    @property
    def views(self) -> dict[str, int]:
        """Index of every view that was ever registered."""
        return rows(self.folder / "views.txt")

    def array(self, path: str) -> zarr.Array[Any]:
        """An array by its path, as "bmode/256/image"; opened once in each process."""
        if self._process != os.getpid():
            self._opened, self._process = {}, os.getpid()
        if path not in self._opened:
            if not self.has(path):
                remedy = "run its configuration again with this version of echotruth"
                raise FileNotFoundError(f"{self.folder}: has no array {path}: {remedy}")
            self._opened[path] = zarr.open_array(self.path, path=path, mode="r")
        return self._opened[path]

    def read(self, path: str, *index: Any) -> NDArray[Any]:
        """Part of an array, given its indices and slices; only the chunks that hold it are read."""
        return np.asarray(self.array(path)[index])

    def has(self, path: str) -> bool:
        """Whether the repository has such an array."""
        return (self.path / path / "zarr.json").is_file()

    def is_written(self, path: str, *row: int) -> bool:
        """Whether the job of a case (and view) wrote its part of an array; of others Zarr reads fill values."""
        group, _, name = path.rpartition("/")
        array = next(array for array in schema_of(group) if array.name == name)
        return (self.path / group / array.shard(row)).is_file()

    def labels(self, path: str) -> list[str]:
        """Values of a coordinate or column that is text, as "cases/status"; empty if there is none."""
        return [str(value) for value in np.asarray(self.array(path)[...])] if self.has(path) else []
