"""What trackers from outside found and `echotruth evaluate --keep` stored: `external/NAME.zarr`.

It has the groups tracking and evaluation of a repository (docs/schema.md), with the same rows of cases and views and
this one tracker, and without what does not depend on a tracker.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import numpy as np
import zarr
from numpy.typing import ArrayLike, NDArray

from echotruth.config import Config
from echotruth.evaluation.choice import require_known
from echotruth.evaluation.digest import digest
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.imaging.bmode import pixel_centres
from echotruth.repository import layout, ledger, schema
from echotruth.repository.store import Store
from echotruth.tracking.windows import grid

if TYPE_CHECKING:
    from echotruth.workflow.job import Job

GROUPS = ("tracking", "evaluation")

Found = Mapping[str, Mapping[str, ArrayLike]]
"""Arrays that a tracker left of one clip by group and name, without the dimensions case, view, size and tracker."""


class NotEvaluated(ValueError):
    """Raised if a tracker from outside was not evaluated on a clip, or on older images of it."""


class KeptStore(Store):
    """A store of one tracker, whose record of its structure lies in its own folder."""

    @property
    def record(self) -> Path:
        """Path of the record of the structure."""
        return self.path / "structure.json"

    @property
    def attributes(self) -> dict[str, Any]:
        """What it is: tracker, its settings, digest of every clip by "CASE/VIEW", and the grid and image sizes."""
        return dict(zarr.open_group(self.path, mode="r").attrs)


def store_path(folder: Path, tracker: str) -> Path:
    """Folder of what a tracker from outside found.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    tracker : str
    """
    return folder / "external" / f"{tracker}.zarr"


def about(folder: Path, tracker: str) -> dict[str, Any]:
    """What is kept of a tracker from outside, as :attr:`KeptStore.attributes`.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    tracker : str

    Raises
    ------
    EvaluationError
        If it is damaged.
    """
    path = store_path(folder, tracker)
    try:
        found = KeptStore(path).attributes
    except (ValueError, KeyError, TypeError, OSError):  # what it is said to be by zarr is no help
        found = {}
    if not {"settings", "clips"} <= set(found):
        remedy = f"evaluate {tracker} again with --keep"
        raise EvaluationError(f"{path}: is not what echotruth evaluate --keep wrote: {remedy}")
    return found


def trackers(folder: Path, config: Config) -> list[str]:
    """Names of the trackers of which displacement and curves are stored: those of a repository, then those kept.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    config : Config
        Its configuration.
    """
    own = list(config.tracking.trackers)
    kept = sorted(path.stem for path in (folder / "external").glob("[A-Za-z]*.zarr"))
    return [*own, *(name for name in kept if name not in own)]


def read(job: Job, group: str, *names: str, tracker: str, size: int) -> dict[str, NDArray[Any]]:
    """Arrays of one clip as one tracker left them.

    Parameters
    ----------
    job : Job
        Job of the view.
    group : {"tracking", "evaluation"}
    *names : str
        Arrays of the group; of `evaluation` those that depend on the tracker, and others.
    tracker : str
        One of :func:`trackers`.
    size : int
        Pixels along a side.

    Returns
    -------
    dict of ndarray
        By name, without the dimensions case, view, size and tracker.

    Raises
    ------
    ValueError
        If there is no such tracker.
    NotEvaluated
        If it was not evaluated on this clip as it is now.
    """
    config = job.case.config
    require_known("tracker", tracker, trackers(job.folder, config))
    own = list(config.tracking.trackers)
    of_tracker = [array.name for array in schema.named(group) if "tracker" in array.dims and array.name in names]
    others = [name for name in names if name not in of_tracker]
    index = (config.bmode.sizes.index(size), own.index(tracker) if tracker in own else 0)
    store = job.store if tracker in own else _checked(job, tracker)
    found = store.read(group, *job.index, names=tuple(of_tracker)) if of_tracker else {}
    values = {name: array[index] for name, array in found.items()}
    return values | (job.read(group, *others) if others else {})


def read_each(
    job: Job, sizes: Sequence[int], trackers: Sequence[str], names: Mapping[str, Sequence[str]]
) -> Iterator[tuple[int, str, dict[str, NDArray[Any]]]]:
    """Size, tracker and arrays of the clips of a view; without those that a tracker from outside did not keep.

    Names are those of arrays that depend on the tracker, by group; sizes and trackers are as :func:`read` takes one of
    each.
    """
    config, own = job.case.config, list(job.case.config.tracking.trackers)
    stored: dict[str, NDArray[Any]] = {}
    for group, members in names.items() if set(own) & set(trackers) else ():
        stored |= job.read(group, *members)
    for size in sizes:
        for tracker in trackers:
            if tracker in own:
                index = config.bmode.sizes.index(size), own.index(tracker)
                yield size, tracker, {name: values[index] for name, values in stored.items()}
                continue
            try:
                found = [read(job, group, *members, tracker=tracker, size=size) for group, members in names.items()]
            except NotEvaluated:
                continue
            yield size, tracker, dict(ChainMap(*found))


def _checked(job: Job, tracker: str) -> KeptStore:
    """The store of a tracker from outside, if it holds this clip as it is now."""
    store, clip = KeptStore(store_path(job.folder, tracker)), f"{job.case.id}/{job.view_name}"
    known, grid_and_sizes = about(job.folder, tracker), _grid_and_sizes(job.case.config)
    made_of = known["clips"].get(clip)
    if {name: known.get(name) for name in grid_and_sizes} != grid_and_sizes:
        raise NotEvaluated(
            f"tracker = {tracker!r}: it was evaluated with another tracking.grid_px or other image sizes: "
            "run echotruth evaluate --keep again."
        )
    if made_of is None:
        raise NotEvaluated(f"tracker = {tracker!r}: it was not evaluated on {job.case.id} {job.view_name}.")
    if made_of != digest(job.folder, job.case.id, str(job.view_name)):
        raise NotEvaluated(
            f"tracker = {tracker!r}: it was evaluated on older images of {job.case.id} {job.view_name}: "
            "run echotruth evaluate --keep again."
        )
    return store


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
        time = np.asarray(zarr.open_array(repository, path="mechanics/time", mode="r")[...])
        labels = layout.labels(self.config, rows, time, views) | {"tracker": [self.tracker]}
        labels |= layout.positions(self.config, pixel_centres, grid)
        arrays = {
            group: tuple(array for array in schema.groups(self.config)[group] if "tracker" in array.dims)
            for group in GROUPS
        }
        KeptStore(self.draft).lay_out(arrays, {}, labels)

    def write(self, job: Job, clips: Mapping[int, Found]) -> None:
        """Write what was found in the clips of one view.

        Parameters
        ----------
        job : Job
            Job of the view.
        clips : dict
            Arrays by image size, group and name, without size and tracker; sizes that are missing are not a number.
        """
        store, (some, *_) = KeptStore(self.draft), clips.values()
        for group in GROUPS:
            members = [array.name for array in schema.named(group) if "tracker" in array.dims]
            unknown = {name: np.full(np.shape(some[group][name]), np.nan) for name in members}
            by_size = [clips[size][group] if size in clips else unknown for size in self.config.bmode.sizes]
            store.write(group, {name: np.stack([[of[name]] for of in by_size]) for name in members}, *job.index)

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
        store.describe(about | _grid_and_sizes(self.config))
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


def _grid_and_sizes(config: Config) -> dict[str, Any]:
    """What the points and the clips of a tracker depend on, besides the images."""
    return {"grid_px": config.tracking.grid_px, "sizes": list(config.bmode.sizes)}
