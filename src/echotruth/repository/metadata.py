"""Metadata of groups: what a group says of itself, and for readers that list, the metadata of all below it."""

import json
from pathlib import Path
from typing import Any

from echotruth import files
from echotruth.repository.checksums import METADATA, files_of, read_sealed


def attributes(folder: Path) -> dict[str, Any]:
    """Attributes of a group on disk; none if there is no group, or its metadata are not what was written."""
    try:
        document, _ = read_sealed(folder)
    except (FileNotFoundError, ValueError):
        return {}
    return dict(document["attributes"])


def content(attributes: dict[str, Any], below: dict[str, dict[str, Any]] | None = None) -> bytes:
    """Content of the metadata of a group that holds groups.

    Parameters
    ----------
    attributes : dict
    below : dict, optional
        Metadata of all groups and arrays below it by their paths, as Zarr and xarray read them at once.
    """
    document: dict[str, Any] = {"attributes": attributes, "zarr_format": 3, "node_type": "group"}
    if below is not None:
        inline = {"kind": "inline", "must_understand": False, "metadata": dict(sorted(below.items()))}
        document["consolidated_metadata"] = inline
    return json.dumps(document).encode()


def below(folder: Path, group: str = "") -> dict[str, dict[str, Any]]:
    """Metadata of a group and of all that is in it, by their paths below a folder, each without those below it."""
    found = {}
    for path in files_of(folder / group):
        if path.name == METADATA:
            document = json.loads(path.read_bytes())
            document.pop("consolidated_metadata", None)
            found[path.parent.relative_to(folder).as_posix()] = document
    return found


def write(folder: Path, attributes: dict[str, Any]) -> None:
    """Write the metadata of a group that holds groups, with those of all below it."""
    found = below(folder)
    found.pop(".", None)
    files.update(folder / METADATA, content(attributes, found))
