"""Parts in which a repository is given away: archives of whole hearts, so that a few can be had without the others.

A part is a .zip whose files are not compressed again. The first holds what belongs to no heart: the structure of the
hierarchy, the configuration, the tables, the report. Every heart is in one part, unless it is larger than one may be;
then the files of a job stay together. All parts are unpacked into the same folder. Times are left out, so that the same
repository gives the same bytes.
"""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import file_digest, sha256
from io import StringIO
from itertools import groupby
from pathlib import Path
from zipfile import ZIP_STORED, ZipFile, ZipInfo

from echotruth.release.clips import clips_of
from echotruth.repository import ledger
from echotruth.repository.inventory import Inventory
from echotruth.repository.reader import Repository

STRUCTURE, HEARTS, CLIPS = "structure", "hearts", "clips"
"""What a part holds; clips are NumPy archives for whoever reads no Zarr."""

EPOCH = (1980, 1, 1, 0, 0, 0)
"""Earliest time that a .zip can have."""


@dataclass
class Part:
    """One archive.

    Attributes
    ----------
    path : Path
    holds : str
        One of `STRUCTURE`, `HEARTS` and `CLIPS`.
    cases : list of str
        Hearts of which it holds files.
    size : int
        Of the files in it, bytes.
    """

    path: Path
    holds: str
    cases: list[str] = field(default_factory=list)
    size: int = 0

    def add(self, case: str, files: dict[str, bytes | Path]) -> None:
        """Append files, given their names in the archive."""
        with ZipFile(self.path, "a", ZIP_STORED) as archive:
            for name, content in files.items():
                about = ZipInfo(name, EPOCH)
                about.external_attr = 0o644 << 16
                about.create_system = 3  # the same on every system
                archive.writestr(about, content if isinstance(content, bytes) else content.read_bytes())
        self.size += size_of(files)
        if case and case not in self.cases:
            self.cases.append(case)

    @property
    def bytes(self) -> int:
        """Size of the archive."""
        return self.path.stat().st_size

    @cached_property
    def sha256(self) -> str:
        """Checksum of the archive, to be asked for once it is full."""
        with self.path.open("rb") as file:
            return file_digest(file, "sha256").hexdigest()


Files = dict[str, bytes | Path]
"""Name in an archive -> content, or the file that has it."""


def size_of(files: Files) -> int:
    """Size of files, bytes."""
    return sum(len(one) if isinstance(one, bytes) else one.stat().st_size for one in files.values())


def write_parts(repository: Repository, folder: Path, limit: int) -> list[Part]:
    """Write all parts of a finished repository.

    Parameters
    ----------
    repository : Repository
    folder : Path
        An empty folder.
    limit : int
        Largest size of a part, bytes, unless the files of a single job are larger.
    """
    inventory, name = Inventory(repository.folder), repository.config.name
    structure = Part(folder / f"{name}-{STRUCTURE}.zip", STRUCTURE)
    structure.add("", structure_files(inventory))
    hearts = filled(folder / f"{name}-{HEARTS}", HEARTS, heart_files(inventory), limit)
    clips = filled(folder / f"{name}-{CLIPS}", CLIPS, clip_files(repository), limit)
    return [structure, *hearts, *clips]


def structure_files(inventory: Inventory) -> Files:
    """Files that belong to no heart."""
    records = [inventory.structure_record, inventory.publication_record, *inventory.records_beside]
    records = [path for path in records if path.is_file()]
    beside = [name for path in inventory.records_beside if path.is_file() for name in ledger.read(path)["files"]]
    store = [f"{inventory.store.name}/{path}" for path in ledger.read(inventory.structure_record)["sha256"]]
    paths = [*map(inventory.name, records), *beside, *store, "registry.txt", "views.txt"]
    return _named(inventory, sorted(set(paths)))


def heart_files(inventory: Inventory) -> Iterator[tuple[str, list[Files]]]:
    """Each heart, in the order of their rows, with the files of each of its jobs."""
    records = sorted(inventory.records(), key=lambda record: (inventory.rows[record.case], record.path))
    for case, jobs in groupby(records, key=lambda record: record.case):
        files = []
        for job in jobs:
            shards = [f"{inventory.store.name}/{path}" for path in ledger.read(job.path).get("sha256", {})]
            files.append(_named(inventory, [*sorted(shards), inventory.name(job.path)]))
        yield case, files


def clip_files(repository: Repository) -> Iterator[tuple[str, list[Files]]]:
    """Each heart that was tracked, with the archives of its clips, view by view."""
    for case, views in repository.finished(None, None, "mechanics", "truth", "bmode", "tracking"):
        if views:
            yield case.id, [{f"clips/{k}": v for k, v in clips_of(repository, case.id, view).items()} for view in views]


def filled(stem: Path, holds: str, hearts: Iterable[tuple[str, list[Files]]], limit: int) -> list[Part]:
    """Fill parts with hearts one after the other; a part that is begun takes a heart only if it fits as a whole.

    Parameters
    ----------
    stem : Path
        Beginning of the paths of the parts.
    holds : str
    hearts : iterable
        Each with the files of its jobs, which stay together.
    limit : int
        Largest size of a part, bytes.
    """
    parts: list[Part] = []
    for case, jobs in hearts:
        whole = sum(map(size_of, jobs))
        for number, files in enumerate(jobs):
            needed = whole if number == 0 else size_of(files)
            if not parts or (parts[-1].size and parts[-1].size + needed > limit):
                parts.append(Part(stem.with_name(f"{stem.name}-{len(parts) + 1:04d}.zip"), holds))
            parts[-1].add(case, files)
    return parts


def table(found: list[Part]) -> bytes:
    """Table of the parts, with a row for every heart of which they hold files."""
    text = StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["part", "holds", "case"])
    rows.writerows([part.path.name, part.holds, case] for part in found for case in part.cases or [""])
    return text.getvalue().encode()


def registry(found: list[Part], texts: dict[str, bytes]) -> bytes:
    """Checksums of all files, as pooch reads them."""
    known = {part.path.name: part.sha256 for part in found}
    known |= {name: sha256(content).hexdigest() for name, content in texts.items()}
    return "".join(f"{name} sha256:{checksum}\n" for name, checksum in known.items()).encode()


def _named(inventory: Inventory, paths: list[str]) -> Files:
    return {f"{inventory.config.name}/{path}": inventory.folder / path for path in paths}
