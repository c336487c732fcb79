"""How a repository is getting on: what of it is made, what runs, what failed and why, and how long it will take.

Everything is read from its folder, so that it does not matter on which machine the run is, or whether there is one.
"""

import csv
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from echotruth.config import Config, shipped
from echotruth.config.loading import ConfigError, load
from echotruth.repository import ledger
from echotruth.repository.case_file import read_case
from echotruth.repository.ledger import NOT_A_REPOSITORY, record_path
from echotruth.repository.verdict import Verdict, verdict
from echotruth.workflow import cost, lease
from echotruth.workflow.jobs import ended, jobs, rules
from echotruth.workflow.progress import Progress, RunLog, format_duration

Status = dict[str, Any]
"""What JSON can hold:

repository : str
state : str, a key of :data:`STATES`
hearts : int
verdicts : dict, number of hearts that are complete, implausible or failed; the others are not known yet
parts : dict, rule -> number of its jobs, and of those that are done, running, failed and waiting; `failed` are those
    that ended with an error in the last run, not hearts without a solution, which are results
reasons : dict, heart that is not complete -> its status and the reason
run : str, process that works on it or did last; None if none did
activity : str, what runs, such as `rf (2 of 4)`; None if nothing does
share, seconds_left : float, share of the work of this run that is done, and the time it will still take, s; or None
failed_logs : list of str, logs of the jobs that ended with an error in the last run
"""
VERDICTS = ("complete", "implausible", "failed")
COLUMNS = ("jobs", "done", "running", "failed", "waiting")
MAX_SHOWN = 10
"""Largest number of hearts that are named with their reasons, and of logs."""
STATES = {
    "never begun": "has not been begun",
    "running": "running ({run})",
    "killed": "is not finished; its run ended without finishing ({run}): run the configuration again",
    "stopped": "is not finished, and no run works on it: run the configuration again",
    "finished": "is finished",
}
"""State of a repository -> what is said of it."""


class StatusError(ValueError):
    """Raised if a folder is no repository."""


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
    configuration, table = folder / "config.yaml", folder / "cases.csv"
    if not configuration.is_file() and lease.current(folder)[0] is None:
        raise StatusError(f"{folder}: {NOT_A_REPOSITORY}")
    try:
        rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines())) if table.is_file() else []
        config = load(configuration) if configuration.is_file() else Config()
        return status_before(config, [row["case"] for row in rows], folder)
    except (ConfigError, OSError, UnicodeDecodeError, KeyError) as error:
        raise StatusError(f"{folder}: config.yaml or cases.csv cannot be read: run the configuration again") from error


def status_before(config: Config, cases: Iterable[str], folder: Path) -> Status:
    """Status of a repository that may not have been begun, given its configuration.

    Parameters
    ----------
    config : Config
    cases : iterable of str
        Its hearts; none if they are not known yet.
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    """
    cases = list(cases)
    holder, lives = lease.current(folder)
    progress = _progress(folder, config, cases, holder)
    known = {case: found for case in cases if (found := verdict_of(folder, case))}
    numbers = Counter(status for status, _ in known.values())
    parts = _parts(folder, config, cases, progress, lives)
    runs = lives and progress.is_planned
    return {
        "repository": str(folder),
        "state": _state(parts, holder, lives),
        "hearts": len(cases),
        "verdicts": {status: numbers[status] for status in VERDICTS},
        "parts": parts,
        "reasons": {
            case: {"status": status, "reason": reason}
            for case, (status, reason) in known.items()
            if status != "complete"
        },
        "run": None if holder is None else str(holder),
        "activity": (progress.activity if runs else "planning") if lives else None,
        "share": round(progress.share, 4) if runs else None,
        "seconds_left": round(progress.seconds_left) if runs else None,
        "failed_logs": [str(job.log) for job in progress.failed if job.log],
    }


