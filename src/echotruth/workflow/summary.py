"""What a run has made, and what it took."""

import time
from pathlib import Path

from echotruth.repository.benchmark_files import core_seconds
from echotruth.repository.ledger import imaged_statuses
from echotruth.workflow.progress import format_duration
from echotruth.workflow.status import status_of, verdicts

NO_HEART = 4
"""Exit status of a run that made everything, of which no heart is imaged."""


def finished(folder: Path, start: float, exclude_implausible: bool) -> tuple[str, int]:
    """Lines that end a run in which all jobs went well, and its exit status: 0, or `NO_HEART` if no heart is imaged.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    start : float
        Time at which the run began, s (:func:`time.time`).
    exclude_implausible : bool
        The key of `physiology`: whether only complete hearts are imaged.
    """
    status = status_of(folder)
    files = [file for file in (folder / "benchmarks").rglob("*.tsv") if file.stat().st_mtime >= start - 1]
    spent = format_duration(sum(map(core_seconds, files)))
    lines = [
        *verdicts(status),
        f"Time:       {format_duration(time.time() - start)} ({spent} of CPU time)",
        f"Repository: {folder / f'{folder.name}.zarr'}",
    ]
    lines += [f"Report:     {folder / 'report.html'}"] if (folder / "report.html").is_file() else []
    if any(status["verdicts"][verdict] for verdict in imaged_statuses(exclude_implausible)):
        return "\n".join(lines), 0
    return "\n".join([*lines, "No heart is complete, so there are no images."]), NO_HEART


def unfinished(folder: Path) -> str:
    """Sentence that ends a run in which jobs failed.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    """
    parts = status_of(folder)["parts"].items()
    made = ", ".join(f"{rule} {part['done']}/{part['jobs']}" for rule, part in parts if part["done"]) or "nothing"
    return f"not finished; made so far: {made}: run the same command again to continue (echotruth status {folder})"
