"""How a repository is getting on: what of it is made, what runs, what failed and why, and how long it will take.

Everything is read from its folder, so that it does not matter on which machine the run is, or whether there is one.
"""

from __future__ import annotations

import csv
import json
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from echotruth.config import Config
from echotruth.repository import ledger
from echotruth.repository.ledger import GATES, NOT_A_REPOSITORY, record_path
from echotruth.workflow import lease
from echotruth.workflow.progress import Progress, expected_durations, replay
from echotruth.workflow.requests import existing_records

PARTS = {
    "mechanics": ("mechanics", "mechanics"),
    "measures": ("physiology", "physiology"),
    "images": ("imaging", "bmode"),
    "tracking": ("tracking", "evaluation"),
}
"""Part -> rule of its jobs, and the last stage that such a job records."""
FINAL_RULES = ("repository", "report", "report_images", "report_page")
"""Rules of the last part, which is the report."""
VERDICTS = ("complete", "implausible", "failed")
_COMPLETE = b'"status": "complete"'


class StatusError(ValueError):
    """Raised if a folder is no repository."""


@dataclass(frozen=True)
class PartStatus:
    """Jobs of one part of a repository.

    Attributes
    ----------
    jobs, done, running, failed, waiting : int
        Number of all, and of those in each state; `failed` are those that ended with an error in the last run, not
        hearts without a solution, which are results.
    """

    jobs: int
    done: int
    running: int
    failed: int

    @property
    def waiting(self) -> int:
        """Jobs that have not begun."""
        return max(0, self.jobs - self.done - self.running - self.failed)


