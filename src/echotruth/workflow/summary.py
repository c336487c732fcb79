"""What a run has made, and what it took."""

from __future__ import annotations

import json
import os
import resource
import time
from collections.abc import Iterator
from pathlib import Path

from echotruth.repository.ledger import imaged_statuses
from echotruth.workflow.progress import format_duration
from echotruth.workflow.status import Status, StatusError, status_of
from echotruth.workflow.status_text import verdicts

NO_HEART = 4
"""Exit status of a run that made everything, of which no heart is imaged."""


class Spent:
    """Time and CPU time since this was made."""

    def __init__(self) -> None:
        self._clock, self._time, self._cpu = time.monotonic(), time.time(), _cpu_of_children()

    def __str__(self) -> str:
        return f"{format_duration(self.seconds)}"

    @property
    def seconds(self) -> float:
        """Time, s."""
        return time.monotonic() - self._clock

    def cpu_seconds(self, folder: Path) -> float:
        """CPU time, s: of the processes that were started here, or by the records of jobs that ran elsewhere.

        Parameters
        ----------
        folder : Path
            Folder of the repository.
        """
        return max(_cpu_of_children() - self._cpu, sum(_recorded(folder / "ledger", self._time)))


def _cpu_of_children() -> float:
    """CPU time of the processes that this one has started and that have ended, s."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _recorded(ledger: Path, since: float) -> Iterator[float]:
    """CPU time of the jobs whose records were made since a time, s."""
    for folder, _, names in os.walk(ledger):
        for path in (Path(folder) / name for name in names if name.endswith(".json")):
            try:
                if path.stat().st_mtime >= since:
                    record = json.loads(path.read_text(encoding="utf-8"))
                    yield float(record.get("cpu_seconds", 0)) + float(record.get("start_seconds", 0))
            except (OSError, ValueError):
                continue


def finished(folder: Path, spent: Spent, exclude_implausible: bool) -> tuple[str, int]:
    """Lines that end a run in which all jobs went well, and its exit status: 0, or `NO_HEART` if no heart is imaged.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    spent : Spent
        Since the run began.
    exclude_implausible : bool
        The key of `physiology`: whether only complete hearts are imaged.
    """
    try:
        status = status_of(folder)
    except StatusError:
        hearts, has_heart = [], True
    else:
        hearts, has_heart = verdicts(status), any(map(status.verdicts.get, imaged_statuses(exclude_implausible)))
    lines = [
        f"Time:       {spent} ({format_duration(spent.cpu_seconds(folder))} of CPU time)",
        f"Repository: {folder / f'{folder.name}.zarr'}",
    ]
    report = folder / "report.html"
    lines += [f"Report:     {report}"] if report.is_file() else []
    lines += [] if has_heart else ["No heart is complete, so there are no images."]
    return "\n".join([*hearts, *lines]), 0 if has_heart else NO_HEART


def unfinished(folder: Path) -> str:
    """Sentence that ends a run in which jobs failed.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    """
    try:
        made = _made(status_of(folder))
    except StatusError:
        made = "nothing"
    return f"not finished; made so far: {made}: run the same command again to continue (echotruth status {folder})"


def _made(status: Status) -> str:
    parts = [f"{name} {part.done}/{part.jobs}" for name, part in status.parts.items()]
    return ", ".join(parts) or "nothing"