def verdict_of(folder: Path, case: str) -> Verdict | None:
    """Status of a heart and its reason, empty if it is complete; None while it is not known.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    case : str
        Its bounds are its own: species that are swept have others.
    """
    path = record_path(folder, "mechanics", case)
    if not path.is_file():
        return None
    try:
        return verdict(ledger.read(path), read_case(folder, case).config.physiology)
    except (OSError, ValueError, KeyError):
        return Verdict("failed", "its record cannot be read")


def _progress(folder: Path, config: Config, cases: list[str], holder: lease.Holder | None) -> Progress:
    """Progress of the run that holds the lease, or held it last, as far as its logs tell."""
    speed = cost.speed(folder, dict.fromkeys(cases, config))
    progress = Progress({rule: cost.mean_seconds(rule, [config]) * speed.get(rule, 1.0) for rule in rules(config)})
    for log in sorted((folder / "logs").glob("snakemake*.log")):
        # One that was not written since the lease was taken is of an earlier run.
        if holder and log.stat().st_mtime >= time.mktime(time.strptime(holder.since, "%Y-%m-%d %H:%M:%S")):
            progress.logs.append(RunLog())
            for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
                progress.logs[-1].read_line(line)
    return progress


def _parts(
    folder: Path, config: Config, cases: list[str], progress: Progress, lives: bool
) -> dict[str, dict[str, int]]:
    running = Counter(job.rule for job in progress.running if lives)
    failed = Counter(job.rule for job in progress.failed)
    parts = {}
    has_report = not shipped.is_sample(folder)  # its page is not shipped
    for rule in [rule for rule in rules(config) if rule != "report" or has_report] if cases else ():
        wanted = jobs(rule, config, cases)
        numbers = len(wanted), len(wanted & ended(folder, rule, config)), running[rule], failed[rule]
        parts[rule] = dict(zip(COLUMNS, (*numbers, max(0, numbers[0] - sum(numbers[1:]))), strict=True))
    return parts


def _state(parts: dict[str, dict[str, int]], holder: lease.Holder | None, lives: bool) -> str:
    if lives:
        return "running"
    if parts and all(part["done"] == part["jobs"] for part in parts.values()):
        return "finished"
    if holder is None:
        return "stopped" if any(part["done"] for part in parts.values()) else "never begun"
    return "stopped" if holder.released else "killed"


def text(status: Status) -> str:
    """The status, a line for each rule, then the hearts, then what failed."""
    words = [STATES[status["state"]].format(**status)]
    words += [f"{100 * status['share']:.0f} % of this run done"] if status["share"] is not None else []
    words += [status["activity"]] if status["activity"] else []
    words += [f"about {format_duration(status['seconds_left'])} left"] if status["seconds_left"] else []
    lines = [f"{status['repository']}: {', '.join(words)}"]
    if status["parts"]:
        lines += ["", f"{'':13}" + "".join(f"{column:>10}" for column in COLUMNS[1:])]
    for rule, part in status["parts"].items():
        numbers = "".join(f"{part[column] or '-':>10}" for column in COLUMNS[2:])
        done = f"{part['done']}/{part['jobs']}"
        lines.append(f"{rule:13}{done:>10}{numbers}")
    lines += verdicts(status)
    if status["failed_logs"]:
        lines += ["", "Logs of jobs that ended with an error:", *_first(status["failed_logs"])]
    return "\n".join(lines)


def verdicts(status: Status) -> list[str]:
    """Number of hearts by verdict, and the reasons of those that are not complete."""
    if not status["hearts"]:
        return []
    numbers = status["verdicts"] | {"not known yet": status["hearts"] - sum(status["verdicts"].values())}
    counts = [f"{number} {verdict}" for verdict, number in numbers.items() if number or verdict in VERDICTS]
    reasons = [f"{case}: {found['status']}: {found['reason']}" for case, found in status["reasons"].items()]
    return ["", f"Hearts by their motion: {', '.join(counts)}", *_first(reasons)]


def _first(texts: list[str]) -> list[str]:
    """The first lines, and how many more there are."""
    more = [f"  and {len(texts) - MAX_SHOWN} more"] if len(texts) > MAX_SHOWN else []
    return [*(f"  {text}" for text in texts[:MAX_SHOWN]), *more]