@dataclass(frozen=True)
class Status:
    """How a repository is getting on.

    Attributes
    ----------
    folder : Path
    state : str
        `never begun`, `running`, `killed` (its run did not end by itself), `stopped` (its run ended before all was
        made) or `finished`.
    parts : dict
        Jobs by part, in the order in which they are done.
    hearts : int
    verdicts : dict
        Number of hearts that are complete, implausible or failed; the others are not known yet.
    reasons : dict
        Heart that is not complete -> its status and the reason.
    holder : str
        Process that works on it or did last; empty if none did.
    activity : str
        What runs, such as `imaging (2 of 4)`.
    share, seconds_left : float or None
        Share of the work of this run that is done, and the time it will still take, s; None unless it runs.
    logs : tuple of Path
        Logs of the jobs that ended with an error in the last run.
    """

    folder: Path
    state: str
    parts: dict[str, PartStatus]
    hearts: int
    verdicts: dict[str, int]
    reasons: dict[str, tuple[str, str]]
    holder: str = ""
    activity: str = ""
    share: float | None = None
    seconds_left: float | None = None
    logs: tuple[Path, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Values that JSON can hold."""
        parts = {
            name: {key: getattr(part, key) for key in ("jobs", "done", "running", "failed", "waiting")}
            for name, part in self.parts.items()
        }
        reasons = {case: {"status": status, "reason": reason} for case, (status, reason) in self.reasons.items()}
        return {
            "repository": str(self.folder),
            "state": self.state,
            "hearts": self.hearts,
            "verdicts": self.verdicts,
            "parts": parts,
            "reasons": reasons,
            "run": self.holder or None,
            "activity": self.activity or None,
            "share": None if self.share is None else round(self.share, 4),
            "seconds_left": None if self.seconds_left is None else round(self.seconds_left),
            "failed_logs": list(map(str, self.logs)),
        }


def status_of(folder: Path) -> Status:
    """Status of a repository.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.

    Raises
    ------
    StatusError
        If the folder does not exist, or holds neither a repository nor the beginning of one.
    """
    holder, lives = lease.current(folder)
    if not (folder / "config.yaml").is_file():
        if holder is None:
            raise StatusError(f"{folder}: {NOT_A_REPOSITORY}")
        state = "running" if lives else "stopped" if holder.released else "killed"
        return Status(folder, state, {}, 0, {}, {}, str(holder), "planning" if lives else "")
    cases, views = _cases(folder), _views(folder)
    return _status(folder, cases, views, holder, lives)


def status_before(config: Config, cases: Iterable[str], folder: Path) -> Status:
    """Status of a repository that may not have been begun, given its configuration.

    Parameters
    ----------
    config : Config
    cases : iterable of str
        Its hearts.
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    """
    holder, lives = lease.current(folder)
    return _status(folder, list(cases), list(config.views), holder, lives)


def _status(folder: Path, cases: list[str], views: list[str], holder: lease.Holder | None, lives: bool) -> Status:
    log = folder / "logs/snakemake.log"
    is_current = holder is not None and _is_of(log, holder)
    progress = replay(log, expected_durations(folder / "logs"), lives) if is_current else Progress({})
    parts = _parts(folder, cases, views, progress, lives)
    reasons = dict(_reasons(folder, cases))
    known = existing_records(folder / "ledger/physiology") & set(cases)
    number = Counter(status for case, (status, _) in reasons.items() if case in known)
    number["complete"] = len(known) - number.total()
    runs = lives and progress.is_planned
    return Status(
        folder,
        _state(parts, holder, lives),
        parts,
        len(cases),
        {verdict: number[verdict] for verdict in VERDICTS},
        reasons,
        "" if holder is None else str(holder),
        (progress.running if progress.is_planned else "planning") if lives else "",
        progress.fraction_done if runs else None,
        progress.seconds_left if runs else None,
        tuple(progress.logs),
    )


def _state(parts: dict[str, PartStatus], holder: lease.Holder | None, lives: bool) -> str:
    if lives:
        return "running"
    if all(part.done == part.jobs for part in parts.values()):
        return "finished"
    if holder is None:
        return "stopped" if any(part.done for part in parts.values()) else "never begun"
    return "stopped" if holder.released else "killed"


def _parts(folder: Path, cases: list[str], views: list[str], progress: Progress, lives: bool) -> dict[str, PartStatus]:
    running = Counter(job.rule for job in progress.running_jobs if _is_at_work(folder, job.log)) if lives else Counter()
    failed, parts = progress.failed_jobs, {}
    clips = {f"{case}/{view}" for case in cases for view in views}
    for part, (rule, stage) in PARTS.items():
        wanted = set(cases) if stage in GATES else clips
        done = len(wanted & existing_records(folder / "ledger" / stage))
        parts[part] = PartStatus(len(wanted), done, running[rule], failed[rule])
    made = [bool(_read(folder / "ledger/repository.json")), (folder / "report.html").is_file()]
    at_work, ended = (sum(jobs[rule] for rule in FINAL_RULES) for jobs in (running, failed))
    parts["report"] = PartStatus(
        len(made), sum(made), min(at_work, len(made) - sum(made)), min(ended, len(made) - sum(made))
    )
    return parts


def _is_at_work(folder: Path, log: Path | None) -> bool:
    """Whether a job that was started has begun: on a cluster it may wait in the queue, and then has no log yet."""
    if log is None:
        return True
    # Snakemake names the log below the working folder of the run, which need not be that of this process.
    place = folder.joinpath(*log.parts[log.parts.index("logs") :]) if "logs" in log.parts else log
    return place.is_file()


def _is_of(log: Path, holder: lease.Holder) -> bool:
    """Whether Snakemake's log is of the run that holds the lease, or held it last: it began after that was taken."""
    try:
        return log.stat().st_mtime >= time.mktime(time.strptime(holder.since, "%Y-%m-%d %H:%M:%S"))
    except (OSError, ValueError):
        return False


def _reasons(folder: Path, cases: list[str]) -> Iterator[tuple[str, tuple[str, str]]]:
    """Hearts that are not complete, with the status and the reason of the first gate that they did not pass."""
    for case in cases:
        for gate in GATES:
            try:
                content = record_path(folder, gate, case).read_bytes()
            except OSError:
                break
            if _COMPLETE not in content:
                record = _read(record_path(folder, gate, case))
                yield case, (record.get("status", "failed"), record.get("reason", "its record cannot be read"))
                break


def _read(path: Path) -> dict[str, Any]:
    try:
        return ledger.read(path)
    except (OSError, ValueError):
        return {}


def _cases(folder: Path) -> list[str]:
    """Hearts of the configuration of a repository."""
    try:
        with (folder / "cases.csv").open(encoding="utf-8", newline="") as table:
            return [row["case"] for row in csv.DictReader(table)]
    except (OSError, KeyError) as error:
        raise StatusError(f"{folder / 'cases.csv'}: cannot be read: run the configuration again") from error


def _views(folder: Path) -> list[str]:
    """Views of the configuration of a repository, without what its other keys name, such as files."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        return list(yaml.load((folder / "config.yaml").read_text(encoding="utf-8"), Loader=loader)["views"])
    except (OSError, yaml.YAMLError, KeyError, TypeError) as error:
        raise StatusError(f"{folder / 'config.yaml'}: cannot be read: run the configuration again") from error


def dumped(status: Status) -> str:
    """The status as JSON."""
    return json.dumps(status.as_json(), indent=2)
