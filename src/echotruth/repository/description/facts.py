"""What is to be known of a repository to describe it, from its configuration, its ledger and its store."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Any

from echotruth.cases import Case
from echotruth.config import Config
from echotruth.repository import ledger
from echotruth.repository.description.attribution import DescriptionError
from echotruth.repository.description.files import StoredFile, damaged, files_beside, store_files
from echotruth.repository.description.quantities import Quantity, read_quantities
from echotruth.repository.hierarchy import ROOT
from echotruth.repository.inventory import CheckError, Inventory, JobRecord
from echotruth.repository.ledger import GATES, VIEW_STAGES, record_path

Record = dict[str, Any]
"""A record of the ledger."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case: complete, implausible, failed or unfinished, and why it is not complete."""

    case: str
    status: str
    reason: str = ""


@dataclass(frozen=True)
class Run:
    """The runs that made a repository."""

    started: datetime
    """Start of the first job, by the time of its record."""
    ended: datetime
    """End of the last job, by the time of its record."""
    jobs: int
    cpu_seconds: float
    instructions: tuple[str, ...]
    """Instructions of the processors that were used."""
    code: dict[str, tuple[str, ...]]
    """Stage -> versions of its code."""
    packages: dict[str, str]
    """Name -> version."""


UNCHANGED = "that of config.yaml"
"""Stands for the value of a key that a case leaves as it is in the configuration."""


@dataclass(frozen=True)
class Facts:
    """What is to be known of a repository."""

    folder: Path
    config: Config
    cases: dict[str, Case]
    """The cases by id."""
    outcomes: tuple[Outcome, ...]
    """One for every case."""
    missing_jobs: int
    wanted_jobs: int
    is_published: bool
    """Whether its files were verified after the last job."""
    failures: tuple[str, ...]
    """Jobs and trackers that found no result, in words."""
    quantities: tuple[Quantity, ...]
    files: tuple[StoredFile, ...]
    """All of the store."""
    tables: tuple[StoredFile, ...]
    """Files beside the store that are made for readers: tables, figures, the report."""
    run: Run
    records: tuple[tuple[JobRecord, Record], ...]
    """Records of the present cases and views, sorted; the checksums are left out but for those of images."""

    @property
    def name(self) -> str:
        """Name of the repository."""
        return self.config.name

    @property
    def store(self) -> str:
        """Name of the folder of the store."""
        return f"{self.name}.zarr"

    @property
    def is_finished(self) -> bool:
        """Whether all jobs are done and verified."""
        return not self.missing_jobs and self.is_published

    def count(self, status: str) -> int:
        """Number of cases with a status."""
        return sum(outcome.status == status for outcome in self.outcomes)

    @property
    def arrays(self) -> list[Quantity]:
        """Quantities without coordinates, and without the keys of the cases, which `cases.csv` has."""
        return [one for one in self.quantities if not one.is_coordinate and "." not in one.name and one.name != "seed"]

    @property
    def swept(self) -> dict[str, list[object]]:
        """Keys in which the cases differ -> their distinct values, in the order of the cases.

        A case that gives a key no value, as an empty cell of a table, has that of the configuration.
        """
        keys = dict.fromkeys(key for case in self.cases.values() for key in case.parameters)
        values = {key: [case.parameters.get(key, UNCHANGED) for case in self.cases.values()] for key in keys}
        distinct = {key: list({repr(value): value for value in each}.values()) for key, each in values.items()}
        return {key: each for key, each in distinct.items() if len(each) > 1}


