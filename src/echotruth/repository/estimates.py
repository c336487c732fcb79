"""What trackers found, and what is true at the same points: arrays of the groups `tracking`.

No other reader knows where these arrays lie. Those of trackers from outside, which `echotruth evaluate --keep` stores,
are in `external/NAME.zarr` in the folder of the repository, a store with the same groups and this one tracker.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from echotruth.repository import group, metadata, schema
from echotruth.repository.choice import require_known
from echotruth.repository.places import place

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository

Arrays = dict[str, NDArray[Any]]


class NotEvaluated(ValueError):
    """Raised if a tracker from outside was not evaluated on a clip, or on an older version of it."""


def external_store(folder: Path, tracker: str) -> Path:
    """Store of what a tracker from outside found.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    tracker : str
    """
    return folder / "external" / f"{tracker}.zarr"


def trackers(repository: Repository) -> list[str]:
    """Names of the trackers of which displacement and curves are stored: those of a repository, then those kept."""
    own = list(repository.config.tracking.trackers)
    if repository.is_remote:
        return own
    kept = sorted(path.stem for path in (repository.folder / "external").glob("[A-Za-z]*.zarr"))
    return [*own, *(name for name in kept if name not in own)]


def settings(repository: Repository, tracker: str) -> dict[str, Any]:
    """Settings with which a tracker was run; none if it is not of the repository and nothing is kept of it."""
    own = repository.config.tracking.trackers
    if tracker in own:
        return own[tracker].model_dump(mode="json")
    return dict(metadata.attributes(external_store(repository.folder, tracker)).get("settings", {}))


def true(repository: Repository, case: str, view: str, *names: str) -> Arrays:
    """Arrays that do not depend on the tracker, for one view of a case.

    Parameters
    ----------
    repository : Repository
    case, view : str
    *names : str
        As `true_displacement`.
    """
    return repository.arrays(f"tracking/{repository.sizes[0]}", case, view, *names)


def tracked(repository: Repository, case: str, view: str, tracker: str, size: int, *names: str) -> Arrays:
    """Arrays of one clip as one tracker left them.

    Parameters
    ----------
    repository : Repository
    case, view : str
    tracker : str
        One of :func:`trackers`.
    size : int
        Pixels along a side.
    *names : str
        As `displacement` and `nrmse`: those that depend on the tracker.

    Returns
    -------
    dict of ndarray
        By name, without the dimension tracker.

    Raises
    ------
    ValueError
        If there is no such tracker.
    NotEvaluated
        If one from outside was not evaluated on this clip as it is now.
    """
    require_known("tracker", tracker, trackers(repository))
    require_known("size", size, repository.sizes)
    own, path = list(repository.config.tracking.trackers), f"tracking/{size}"
    if tracker in own:
        at = own.index(tracker)
        return {name: repository.read(f"{path}/{name}", case, view, at) for name in names}
    store, where = external_store(repository.folder, tracker), place(path, "", case, view)
    _require_current(repository, store / where, tracker, (case, view))
    return {name: values[0] for name, values in group.read(store, where, *names).items()}


def _require_current(repository: Repository, folder: Path, tracker: str, clip: tuple[str, str]) -> None:
    """Raise NotEvaluated unless a tracker from outside was evaluated on a clip as it is."""
    made_of, again = metadata.attributes(folder).get("clip"), "run echotruth evaluate --keep again."
    if made_of is None:
        raise NotEvaluated(f"tracker = {tracker!r}: it was not evaluated on {' '.join(clip)}.")
    if made_of != repository.version(*clip):
        older = f"it was evaluated on older images, or other points, of {' '.join(clip)}"
        raise NotEvaluated(f"tracker = {tracker!r}: {older}: {again}")


def each(
    repository: Repository, case: str, view: str, sizes: Sequence[int], trackers: Sequence[str], *names: str
) -> Iterator[tuple[int, str, Arrays]]:
    """Size, tracker and arrays of the clips of a view; without those that a tracker from outside did not keep.

    The parameters are those of :func:`tracked`, sizes and trackers several.
    """
    for size in sizes:
        for tracker in trackers:
            with suppress(NotEvaluated):
                yield size, tracker, tracked(repository, case, view, tracker, size, *names)


def names_of_trackers() -> list[str]:
    """Names of the arrays that depend on the tracker."""
    return [name for name, array in schema.arrays_of("tracking/SIZE").items() if "tracker" in array.dims]
