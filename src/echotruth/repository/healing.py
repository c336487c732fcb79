"""Healing of a repository: what is damaged is dropped with its record, so that the next run makes it again.

Snakemake finds the record missing, runs its job, and after it those that depend on it; they give the bytes of before.
"""

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
    records = {path for fault in report.faults for path in fault.records if path.is_file()}
    files = {path for fault in report.faults for path in fault.files if path.is_file()} - records
    # A record goes first: without it, its files are those of a job that was not finished.
    for path in (*sorted(records), *sorted(files)):
        path.unlink(missing_ok=True)
    return len(records), len(files)
