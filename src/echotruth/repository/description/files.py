"""Files of a repository with their sizes and checksums."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from echotruth.repository.checksums import checksums
from echotruth.repository.description.attribution import DescriptionError
from echotruth.repository.inventory import Inventory, files_below


@dataclass(frozen=True, slots=True)  # there may be a million
class StoredFile:
    """A file of the store or beside it."""

    path: str
    """Below the folder of the repository."""
    size: int
    """Bytes."""
    sha256: str


def stored(path: str, content: bytes) -> StoredFile:
    """A file, given its content."""
    return StoredFile(path, len(content), sha256(content).hexdigest())


def damaged(folder: Path, path: Path) -> DescriptionError:
    """Error of a file of a repository that cannot be read."""
    remedy = f"echotruth check {folder} --heal drops what is damaged, and the next run makes it again"
    return DescriptionError(f"{path}: is missing or damaged: {remedy}")


def store_files(repository: Inventory, known: dict[str, str]) -> tuple[StoredFile, ...]:
    """All files of the store.

    Parameters
    ----------
    repository : Inventory
    known : dict
        Path below the store -> SHA-256 in the ledger; what the ledger of an older repository lacks is taken here.

    Raises
    ------
    DescriptionError
        If a file of the ledger is missing.
    """
    if repository.is_older:
        others = (path for path in files_below(repository.store) if path not in known)
        known = known | checksums([repository.store / path for path in others], repository.store)
    return tuple(_listed(repository, path, checksum) for path, checksum in sorted(known.items()))


def _listed(repository: Inventory, path: str, checksum: str) -> StoredFile:
    file = repository.store / path
    if not file.is_file():
        raise damaged(repository.folder, file)
    return StoredFile(f"{repository.store.name}/{path}", file.stat().st_size, checksum)


def files_beside(folder: Path) -> tuple[StoredFile, ...]:
    """Files for readers beside the store: tables, figures, the report."""
    names = ("cases.csv", "config.yaml", "registry.txt", "views.txt", "report.html")
    figures = sorted(path for path in folder.glob("figures/*") if path.is_file() and not path.name.startswith("."))
    paths = [name for name in names if (folder / name).is_file()] + [f"figures/{path.name}" for path in figures]
    return tuple(stored(path, (folder / path).read_bytes()) for path in paths)
