"""Files of a repository with their sizes and checksums."""

from dataclasses import dataclass
from hashlib import sha256
from mimetypes import guess_type
from pathlib import Path

from echotruth.repository.description.attribution import DescriptionError
from echotruth.repository.inventory import Inventory

MEDIA_TYPES = {"yaml": "application/yaml", "cff": "application/yaml", "md": "text/markdown"}
"""Ending of a name -> media type, of those that Python does not know everywhere."""


@dataclass(frozen=True, slots=True)  # there may be a million
class StoredFile:
    """A file of the store or beside it."""

    path: str
    """Below the folder of the repository."""
    size: int
    """Bytes."""
    sha256: str

    @property
    def name(self) -> str:
        """Name without the folder."""
        return self.path.rpartition("/")[2]

    @property
    def media_type(self) -> str:
        """Media type of a file beside the store."""
        return MEDIA_TYPES.get(self.path.rpartition(".")[2]) or guess_type(self.path)[0] or "text/plain"


def stored(path: str, content: bytes) -> StoredFile:
    """A file, given its content."""
    return StoredFile(path, len(content), sha256(content).hexdigest())


def damaged(folder: Path, path: Path) -> DescriptionError:
    """Error of a file of a repository that cannot be read."""
    remedy = f"echotruth check {folder} --heal drops what is damaged, and the next run makes it again"
    return DescriptionError(f"{path}: is missing or damaged: {remedy}")


def store_files(repository: Inventory, known: dict[str, str]) -> list[StoredFile]:
    """All files of the store.

    Parameters
    ----------
    repository : Inventory
    known : dict
        Path below the store -> SHA-256 in the ledger.

    Raises
    ------
    DescriptionError
        If a file of the ledger is missing.
    """
    store = repository.store
    if lost := next((path for path in known if not (store / path).is_file()), None):
        raise damaged(repository.folder, store / lost)
    return [
        StoredFile(f"{store.name}/{path}", (store / path).stat().st_size, checksum)
        for path, checksum in sorted(known.items())
    ]


def files_beside(folder: Path) -> list[StoredFile]:
    """Files for readers beside the store: tables, figures, the report."""
    names = ("cases.csv", "config.yaml", "registry.txt", "views.txt", "report.html")
    figures = sorted(folder.glob("figures/[!.]*"))
    paths = [path for path in (*(folder / name for name in names), *figures) if path.is_file()]
    return [stored(path.relative_to(folder).as_posix(), path.read_bytes()) for path in paths]
