"""What trackers found, and what is true at the same points: arrays of the groups `tracking` and `evaluation`.

No other reader knows where these arrays lie.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from echotruth.repository import kept, schema
from echotruth.repository.choice import require_known

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository

Arrays = dict[str, NDArray[Any]]


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
    return repository.arrays(f"evaluation/{repository.sizes[0]}", case, view, *names)


def is_written(repository: Repository, case: str, view: str, name: str) -> bool:
    """Whether an array of one view was written, as `displacement` of a tracker, or `true_line_strain`."""
    size, tracker = repository.sizes[0], next(iter(repository.config.tracking.trackers))
    groups = (f"evaluation/{size}", *(f"{kind}/{size}/{tracker}" for kind in schema.TRACKED))
    group = next(group for group in groups if name in [array.name for array in schema.named(group)])
    return repository.is_written(f"{group}/{schema.holders(group).get(name, name)}", case, view)


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
    require_known("size", size, repository.sizes)
    is_own = tracker in repository.config.tracking.trackers
    config = repository.case(case).config
    store = None if is_own else kept.store_of(repository.folder, config, tracker, case, view)
    found: Arrays = {}
    for kind in schema.TRACKED:
        group = f"{kind}/{size}/{tracker}"
        members = [array.name for array in schema.named(group) if array.name in names]
        if members:
            found |= repository.arrays(group, case, view, *members, store=store)
    return {name: found[name] for name in names}


def each(
    repository: Repository, case: str, view: str, sizes: Sequence[int], trackers: Sequence[str], *names: str
) -> Iterator[tuple[int, str, Arrays]]:
    """Size, tracker and arrays of the clips of a view; without those that a tracker from outside did not keep.

    The parameters are those of :func:`tracked`, sizes and trackers several.
    """
    for size in sizes:
        for tracker in trackers:
            with suppress(kept.NotEvaluated):
                yield size, tracker, tracked(repository, case, view, tracker, size, *names)
