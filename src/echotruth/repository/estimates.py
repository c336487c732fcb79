"""What trackers found, and what is true at the same points: arrays of the groups `tracking/TRACKER` and `points`.

No other reader knows where these arrays lie.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from echotruth.repository import schema, scores
from echotruth.repository.choice import require_known

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository

Arrays = dict[str, NDArray[Any]]


class NotEvaluated(ValueError):
    """Raised if a tracker was not run on a clip."""


def true(repository: Repository, case: str, view: str, *names: str) -> Arrays:
    """Arrays that do not depend on the tracker, for one view of a case.

    Parameters
    ----------
    repository : Repository
    case, view : str
    *names : str
        As `true_displacement`.
    """
    return repository.arrays("points", case, view, *names)


def tracked(repository: Repository, case: str, view: str, tracker: str, size: int, *names: str) -> Arrays:
    """Arrays of one clip as one tracker left them.

    Parameters
    ----------
    repository : Repository
    case, view : str
    tracker : str
        One of the configuration.
    size : int
        Pixels along a side.
    *names : str
        As `displacement`, or scores as `nrmse`.

    Returns
    -------
    dict of ndarray
        By name, without the dimension size.

    Raises
    ------
    ValueError
        If there is no such tracker.
    NotEvaluated
        If it was not run on this clip.
    """
    require_known("tracker", tracker, repository.trackers)
    at, group = repository.sizes.index(require_known("size", size, repository.sizes)), f"tracking/{tracker}"
    if problem := repository.problem(case, view, group):
        raise NotEvaluated(f"tracker = {tracker!r}: {problem}.")
    if repository.config.has_volumes:
        return repository.arrays(group, case, view, *names)
    found = {name: repository.read(f"{group}/{name}", case, view, at) for name in names if name not in schema.SCORES}
    if len(found) < len(names):
        table = repository.read(f"{group}/scores", case, view, at)
        found |= scores.unpacked(table, repository.case(case).config)
    return {name: found[name] for name in names}


def each(
    repository: Repository, case: str, view: str, sizes: Sequence[int], trackers: Sequence[str], *names: str
) -> Iterator[tuple[int, str, Arrays]]:
    """Size, tracker and arrays of the clips of a view; without those of trackers that were not run on them.

    The parameters are those of :func:`tracked`, sizes and trackers several.
    """
    for size in sizes:
        for tracker in trackers:
            with suppress(NotEvaluated):
                yield size, tracker, tracked(repository, case, view, tracker, size, *names)


def failures(repository: Repository, case: str, view: str) -> dict[tuple[str, int], str]:
    """Why trackers failed on a view of a heart, by tracker and image size; others are not in it."""
    about = {name: repository.attributes(f"tracking/{name}", case, view) for name in repository.trackers}
    return {(name, int(size)): why for name, found in about.items() for size, why in found.get("failures", {}).items()}
