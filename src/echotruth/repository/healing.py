"""Healing of a repository: what is damaged is dropped with its record, so that the next run makes it again.

Snakemake finds the record missing, runs its job, and after it those that depend on it; they give the bytes of before.
"""

from contextlib import suppress
from pathlib import Path

from echotruth.repository.check import Report


def heal(report: Report) -> tuple[int, int]:
    """Drop the damaged files and their records, and nothing else.

    No run may be writing the repository.

    Parameters
    ----------
    report : Report
        As :func:`echotruth.repository.check.check` returns it.

    Returns
    -------
    records, files : int
        Number of dropped records and of deleted files.
    """
    records = {path for fault in report.faults for path in fault.records if _is_there(path)}
    files = {path for fault in report.faults for path in fault.files if _is_there(path)} - records
    # A record goes first: without it, its files are those of a job that was not finished.
    for path in (*sorted(records), *sorted(files)):
        _delete(path)
    return len(records), len(files)


def _is_there(path: Path) -> bool:
    """Whether a path has something, be it a link to nothing."""
    return path.exists() or path.is_symlink()


def _delete(path: Path) -> None:
    """Delete what stands in the place of a file; of a folder, which is not a file of ours, only one that is empty."""
    if path.is_dir() and not path.is_symlink():
        with suppress(OSError):
            path.rmdir()
    else:
        path.unlink(missing_ok=True)
