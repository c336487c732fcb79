"""Keeping what a tracker from outside found, beside its scores (:mod:`echotruth.repository.kept`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
import zarr
from numpy.typing import ArrayLike

from echotruth.config import Config
from echotruth.repository import layout, ledger, schema
from echotruth.repository.kept import grid_and_sizes, store_path
from echotruth.repository.store import Store

Found = Mapping[str, Mapping[str, ArrayLike]]
"""Arrays that a tracker left of one clip by group and name, without the dimensions case, view, size and tracker."""


class KeptStore(Store):
    """A store of one tracker, whose record of its structure lies in its own folder."""

    @property
    def record(self) -> Path:
        """Path of the record of the structure."""
        return self.path / "structure.json"


@dataclass(frozen=True)
class Keeping:
    """A store of one tracker in the making; it gets its name when it is whole.

    Attributes
    ----------
    folder : Path
        Folder of the repository.
    config : Config
        Its configuration.
    tracker : str
    """

    folder: Path
    config: Config
    tracker: str

    @property
    def draft(self) -> Path:
        """Folder of the store as long as it is not whole."""
        return self.folder / "external" / f".{self.tracker}.zarr.partial"

    def begin(self) -> None:
        """Lay out the empty arrays, in place of those of an evaluation that was broken off."""
        self.discard()
        rows, views = (list(ledger.rows(self.folder / name)) for name in ("registry.txt", "views.txt"))
        repository = self.folder / f"{self.config.name}.zarr"
        time = np.asarray(zarr.open_array(repository, path="mechanics/time", mode="r", zarr_format=3)[...])
        some = next(iter(self.config.tracking.trackers.values()))
        tracking = self.config.tracking.model_copy(update={"trackers": {self.tracker: some}})
        config = self.config.model_copy(update={"tracking": tracking})
        arrays = {path: found for path, found in schema.groups(config).items() if path.endswith(f"/{self.tracker}")}
        KeptStore(self.draft).lay_out(arrays, {}, layout.labels(config, rows, time, views) | layout.positions(config))

    def write(self, place: tuple[int, ...], clips: Mapping[int, Found]) -> None:
        """Write what was found in the clips of one view.

        Parameters
        ----------
        place : tuple of int
            Row of the case, and index of the view.
        clips : dict
            Arrays by image size, group and name; sizes that are missing are not a number.
        """
        store = KeptStore(self.draft)
        for size, found in clips.items():
            for kind in schema.TRACKED:
                group = f"{kind}/{size}/{self.tracker}"
                store.write(group, {array.name: found[kind][array.name] for array in schema.named(group)}, *place)

    def publish(self, clips: dict[str, str], settings: dict[str, Any]) -> None:
        """Give the store its name; an earlier one of this name is replaced.

        Parameters
        ----------
        clips : dict
            Digest of every clip, by "CASE/VIEW".
        settings : dict
            Settings of the tracker.
        """
        store, path = KeptStore(self.draft), store_path(self.folder, self.tracker)
        about = {"tracker": self.tracker, "settings": settings, "clips": clips}
        store.describe(about | grid_and_sizes(self.config))
        earlier = _set_aside(path)
        self.draft.rename(path)
        rmtree(earlier, ignore_errors=True)

    def discard(self) -> None:
        """Delete what was written so far."""
        rmtree(self.draft, ignore_errors=True)


def remove(folder: Path, tracker: str) -> None:
    """Remove what was kept of a tracker: it was evaluated anew, and the scores are not those of what was kept."""
    rmtree(_set_aside(store_path(folder, tracker)), ignore_errors=True)


def _set_aside(path: Path) -> Path:
    """Hide a store, if there is one, under a name that is to be deleted; at once, as deleting it takes long."""
    hidden = path.with_name(f".{path.name}.earlier")
    rmtree(hidden, ignore_errors=True)
    if path.exists():
        path.rename(hidden)
    return hidden