def read_facts(folder: Path) -> Facts:
    """Read what is to be known of a repository.

    Parameters
    ----------
    folder : Path
        `out/NAME`.

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
    missing = set(wanted) - {record.path for record, _ in records}
    document = _root(folder, repository.store)
    return Facts(
        folder,
        repository.config,
        repository.cases,
        outcomes=tuple(_outcomes(repository, dict((record.path, entries) for record, entries in records), missing)),
        missing_jobs=len(missing),
        wanted_jobs=len(wanted),
        is_published=repository.publication_record.is_file() and not missing,
        failures=tuple(_failures(records)),
        quantities=read_quantities(document["consolidated_metadata"]["metadata"]),
        files=store_files(repository, checksums),
        tables=files_beside(folder),
        run=_run(repository, records, document.get("attributes", {}).get("packages", {})),
        records=records,
    )


def _read(folder: Path, path: Path) -> Record:
    try:
        return dict(ledger.read(path))
    except (OSError, ValueError, TypeError):
        raise damaged(folder, path) from None


def _root(folder: Path, store: Path) -> Record:
    try:
        document = json.loads((store / ROOT).read_bytes())
        document["consolidated_metadata"]["metadata"].items()
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise damaged(folder, store / ROOT) from None
    return dict(document)


def _outcomes(repository: Inventory, records: dict[Path, Record], missing: set[Path]) -> Iterator[Outcome]:
    folder, views = repository.folder, list(repository.config.views)
    for case in repository.cases:
        gates = [records.get(record_path(folder, stage, case)) for stage in GATES]
        stopped = next((gate for gate in gates if gate is None or gate["status"] != "complete"), gates[-1])
        later = (record_path(folder, stage, case, view) for stage in VIEW_STAGES for view in views)
        if stopped is None or (stopped["status"] != "failed" and any(path in missing for path in later)):
            yield Outcome(case, "unfinished", "not all of its jobs have been run")
        else:
            yield Outcome(case, stopped["status"], stopped.get("reason", ""))


def _failures(records: tuple[tuple[JobRecord, Record], ...]) -> Iterator[str]:
    for record, entries in records:
        if record.view and entries["status"] == "failed":
            yield f"{record.job}: {entries.get('reason', '')}"
        for tracker, reason in sorted(entries.get("failures", {}).items()):
            yield f"{tracker} on {record.case}, {record.view}: {reason}"


def _records(repository: Inventory) -> tuple[tuple[tuple[JobRecord, Record], ...], dict[str, str]]:
    """Records of the present cases and views, and the checksums in all records, by path below the store.

    Of the checksums the records keep those of the images alone: there may be a million.
    """
    present = {(case, view) for case in repository.cases for view in (None, *repository.config.views)}
    found: list[tuple[JobRecord, Record]] = []
    checksums: dict[str, str] = {}
    for record in repository.records():
        entries = _read(repository.folder, record.path)
        checksums |= entries.get("sha256", {}) if record.stage == "bmode" else entries.pop("sha256", {})
        if (record.case, record.view) in present:
            found.append((record, entries))
    if repository.structure_record.is_file():
        checksums |= _read(repository.folder, repository.structure_record).get("sha256", {})
    return tuple(found), checksums


def _run(repository: Inventory, records: tuple[tuple[JobRecord, Record], ...], packages: dict[str, str]) -> Run:
    paths = [record.path for record, _ in records]
    ends = {path: path.stat().st_mtime for path in paths}
    starts = [ends[record.path] - entries.get("seconds", 0.0) for record, entries in records]
    published = repository.publication_record
    last = [*ends.values(), *([published.stat().st_mtime] if published.is_file() else [])]
    versions = sorted({(record.stage, entries["code"]) for record, entries in records})
    return Run(
        _moment(min(starts)),
        _moment(max(last)),
        len(records),
        round(sum(entries.get("cpu_seconds", 0.0) for _, entries in records), 3),
        tuple(sorted({str(entries["instructions"]) for _, entries in records if "instructions" in entries})),
        {stage: tuple(code for _, code in group) for stage, group in groupby(versions, key=lambda version: version[0])},
        dict(sorted(packages.items())),
    )


def _moment(seconds: float) -> datetime:
    """Time in whole seconds, so that file systems that keep no fractions give the same."""
    return datetime.fromtimestamp(int(seconds), UTC)
