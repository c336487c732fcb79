"""Parts in which a repository is given away: archives of whole folders, so that a few hearts can be had without others.

A part is a .zip whose files are not compressed again. The first holds what belongs to no job: the configuration, the
table of cases, the checksums, the metadata of the folders. Others hold whole folders of hearts and clips, case by case.
All parts are unpacked into the same folder. Times are left out, so that the same repository gives the same bytes.
"""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from hashlib import sha256
from io import StringIO
from pathlib import Path, PurePosixPath
from zipfile import ZipFile

from echotruth.archive import append
from echotruth.repository.checksums import CHECKSUMS, checksum
from echotruth.repository.places import DEPTHS
from echotruth.repository.publication import published_checksums
from echotruth.repository.reader import Repository
from echotruth.sharing.fetching import HEARTS, STRUCTURE

Files = dict[str, Path]
"""Name in an archive -> the file."""


@dataclass
class Part:
    """One archive.

    Attributes
    ----------
    path : Path
    holds : str
        `STRUCTURE` or `HEARTS`.
    cases : list of str
        Cases of which it holds files.
    size : int
        Of the files in it, bytes.
    """

    path: Path
    holds: str
    cases: list[str] = field(default_factory=list)
    size: int = 0

    def add(self, cases: list[str], files: Files) -> None:
        """Append files of some cases, given their names in the archive."""
        with ZipFile(self.path, "a") as archive:
            for name, file in files.items():
                append(archive, name, file.read_bytes())
        self.size += size_of(files)
        self.cases += [case for case in cases if case not in self.cases]


def size_of(files: Files) -> int:
    """Size of files, bytes."""
    return sum(file.stat().st_size for file in files.values())


def write_parts(repository: Repository, folder: Path, limit: int) -> list[Part]:
    """Write all parts of a finished repository.

    Parameters
    ----------
    repository : Repository
    folder : Path
        An empty folder.
    limit : int
        Largest size of a part, bytes, unless a single folder of a heart or a clip is larger.
    """
    name, folders = repository.config.name, folders_of(repository)
    structure = Part(folder / f"{name}-{STRUCTURE}.zip", STRUCTURE)
    structure.add([], folders.pop(""))
    hearts = filled(folder / f"{name}-{HEARTS}", HEARTS, by_case(repository, folders), limit)
    return [structure, *hearts]


def folders_of(repository: Repository) -> dict[str, Files]:
    """Files that have a checksum by the folder below the store that a job made, "" for those that no job made."""
    home = repository.folder
    found: dict[str, Files] = {"": {}}
    for path in (home / name for name in [*published_checksums(home), CHECKSUMS]):
        names = PurePosixPath(path.relative_to(home)).parts[1:]
        depth = DEPTHS.get(names[0], 0) if names else 0
        place = "/".join(names[:depth]) if len(names) > depth else ""
        found.setdefault(place, {})[f"{repository.config.name}/{path.relative_to(home).as_posix()}"] = path
    return found


def by_case(repository: Repository, folders: dict[str, Files]) -> Iterator[tuple[list[str], Files]]:
    """Each folder with the cases whose arrays are in it, in the order of the cases."""
    owners: dict[str, list[str]] = {}
    for case, heart in repository.parameters["heart"].items():
        clips = [f"clips/{case}/{view}" for view in repository.views]
        for place in (f"hearts/{heart}", *clips, f"inference/{case}"):
            owners.setdefault(place, []).append(str(case))
    yield from ((cases, folders[place]) for place, cases in owners.items() if place in folders)


def filled(stem: Path, holds: str, folders: Iterable[tuple[list[str], Files]], limit: int) -> list[Part]:
    """Fill parts with folders, one after the other.

    Parameters
    ----------
    stem : Path
        Beginning of the paths of the parts.
    holds : str
    folders : iterable
        Each with its cases and files, which stay together.
    limit : int
        Largest size of a part, bytes.
    """
    parts: list[Part] = []
    for cases, files in folders:
        if not parts or (parts[-1].size and parts[-1].size + size_of(files) > limit):
            parts.append(Part(stem.with_name(f"{stem.name}-{len(parts) + 1:04d}.zip"), holds))
        parts[-1].add(cases, files)
    return parts


def table(found: list[Part]) -> bytes:
    """Table of the parts, with a row for every case of which they hold files."""
    text = StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["part", "holds", "case"])
    rows.writerows([part.path.name, part.holds, case] for part in found for case in part.cases or [""])
    return text.getvalue().encode()


def registry(found: list[Part], texts: dict[str, bytes]) -> bytes:
    """Checksums of all files, as pooch reads them."""
    known = {part.path.name: checksum(part.path) for part in found}
    known |= {name: sha256(content).hexdigest() for name, content in texts.items()}
    return "".join(f"{name} sha256:{one}\n" for name, one in known.items()).encode()
