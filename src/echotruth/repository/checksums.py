"""Checksums of files: taken when they are written, kept in a record, and verified before publication.

The record of a job holds those of its shards, and `ledger/structure.json` those of all other files of the store. Those
of the files beside it are in `ledger/configuration.json` and `ledger/report.json`.

Beside these, every chunk in a shard carries a crc32c (see :mod:`.hierarchy`), which raises when damaged data are read.
"""

import os
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any

from echotruth.repository import ledger


class ChecksumError(ValueError):
    """Raised if a file is missing or differs from what was written."""


def checksums(files: list[Path], root: Path) -> dict[str, str]:
    """SHA-256 of each file by its path below `root`."""
    return {file.relative_to(root).as_posix(): sha256(file.read_bytes()).hexdigest() for file in files}


def commit_beside(folder: Path, record: Path, files: list[Path]) -> None:
    """Record the checksums of files that stand beside the store; a record that is as it should be is left untouched.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    record : Path
        Path of the record in its ledger.
    files : list of Path
    """
    found = {"files": checksums(files, folder)}
    try:
        unchanged = ledger.read(record) == found
    except (OSError, ValueError):
        unchanged = False
    if not unchanged:
        ledger.commit(record, found)


def damage(file: Path, expected: str) -> str:
    """What is wrong with a file that must have a SHA-256; empty if nothing is."""
    try:
        # A pipe or a device could be read for ever.
        if file.exists() and not file.is_file():
            return "is not a file"
        with file.open("rb") as opened:
            if file_digest(opened, sha256).hexdigest() == expected:
                return ""
            return "differs from what was written" if os.fstat(opened.fileno()).st_size else "is empty"
    except FileNotFoundError:
        return "is missing"
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def is_whole(file: Path, expected: str) -> bool:
    """Whether a file is there and has a SHA-256."""
    return not damage(file, expected)


def verify(root: Path, path: Path, record: dict[str, Any]) -> int:
    """Compare the files of a record with their checksums; return their number.

    Parameters
    ----------
    root : Path
        Folder of the store.
    path : Path
        Path of the record.
    record : dict
        As :func:`echotruth.repository.ledger.read` returns it.

    Raises
    ------
    ChecksumError
        If a file is missing or differs.
    """
    return _compare(root, record.get("sha256", {}), f"written: delete {path} and run again")


def verify_structure(root: Path, path: Path) -> int:
    """Compare all files that no job wrote with their checksums in the record of the structure; return their number."""
    remedy = "run again, which lays the repository out anew"
    try:
        expected = dict(ledger.read(path)["sha256"])
    except (OSError, ValueError, KeyError, TypeError):
        raise ChecksumError(f"{path}: is missing or damaged: {remedy}") from None
    return _compare(root, expected, f"laid out: {remedy}")


def _compare(root: Path, expected: dict[str, str], origin: str) -> int:
    """Number of files that have their checksum, as all must; `origin` ends the error of one that has not."""
    for name, checksum in expected.items():
        if not is_whole(root / name, checksum):
            raise ChecksumError(f"{root / name}: is missing or differs from what was {origin}")
    return len(expected)
