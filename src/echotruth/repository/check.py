"""Check of a repository: every file against its checksum, the metadata against the schema, and the values.

The records of the ledger vouch for the shards of their jobs, and `ledger/structure.json` for all other files of the
hierarchy. The check goes on to the end and names every fault with what heals it; :mod:`.healing` does so.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from echotruth.repository.check_jobs import check_job, check_loop
from echotruth.repository.check_structure import (
    Listed,
    check_configuration,
    check_metadata,
    check_others,
    check_registries,
    check_structure,
    unrecorded_files,
)
from echotruth.repository.inventory import Fault, Inventory, JobRecord


@dataclass
class Report:
    """Result of a check."""

    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What is to be known and is no damage, such as jobs that were not run yet."""
    files: int = 0
    """Number of checked files."""
    jobs: int = 0
    """Number of records."""


def check(folder: Path, progress: Callable[[int, int], None] | None = None, quick: bool = False) -> Report:
    """Check a repository to the end, by as many threads as there are cores.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    progress : callable, optional
        Called with the number of records that are done, and of all.
    quick : bool, optional
        Whether to leave out the values in the files of the jobs, which takes much longer than reading the files.

    Raises
    ------
    CheckError
        If the folder is not a repository.
    """
    repository, report = Inventory(folder), Report()
    if edited := check_configuration(repository):
        report.faults = edited
        report.notes = ["nothing else was checked, because the configuration says what must be there"]
        return report
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        structure, report.faults = check_structure(repository, pool)
        is_whole = not report.faults
        if is_whole:
            report.faults += check_registries(repository)
            report.faults += check_metadata(repository)
        repository.distrust({path for fault in report.faults for path in fault.files})
        report.faults += check_others(repository)
        records = repository.records()
        listed: Listed = {}
        jobs = pool.map(lambda record: check_job(repository, record, quick), records)
        for done, (record, found) in enumerate(zip(records, jobs, strict=True), 1):
            report.faults += found.faults
            report.files += found.files
            row = repository.row(record)
            if found.arrays is not None and row is not None:
                listed[record.stage, record.size, row] = found.arrays
            if progress:
                progress(done, len(records))
        damaged = {path for fault in report.faults for path in fault.records}
        solved = [record for record in records if record.stage == "mechanics" and record.path not in damaged]
        report.faults += [
            fault for faults in pool.map(lambda one: check_loop(repository, one), solved) for fault in faults
        ]
    report.faults += unrecorded_files(repository, listed, structure)
    # What is wrong with the metadata of an array is found by every job that has written it.
    report.faults = sorted(dict.fromkeys(report.faults), key=lambda fault: fault.path)
    report.notes = _notes(repository, records)
    report.files += len(structure or ())
    report.jobs = len(records)
    return report


def _notes(repository: Inventory, records: list[JobRecord]) -> list[str]:
    notes = []
    wanted, found = repository.wanted(), {record.path for record in records}
    if missing := sum(path not in found for path in wanted):
        notes.append(f"{missing} of {len(wanted)} jobs have not been run yet: echotruth run makes them")
    elif not repository.publication_record.is_file():
        notes.append("the repository has not been published yet: echotruth run does so")
    return notes
