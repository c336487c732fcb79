"""Check of a repository: its files against their checksums, every chunk of its arrays, and the values in them."""

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from echotruth.config import Config
from echotruth.repository import group, values
from echotruth.repository.group import NotWritten
from echotruth.repository.metadata import OUTDATED, files_of
from echotruth.repository.places import METADATA, NOT_NEEDED, group_of, job_of
from echotruth.repository.publication import CHECKSUMS, checksum, published_files
from echotruth.repository.reader import Repository

REMEDY = "delete {} and run the configuration again"
TEXTS = ("cases.csv", "config.yaml")


class Fault(NamedTuple):
    """What is wrong with a file or a group, and what mends it."""

    path: str
    problem: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.path} {self.problem}: {self.remedy}"


@dataclass
class Report:
    """Result of a check."""

    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What is to be known and is no damage, such as jobs that were not run yet."""
    files: int = 0
    groups: int = 0


def check(folder: Path, progress: Callable[[int, int], None] | None = None, quick: bool = False) -> Report:
    """Check a repository to the end, by as many threads as there are cores.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    progress : callable, optional
        Called with the number of groups that are done, and of all.
    quick : bool, optional
        Whether to leave out the values, which takes longer than reading the files.

    Raises
    ------
    FileNotFoundError
        If the folder is not a repository.
    """
    repository, report = Repository(folder), Report()
    folder = repository.folder
    store = Path(repository.store)  # type: ignore[arg-type]  # it is a folder
    _check_files(folder, store, report)
    if quick:
        return report
    groups = sorted(path.parent for path in files_of(store) if path.name == METADATA and _has_arrays(path.parent))
    places, configs = [path.relative_to(store).as_posix() for path in groups], _configs(repository)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        found = pool.map(lambda place: list(_faults(store, place, configs)), places)
        for done, faults in enumerate(found, 1):
            report.faults += faults
            if progress:
                progress(done, len(places))
    report.groups = len(places)
    return report


def _check_files(folder: Path, store: Path, report: Report) -> None:
    """Compare all files with the list of checksums."""
    present = {path.relative_to(folder).as_posix(): path for path in published_files(folder, store) if path.is_file()}
    report.files = len(present)
    if not (folder / CHECKSUMS).is_file():
        report.notes.append(f"{folder / CHECKSUMS} is not there: the run has not ended: files have no checksums")
        return
    listed = {}
    for line in (folder / CHECKSUMS).read_text(encoding="utf-8", errors="replace").splitlines():
        hash, _, name = line.partition("  ")
        listed[name] = hash
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        hashes = dict(zip(present, pool.map(checksum, present.values()), strict=True))
    lost = {name: _group_of(name).partition(" ")[0] for name in listed if name not in present}
    outdated = {place for place in lost.values() if (folder / place / OUTDATED).is_file()}
    for place in sorted(outdated):
        problem = "was made with other settings or by other code"
        report.faults.append(Fault(place, problem, "run the configuration again, which makes it"))
    for name in sorted(name for name in {*listed, *present} if lost.get(name) not in outdated):
        if name not in present:
            report.faults.append(Fault(name, "is missing", REMEDY.format(_group_of(name))))
        elif name not in listed:
            report.faults.append(Fault(name, f"is not listed in {CHECKSUMS}", f"delete it, or {CHECKSUMS}, and run"))
        elif hashes[name] != listed[name]:
            report.faults.append(Fault(name, "is not what was written", REMEDY.format(_group_of(name))))


def _group_of(name: str) -> str:
    """Folder of the group that one job made, of which a file is a part; the checksums if no job made it."""
    store, _, path = name.partition("/")
    if group := job_of(path):
        return f"{store}/{group} and {CHECKSUMS}" if group_of(group) in NOT_NEEDED else f"{store}/{group}"
    return name if name in TEXTS else CHECKSUMS  # without them the rule repository writes what no job made


def _has_arrays(folder: Path) -> bool:
    return any((child / METADATA).is_file() and (child / "c").is_dir() for child in folder.iterdir())


def _faults(store: Path, place: str, configs: Mapping[str, Config]) -> Iterator[Fault]:
    """What is wrong with a group: chunks that cannot be read, and values that cannot be."""
    where, remedy = f"{store.name}/{place}", REMEDY.format(_group_of(f"{store.name}/{place}/{METADATA}"))
    try:
        arrays = group.read(store, place)
    except (NotWritten, ValueError, OSError, RuntimeError) as error:
        yield Fault(where, f"cannot be read ({type(error).__name__}: {str(error)[:100]})", remedy)
        return
    config = configs.get("/".join(place.split("/")[:2]))
    if config is None:  # it was put there by hand
        return
    try:
        found = list(values.faults(group_of(place), arrays, config))
    except (ValueError, LookupError, TypeError) as error:
        yield Fault(where, f"has arrays that do not belong together ({str(error)[:100]})", remedy)
        return
    for name, problem in found:
        yield Fault(f"{where}/{name}", problem, "its numbers are wrong: report it with the configuration")


def _configs(repository: Repository) -> dict[str, Config]:
    """Beginning of the paths of all groups, as `clips/CASE`, -> configuration of a case that has them."""
    found: dict[str, Config] = {}
    for case, heart in repository.parameters["heart"].items():
        config = repository.case(str(case)).config
        found |= dict.fromkeys([f"hearts/{heart}", f"clips/{case}", f"inference/{case}"], config)
    return found
