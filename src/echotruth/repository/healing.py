"""Healing of a repository: what is damaged is dropped, made again by itself, and takes its place as it was before.

Snakemake runs what depends on a record again if the record is newer, and plans so before it knows the new bytes. So the
dropped records are made rule by rule. One whose files have the bytes of before gets the time of the record that it
replaces, and nothing that depends on it is run again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.repository import durable, ledger
from echotruth.repository.check import Report
from echotruth.repository.checksums import checksums
from echotruth.repository.inventory import Inventory, JobRecord, wanted_records

RULES = (("mechanics",), ("physiology",), ("phantom", "truth", "rf", "bmode"), ("tracking", "evaluation"))
"""Stages of the jobs, in their order."""

PUBLICATION = "ledger/repository.json"
COMPARED = ("status", "reason", "failures", "sha256")
"""Entries of a record on which later jobs depend; the others are costs and versions."""

Entry = dict[str, Any]
"""Time of a record (`mtime_ns`), and `content`, a hash."""

Known = dict[str, Entry]
"""Path of a record below the folder of the repository -> its entry."""


def heal(folder: Path, report: Report) -> tuple[int, int]:
    """Drop the damaged files and their records, and nothing else, so that the next run makes them again.

    No run may be writing the repository.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    report : Report
        As :func:`echotruth.repository.check.check` returns it.

    Returns
    -------
    records, files : int
        Number of dropped records and of deleted files.
    """
    records = {path for fault in report.faults for path in fault.records if path.is_file()}
    files = {path for fault in report.faults for path in fault.files if path.is_file()} - records
    if records:
        _remember(folder, records)
    # A record goes first: without it, its files are those of a job that was not finished.
    for path in (*sorted(records), *sorted(files)):
        path.unlink(missing_ok=True)
    return len(records), len(files)


def remake(folder: Path, config: Config, make: Callable[[list[str]], int]) -> int:
    """Make the records that were dropped, those of one rule after the other.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
        Its configuration; records of what is not of it are left to a run of one that has it.
    make : callable
        Runs the jobs of some records, given by their paths, and no others; returns 0 if it succeeds.

    Returns
    -------
    int
        0, or what `make` returned when it failed.
    """
    if not _file(folder).is_file():
        return 0
    cases = [case.id for case in expand(config)]
    wanted = {*wanted_records(folder, cases, list(config.views)), folder / PUBLICATION}
    for stages in (*RULES, (Path(PUBLICATION).name,)):
        known = {path: entry for path, entry in _known(folder).items() if Path(path).parts[1] in stages}
        missing = sorted(
            str(folder / path) for path in known if folder / path in wanted and not (folder / path).is_file()
        )
        if missing and (status := make(missing)):
            return status
        for path, entry in known.items():
            _settle(folder / path, entry)
    _file(folder).unlink()
    return 0


def _remember(folder: Path, dropped: set[Path]) -> None:
    """Keep time and content of the dropped records, and of all others of their hearts, which may go with them."""
    repository = Inventory(folder)
    cases = {record.case for record in repository.records() if record.path in dropped}
    known = _known(folder)
    for record in repository.records():
        if record.case in cases:
            entry = _entry(record.path) or _entry_of_files(repository, record)
            known.setdefault(repository.name(record.path), entry)
    if repository.publication_record.is_file():
        known.setdefault(PUBLICATION, _entry(repository.publication_record) or {"mtime_ns": 0, "content": ""})
    durable.write(_file(folder), json.dumps(known, indent=1, sort_keys=True).encode())


def _settle(path: Path, before: Entry) -> None:
    """Give a record that was made again the time of the one that it replaces, if it says the same."""
    now = _entry(path) if path.is_file() else {}
    if now and now["content"] == before["content"]:
        os.utime(path, ns=(before["mtime_ns"], before["mtime_ns"]))


def _entry(path: Path) -> Entry:
    """Time and content of a record; empty if it cannot be read."""
    try:
        record = ledger.read(path)
        compared = record if path.name == Path(PUBLICATION).name else {key: record.get(key) for key in COMPARED}
    except (ValueError, AttributeError):
        return {}
    return {"mtime_ns": path.stat().st_mtime_ns, "content": _hash(compared)}


def _entry_of_files(repository: Inventory, record: JobRecord) -> Entry:
    """Entry of a record that cannot be read: that of a complete job which wrote the files as they are.

    Its time is theirs, because what damaged the record may have changed its time; without files nothing depends on it.
    """
    files = [file for file in (repository.store / path for path in repository.shards(record)) if file.is_file()]
    content = dict.fromkeys(COMPARED) | {"status": "complete", "sha256": checksums(files, repository.store)}
    oldest = min(other.path.stat().st_mtime_ns for other in repository.records() if other.case == record.case)
    written = max((file.stat().st_mtime_ns for file in files), default=oldest)
    return {"mtime_ns": min(record.path.stat().st_mtime_ns, written), "content": _hash(content)}


def _hash(content: dict[str, Any]) -> str:
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _known(folder: Path) -> Known:
    return json.loads(_file(folder).read_text(encoding="utf-8")) if _file(folder).is_file() else {}


def _file(folder: Path) -> Path:
    return folder / "healing.json"
