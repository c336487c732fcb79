"""Check of a repository: its files against their checksums, every chunk of its arrays, and the values in them."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from echotruth.config import Config
from echotruth.repository import group, values
from echotruth.repository.checksums import CHECKSUMS, METADATA, checksum, files_of, read_sealed
from echotruth.repository.group import NotWritten
from echotruth.repository.places import group_of, job_of, made
from echotruth.repository.publication import TEXTS, published_checksums
from echotruth.repository.reader import Repository

REMEDY = "delete {} and run the configuration again"


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
    """Compare all files with the checksums of the jobs that wrote them, and with those that are published."""
    published = published_checksums(folder)
    if not published:
        report.notes.append(f"{folder / CHECKSUMS} is not there: the run has not ended: what no job wrote is unchecked")
    made_here = {f"{store.name}/{path}" for path in made(store)}
    others = {path for path in made_here if published and f"{path}/{METADATA}" not in published}
    if others:
        report.notes.append(f"{len(others)} groups are not of the configuration, as {min(others)}: they are unchecked")
    expected = _expected(folder, made_here - others, published, report)
    present = {path.relative_to(folder).as_posix() for path in files_of(store) if path.suffix != ".partial"}
    present = {name for name in present if _job(name) not in others}
    present |= {name for name in TEXTS if (folder / name).exists()}
    hashes = _hashes(folder, present & {*expected})
    report.files = len(hashes)
    for name in sorted({*expected, *(present if published else ())}):
        if name not in expected:
            report.faults.append(Fault(name, f"is not listed in {CHECKSUMS}", f"delete it, or {CHECKSUMS}, and run"))
        elif name not in hashes:
            report.faults.append(Fault(name, "is missing", REMEDY.format(_made_with(name))))
        elif hashes[name] != expected[name]:
            report.faults.append(Fault(name, "is not what was written", REMEDY.format(_made_with(name))))


def _expected(folder: Path, groups: set[str], published: dict[str, str], report: Report) -> dict[str, str]:
    """Checksums that the files should have: those of the jobs, or else those that are published."""
    expected = dict(published)
    for path in sorted(groups):
        stored = _stored(folder, path)
        now = checksum(folder / path / METADATA) if stored else ""
        if stored and published and now != published[f"{path}/{METADATA}"]:
            remedy = "run the configuration again, which publishes it, or makes it again"
            report.faults.append(Fault(path, "is not the one that was published", remedy))
            expected = {name: hash for name, hash in expected.items() if _job(name) != path}
            stored[f"{path}/{METADATA}"] = now
        expected |= stored
    return expected


def _hashes(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Checksums of those that are files."""
    files = [name for name in sorted(names) if (folder / name).is_file()]
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return dict(zip(files, pool.map(lambda name: checksum(folder / name), files), strict=True))


def _stored(folder: Path, group: str) -> dict[str, str]:
    """Checksums that the job of a group stored in it, by path below the folder; none if they are damaged."""
    try:
        _, found = read_sealed(folder / group)
    except (FileNotFoundError, ValueError):
        return {}
    return {f"{group}/{name}": hash for name, hash in found.items()}


def _job(name: str) -> str:
    """Folder of the group that one job made, of which a file is a part; empty if it is of none."""
    store, _, path = name.partition("/")
    group = job_of(path)
    return f"{store}/{group}" if group else ""


def _made_with(name: str) -> str:
    """What is to be deleted so that a file is made again; without checksums, what no job writes is published anew."""
    return _job(name) or (name if name in TEXTS else CHECKSUMS)


def _has_arrays(folder: Path) -> bool:
    return any((child / METADATA).is_file() and (child / "c").is_dir() for child in folder.iterdir())


def _faults(store: Path, place: str, configs: Mapping[str, Config]) -> Iterator[Fault]:
    """What is wrong with a group: chunks that cannot be read, and values that cannot be."""
    where = f"{store.name}/{place}"
    remedy = REMEDY.format(_made_with(f"{where}/{METADATA}"))
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
