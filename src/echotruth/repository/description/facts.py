"""What is to be known of a repository to describe it, from its configuration, its ledger and its store."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from itertools import chain
from pathlib import Path
from typing import Any

from echotruth.repository import ledger, schema
from echotruth.repository.array import Array
from echotruth.repository.benchmark_files import total
from echotruth.repository.description.attribution import Attribution, Author, DescriptionError
from echotruth.repository.description.files import StoredFile, damaged, files_beside, store_files
from echotruth.repository.hierarchy import ROOT
from echotruth.repository.inventory import CheckError, Inventory, JobRecord
from echotruth.repository.ledger import record_paths
from echotruth.repository.verdict import verdict

Record = dict[str, Any]
"""A record of the ledger."""

STATUSES = ("complete", "implausible", "failed", "unfinished")
"""What can become of a case."""

UNCHANGED = "that of config.yaml"
"""Stands for the value of a key that a case leaves as it is in the configuration."""


@dataclass(frozen=True)
class Run:
    """The runs that made a repository."""

    started: datetime
    """Start of the first job, by the time of its record."""
    ended: datetime
    """End of the last job, by the time of its record."""
    jobs: int
    hours: float
    """Time of one core, h."""
    instructions: list[str]
    """Instructions of the processors that were used."""
    packages: dict[str, str]
    """Name -> version."""


@dataclass(frozen=True)
class Facts:
    """What is to be known of a repository."""

    repository: Inventory
    attribution: Attribution
    """With authors, an unnamed group if need be."""
    published: date
    """Day of publication: as given, or that of the last job."""
    outcomes: dict[str, tuple[str, str]]
    """Case -> what became of it, one of `STATUSES`, and why it is not complete."""
    missing_jobs: int
    wanted_jobs: int
    is_published: bool
    """Whether its files were verified after the last job."""
    failures: list[str]
    """Jobs and trackers that found no result, in words."""
    arrays: dict[str, list[Array]]
    """Group -> its arrays, after a pack what it holds. Groups that differ in the size of the image are one."""
    files: list[StoredFile]
    """All of the store."""
    tables: list[StoredFile]
    """Files beside the store that are made for readers: tables, figures, the report."""
    run: Run
    images: dict[JobRecord, dict[str, str]]
    """Job -> path below the store of each file of images that it wrote -> SHA-256."""

    @property
    def name(self) -> str:
        """Name of the repository."""
        return self.repository.config.name

    @property
    def store(self) -> str:
        """Name of the folder of the store."""
        return self.repository.store.name

    @property
    def counts(self) -> dict[str, int]:
        """Status -> number of cases with it, if there are any."""
        found = [status for status, _ in self.outcomes.values()]
        return {status: found.count(status) for status in STATUSES if status in found}

    @property
    def swept(self) -> dict[str, list[object]]:
        """Keys in which the cases differ -> their distinct values, in the order of the cases.

        A case that gives a key no value, as an empty cell of a table, has that of the configuration.
        """
        given = [case.parameters for case in self.repository.cases.values()]
        values = {key: [each.get(key, UNCHANGED) for each in given] for key in dict.fromkeys(chain(*given))}
        distinct = {key: list({repr(value): value for value in each}.values()) for key, each in values.items()}
        return {key: each for key, each in distinct.items() if len(each) > 1}


def read_facts(folder: Path, given: Attribution) -> Facts:
    """Read what is to be known of a repository.

    Parameters
    ----------
    folder : Path
        `out/NAME`.
    given : Attribution
        Authors, licence, address.

    Raises
    ------
    DescriptionError
        If the folder is not a repository, is damaged, or has no result yet.
    """
    try:
        repository = Inventory(folder)
    except CheckError as error:
        raise DescriptionError(str(error)) from None
    records, checksums = _records(repository)
    if not records:
        raise DescriptionError(f"{folder}: has no result yet: run its configuration first")
    wanted = repository.wanted()
    missing = set(wanted) - {record.path for record in records}
    run = _run(repository, records)
    authors = given.authors or (Author(f"The authors of the repository {repository.config.name}"),)
    return Facts(
        repository,
        replace(given, authors=authors),
        given.published or run.ended.date(),
        outcomes=dict(_outcomes(repository, records, missing)),
        missing_jobs=len(missing),
        wanted_jobs=len(wanted),
        is_published=repository.publication_record.is_file() and not missing,
        failures=list(_failures(records)),
        arrays=_arrays(repository),
        files=store_files(repository, checksums),
        tables=files_beside(folder),
        run=run,
        images={record: entries.get("sha256", {}) for record, entries in records.items() if record.stage == "bmode"},
    )


def _read(folder: Path, path: Path) -> Record:
    """A record of the ledger, or the metadata of a group of the store."""
    try:
        record = ledger.read(path)
    except (OSError, ValueError):
        record = None
    if not isinstance(record, dict):
        raise damaged(folder, path)
    return record


def _arrays(repository: Inventory) -> dict[str, list[Array]]:
    found: dict[str, list[Array]] = {}
    for path, arrays in sorted(repository.groups.items()):
        members = {pack.array.name: pack.members for pack in schema.packs_of(path)}
        found[schema.kind(path)] = listed = []
        for array in arrays:
            packed = members.get(array.name, ())
            listed += [array, *(replace(one, long_name=f"{one.long_name} (in {array.name})") for one in packed)]
    return found


def _records(repository: Inventory) -> tuple[dict[JobRecord, Record], dict[str, str]]:
    """Records of the present cases and views, and the checksums in all records, by path below the store.

    Of the checksums the records keep those of the images alone: there may be a million.
    """
    present = {(case, view) for case in repository.cases for view in (None, *repository.config.views)}
    found: dict[JobRecord, Record] = {}
    checksums: dict[str, str] = {}
    for record in repository.records():
        entries = _read(repository.folder, record.path)
        checksums |= entries.get("sha256", {}) if record.stage == "bmode" else entries.pop("sha256", {})
        if (record.case, record.view) in present:
            found[record] = entries
    if repository.structure_record.is_file():
        checksums |= _read(repository.folder, repository.structure_record).get("sha256", {})
    return found, checksums


def _outcomes(
    repository: Inventory, records: dict[JobRecord, Record], missing: set[Path]
) -> Iterator[tuple[str, tuple[str, str]]]:
    entries = {record.path: each for record, each in records.items()}
    for case in repository.cases:
        mechanics, *others = record_paths(repository.folder, case, repository.config)
        bounds = repository.cases[case].config.physiology
        found = verdict(entries[mechanics], bounds) if mechanics in entries else None
        if found is None or (found.status != "failed" and missing & set(others)):
            yield case, ("unfinished", "not all of its jobs have been run")
        else:
            yield case, found


def _failures(records: dict[JobRecord, Record]) -> Iterator[str]:
    for record, entries in records.items():
        if record.view and entries["status"] == "failed":
            yield f"{record.job}: {entries.get('reason', '')}"
        for tracker, reason in sorted(entries.get("failures", {}).items()):
            yield f"{tracker} on {record.case}, {record.view}, {record.size} px: {reason}"


def _run(repository: Inventory, records: dict[JobRecord, Record]) -> Run:
    ends = {record: record.path.stat().st_mtime for record in records}
    published = repository.publication_record
    attributes = _read(repository.folder, repository.store / ROOT).get("attributes", {})
    return Run(
        started=_moment(min(ends.values())),
        ended=_moment(max([*ends.values(), *([published.stat().st_mtime] if published.is_file() else [])])),
        jobs=len(records),
        hours=round(total(repository.folder) / 3600, 2),
        instructions=sorted({entries["instructions"] for entries in records.values() if "instructions" in entries}),
        packages=dict(sorted(attributes.get("packages", {}).items())),
    )


def _moment(seconds: float) -> datetime:
    """Time in whole seconds, so that file systems that keep no fractions give the same."""
    return datetime.fromtimestamp(int(seconds), UTC)
