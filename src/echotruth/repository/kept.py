"""What trackers from outside found and `echotruth evaluate --keep` stored: `external/NAME.zarr`.

It has the groups tracking and evaluation of a repository (docs/schema.md), with the same rows of cases and views and
this one tracker, and without what does not depend on a tracker.
"""

from pathlib import Path
from typing import Any

import zarr

from echotruth.config import Config
from echotruth.repository.digest import digest


class KeptError(ValueError):
    """Raised if what was kept of a tracker is damaged."""


class NotEvaluated(ValueError):
    """Raised if a tracker from outside was not evaluated on a clip, or on older images of it."""


def store_path(folder: Path, tracker: str) -> Path:
    """Folder of what a tracker from outside found.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    tracker : str
    """
    return folder / "external" / f"{tracker}.zarr"


def names(folder: Path) -> list[str]:
    """Names of the trackers from outside that were kept.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    """
    return sorted(path.stem for path in (folder / "external").glob("[A-Za-z]*.zarr"))


def about(folder: Path, tracker: str) -> dict[str, Any]:
    """What is kept of a tracker: its settings, the digest of every clip by "CASE/VIEW", and the grid and image sizes.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    tracker : str

    Raises
    ------
    KeptError
        If it is damaged.
    """
    path = store_path(folder, tracker)
    try:
        found = dict(zarr.open_group(path, mode="r", zarr_format=3).attrs)
    except (ValueError, KeyError, TypeError, OSError):  # what it is said to be by zarr is no help
        found = {}
    if not {"settings", "clips"} <= set(found):
        raise KeptError(f"{path}: is not what echotruth evaluate --keep wrote: evaluate {tracker} again with --keep")
    return found


def store_of(folder: Path, config: Config, tracker: str, case: str, view: str) -> Path:
    """The store of a tracker, if it holds a clip as it is now; else NotEvaluated or KeptError."""
    known, wanted = about(folder, tracker), grid_and_sizes(config)
    made_of, again = known["clips"].get(f"{case}/{view}"), "run echotruth evaluate --keep again."
    if {name: known.get(name) for name in wanted} != wanted:
        said = "it was evaluated with another tracking.grid_px or other image sizes"
        raise NotEvaluated(f"tracker = {tracker!r}: {said}: {again}")
    if made_of is None:
        raise NotEvaluated(f"tracker = {tracker!r}: it was not evaluated on {case} {view}.")
    if made_of != digest(folder, case, view):
        raise NotEvaluated(f"tracker = {tracker!r}: it was evaluated on older images of {case} {view}: {again}")
    return store_path(folder, tracker)


def grid_and_sizes(config: Config) -> dict[str, Any]:
    """Settings on which the shape of what was kept depends."""
    return {"grid_px": config.tracking.grid_px, "sizes": list(config.bmode.sizes)}
