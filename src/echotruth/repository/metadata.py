"""Metadata of groups: what a group says of itself, and for readers that list, the metadata of all below it."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from echotruth import files
from echotruth.repository.places import METADATA

OUTDATED = "outdated.json"
"""Name of the metadata of a group that was made with other settings or by other code, or that the configuration has no
more: it is no group until it is made anew, or until the settings are again those that it was made with."""


def attributes(folder: Path) -> dict[str, Any]:
    """Attributes of a group on disk; none if there is no group, or its metadata are damaged."""
    return _attributes(folder / METADATA)


def write(folder: Path, attributes: dict[str, Any], consolidated: bool = True) -> None:
    """Write the metadata of a group that holds groups.

    Parameters
    ----------
    folder : Path
    attributes : dict
    consolidated : bool
        Whether it has the metadata of all groups and arrays below it, as Zarr and xarray read them.
    """
    document: dict[str, Any] = {"attributes": attributes, "zarr_format": 3, "node_type": "group"}
    if consolidated:
        below = sorted(path for path in files_of(folder) if path.name == METADATA and path.parent != folder)
        found = {path.parent.relative_to(folder).as_posix(): json.loads(path.read_bytes()) for path in below}
        inline = {"kind": "inline", "must_understand": False, "metadata": found}
        document["consolidated_metadata"] = inline
    files.update(folder / METADATA, json.dumps(document).encode())


def files_of(folder: Path) -> Iterator[Path]:
    """Files of a group and of all below it, without groups that were set aside."""
    for at, folders, names in os.walk(folder):
        if OUTDATED in names:
            folders.clear()
        else:
            yield from (Path(at) / name for name in names)


def settle(folder: Path, version: str) -> bool:
    """Set a group aside if it was made with other settings or by other code; take it back if it was not.

    Parameters
    ----------
    folder : Path
        Of the group.
    version : str
        What it is to be made with; empty if it is not to be there.

    Returns
    -------
    bool
        Whether the group is there and as it is to be.
    """
    current, outdated = folder / METADATA, folder / OUTDATED
    if current.is_file() and _attributes(current).get("version") != version:
        current.replace(outdated)
    if not current.is_file() and outdated.is_file() and _attributes(outdated).get("version") == version:
        outdated.replace(current)
    return current.is_file()


def _attributes(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_bytes())["attributes"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
