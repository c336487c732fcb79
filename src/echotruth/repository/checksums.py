"""Checksums of the files of a repository: of a group by the job that wrote it, of all by the rule repository.

A job knows the bytes that it writes, and stores their SHA-256 in the attribute `checksums` of its group, a line for
each file as `sha256sum` prints it; that of `zarr.json` itself is of its content without this line. Whoever reads the
files later finds what became of them since.
"""

import json
import os
from collections.abc import Iterator
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any

CHECKSUMS = "SHA256SUMS"
"""File with the checksums of the store and of the files beside it that describe it, as `sha256sum -c` reads it."""

METADATA = "zarr.json"
"""File of a group, which is written last: without it there is no group."""

ATTRIBUTE = "checksums"
"""Attribute of a group with the checksums of its files."""


def checksum(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def lines_of(hashes: dict[str, str]) -> str:
    """Lines as `sha256sum -c` reads them, given the hashes by the names of the files."""
    return "".join(f"{hash}  {name}\n" for name, hash in sorted(hashes.items()))


def read_lines(text: str) -> dict[str, str]:
    """Hashes by the names of the files, given such lines."""
    pairs = (line.partition("  ") for line in text.splitlines())
    return {name: hash for hash, _, name in pairs if name}


def files_of(folder: Path) -> Iterator[Path]:
    """All that is no folder in a folder and in those below it."""
    for at, _, names in os.walk(folder):
        yield from (Path(at) / name for name in names)


def seal(folder: Path) -> None:
    """Store the checksums of the files of a group in its attributes, which are written last."""
    metadata = folder / METADATA
    document = json.loads(metadata.read_bytes())
    below = {path.relative_to(folder).as_posix(): checksum(path) for path in files_of(folder) if path != metadata}
    document["attributes"][ATTRIBUTE] = lines_of(below | {METADATA: _own(document, below)})
    metadata.write_text(json.dumps(document))


def sealed(document: dict[str, Any]) -> dict[str, str]:
    """Checksums of the files of a group as its job stored them, by their paths below it; none if it did not.

    Parameters
    ----------
    document : dict
        Content of the `zarr.json` of the group.

    Raises
    ------
    ValueError
        If the content is not what the job wrote.
    """
    found = read_lines(str(document["attributes"].get(ATTRIBUTE, "")))
    if found and found.pop(METADATA, "") != _own(document, found):
        raise ValueError("its metadata are not what was written")
    return found


def read_sealed(folder: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """Content of the `zarr.json` of a group, and the checksums of its files as :func:`sealed` returns them.

    Raises
    ------
    FileNotFoundError
        If there is no group.
    ValueError
        If the content is not what the job wrote, or cannot be read.
    """
    try:
        document = json.loads((folder / METADATA).read_bytes())
        return document, sealed(document)
    except FileNotFoundError:
        raise
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise ValueError("its metadata are not what was written") from None


def _own(document: dict[str, Any], below: dict[str, str]) -> str:
    """Hash of the content of a `zarr.json` whose checksums are those of the other files."""
    attributes = document["attributes"] | {ATTRIBUTE: lines_of(below)}
    return sha256(json.dumps(document | {"attributes": attributes}, sort_keys=True).encode()).hexdigest()
