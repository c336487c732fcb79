"""What trackers found, and what is true at the same points: arrays of the groups `tracking` and `evaluation`.

No other reader knows where these arrays lie.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from echotruth.repository import kept, schema
from echotruth.repository.choice import require_known
from echotruth.repository.store import packs_of

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository

Arrays = dict[str, NDArray[Any]]

GROUPS = ("tracking", "evaluation")


def trackers(repository: Repository) -> list[str]:
    """Names of the trackers of which displacement and curves are stored: those of a repository, then those kept."""
    own = list(repository.config.tracking.trackers)
    others = [] if repository.is_remote else kept.names(repository.folder)
    return [*own, *(name for name in others if name not in own)]


def true(repository: Repository, case: str, view: str, *names: str) -> Arrays:
    """Arrays that do not depend on the tracker, for one view of a case.

    Parameters
    ----------
    repository : Repository
    case, view : str
    *names : str
        As `true_displacement`, of the group `evaluation`.
    """
    return repository.arrays("evaluation", case, view, *names)


def is_written(repository: Repository, case: str, view: str, name: str) -> bool:
    """Whether an array of one view was written, as `displacement` or `true_line_strain`."""
    group = next(group for group in GROUPS if name in [array.name for array in schema.named(group)])
    holder = {member: pack.array.name for pack in packs_of(group) for member in pack.names}
    return repository.is_written(f"{group}/{holder.get(name, name)}", case, view)


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
        By name, without the dimensions case, view, size and tracker.

    Raises
    ------
    ValueError
        If there is no such tracker.
    NotEvaluated, KeptError
        If one from outside was not evaluated on this clip as it is now, or what was kept of it is damaged.
    """
    require_known("tracker", tracker, trackers(repository))
    own, sizes = list(repository.config.tracking.trackers), repository.config.bmode.sizes
    if tracker in own:
        store, number = None, own.index(tracker)
    else:
        store, number = kept.store_of(repository.folder, repository.case(case).config, tracker, case, view), 0
    place = sizes.index(require_known("size", size, sizes))
    index = slice(place, place + 1), slice(number, number + 1)
    found = _read(repository, case, view, names, index, store)
    return {name: values[0, 0] for name, values in found.items()}


def each(
    repository: Repository, case: str, view: str, sizes: Sequence[int], trackers: Sequence[str], *names: str
) -> Iterator[tuple[int, str, Arrays]]:
    """Size, tracker and arrays of the clips of a view; without those that a tracker from outside did not keep.

    The parameters are those of :func:`tracked`, sizes and trackers several.
    """
    own, every = list(repository.config.tracking.trackers), repository.sizes
    stacked = _read(repository, case, view, names) if set(own) & set(trackers) else {}
    for size in sizes:
        for tracker in trackers:
            if tracker in own:
                place = every.index(size), own.index(tracker)
                yield size, tracker, {name: values[place] for name, values in stacked.items()}
                continue
            with suppress(kept.NotEvaluated):
                yield size, tracker, tracked(repository, case, view, tracker, size, *names)


def _read(
    repository: Repository,
    case: str,
    view: str,
    names: Sequence[str],
    index: tuple[slice, ...] = (),
    store: Path | None = None,
) -> Arrays:
    """Arrays (size, tracker, ...) of the repository, or of the store of a tracker from outside."""
    found: Arrays = {}
    for group in GROUPS:
        members = [array.name for array in schema.named(group) if "tracker" in array.dims and array.name in names]
        if members:
            found |= repository.arrays(group, case, view, *members, index=index, store=store)
    return {name: np.asarray(found[name]) for name in names}
