"""Checksums of shards: taken when a job writes them, kept in its record, and verified before publication.

Beside these, every chunk in a shard carries a crc32c (see :mod:`.store`), which raises when damaged data are read.
"""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Any


class ChecksumError(ValueError):
    """Raised if a file is missing or differs from what its job wrote."""


def checksums(files: list[Path], root: Path) -> dict[str, str]:
    """SHA-256 of each file by its path below `root`."""
    return {file.relative_to(root).as_posix(): sha256(file.read_bytes()).hexdigest() for file in files}


def verify(root: Path, path: Path, record: dict[str, Any]) -> int:
    """Compare the files of a record with their checksums.

    Parameters
    ----------
    root : Path
        Folder of the store.
    path : Path
        Path of the record.
    record : dict
        As :func:`echotruth.repository.ledger.read` returns it.

    Returns
    -------
    int
        Number of files.

    Raises
    ------
    ChecksumError
        If a file is missing or differs.
    """
    for name, expected in record.get("sha256", {}).items():
        file = root / name
        if not file.is_file() or sha256(file.read_bytes()).hexdigest() != expected:
            raise ChecksumError(f"{file}: is missing or differs from what its job wrote: delete {path} and run again")
    return len(record.get("sha256", {}))
