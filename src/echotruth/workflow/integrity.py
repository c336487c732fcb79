"""The command `echotruth check FOLDER`: a line for every fault of a repository, and its healing."""

import sys
from pathlib import Path
from uuid import uuid4

from echotruth.repository.check import Report, check
from echotruth.repository.healing import heal
from echotruth.repository.inventory import CheckError
from echotruth.repository.ledger import NOT_A_REPOSITORY
from echotruth.workflow import lease


def check_repository(folder: Path, healing: bool, quick: bool = False) -> int:
    """Check a repository and print what was found.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    healing : bool
        Whether to drop what is damaged.
    quick : bool
        Whether to leave out the values in the files of the jobs.

    Returns
    -------
    int
        0 if nothing is damaged, 1 if something is, 2 if the folder cannot be checked or healed.
    """
    try:
        if not (folder / "config.yaml").is_file():
            raise CheckError(f"{folder}: {NOT_A_REPOSITORY}")
        if not healing:
            _tell_of_run(folder)
            report = check(folder, progress=_progress, quick=quick)
            status = _print(folder, report)
            if any(fault.records or fault.files for fault in report.faults):
                print(f"To mend it: echotruth check {folder} --heal, and then echotruth run with its configuration")
            return status
        held = lease.acquire(folder, uuid4().hex, wait=False)
        try:
            return _heal(folder, quick)
        finally:
            held.release()
    except (CheckError, OSError) as error:
        print(f"echotruth: {error}", file=sys.stderr)
        return 2


def _tell_of_run(folder: Path) -> None:
    try:
        lease.follow(folder)
    except lease.LeaseError as error:
        print(f"{error}: files that it is writing may be reported as faults")


def _heal(folder: Path, quick: bool) -> int:
    report = check(folder, progress=_progress, quick=quick)
    status = _print(folder, report)
    records, files = heal(report)
    if records:
        # What was published is no more; only for what lacks its output, Snakemake makes a record again.
        (folder / "ledger/repository.json").unlink(missing_ok=True)
    if records or files:
        print(f"dropped: {records} records and {files} files: echotruth run makes them again")
    return status


def _print(folder: Path, report: Report) -> int:
    for line in (*report.faults, *report.notes):
        print(line)
    found = f"{len(report.faults)} fault{'s' * (len(report.faults) > 1)}" if report.faults else "no faults"
    print(f"{folder}: {found} in {report.files} files of {report.jobs} jobs and of the structure")
    return 1 if report.faults else 0


def _progress(done: int, total: int) -> None:
    if sys.stderr.isatty():
        print(f"\rchecked: {done} of {total} jobs", end="\n" if done == total else "", file=sys.stderr, flush=True)
