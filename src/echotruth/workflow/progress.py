"""Progress of a run, from Snakemake's log and the time that its jobs are expected to take."""

from __future__ import annotations

import json
import re
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

DEFAULT_SECONDS = {
    "mechanics": 50.0,
    "physiology": 3.0,
    "imaging": 100.0,
    "tracking": 60.0,
    "compile": 35.0,
    "repository": 3.0,
    "report": 12.0,
    "report_images": 12.0,
    "report_page": 6.0,
}
"""Rule -> duration of its job for a heart of 40 frames, s; used where nothing else is expected."""
STAGES = {"imaging": ("phantom", "truth", "rf", "bmode"), "tracking": ("tracking", "evaluation")}
"""Rule -> stages of its job, if there are several."""
AHEAD = {"mechanics": "physiology", "imaging": "tracking"}
"""Rule -> rule whose work its jobs do as well; the jobs of that rule then only move their records."""
_COUNT = re.compile(r"^(\w+) +(\d+)$")
_RULE = re.compile(r"^ *(?:local)?rule (\w+):$")  # indented in a group of jobs on a cluster
_FAILED = re.compile(r"^ *Error in rule (\w+):$")
_JOB = re.compile(r"^ +jobid: (\d+)$")
_LOG = re.compile(r"^ +log: (\S+)")
_RESTARTED = re.compile(r"^Trying to restart job (\d+)\.")
_TIME = re.compile(r"^\[(\w{3} \w{3} +\d+ \d+:\d+:\d+ \d{4})\]$")
_FINISHED = re.compile(r"^Finished jobid: (\d+) \(Rule: (\w+)\)$")
_CORES = re.compile(r"^Provided (?:cores|jobs|remote nodes): (\d+)")

COMPILATION = "compile_mechanics"
"""Entry among the expected durations for which there is no rule: the first job of the mechanics compiles."""
EXPECTED = "expected.json"
"""File beside Snakemake's log with the duration that is expected of a job of each rule, s."""


@dataclass(frozen=True)
class RunningJob:
    """A job that was started and has not ended.

    Attributes
    ----------
    rule : str
    start : float
        Time at which it was started, s.
    log : Path or None
        Its log.
    """

    rule: str
    start: float
    log: Path | None = None

    @property
    def subject(self) -> str:
        """Case, or case and view, that it is about: the path of its log in the folder of its rule."""
        return "" if self.log is None else self.log.as_posix().rpartition(f"/{self.rule}/")[2]


class Progress:
    """Progress of a run.

    Parameters
    ----------
    expected : dict
        Rule -> expected duration of its job, s; replaces :data:`DEFAULT_SECONDS`.
    clock : callable
        Returns the time, s.
    """

    def __init__(self, expected: dict[str, float], clock: Callable[[], float] = time.monotonic) -> None:
        self._expected, self._clock = DEFAULT_SECONDS | expected, clock
        self._planned: Counter[str] = Counter()
        self._running: dict[str, RunningJob] = {}
        self._durations: dict[str, list[float]] = defaultdict(list)  # of jobs that did the work themselves
        self._done_ahead: dict[str, set[str]] = defaultdict(set)  # rule -> subjects
        self._found_done: Counter[str] = Counter()  # rule -> finished jobs whose work was done ahead
        self._cores, self._fraction_done = 1, 0.0
        self._rule, self._failed = "", False
        self._job, self._log = "", cast("Path | None", None)
        self._failures: dict[str, str] = {}  # job -> its rule
        self._failure_logs: dict[str, Path] = {}  # job -> its log

    def read_line(self, line: str) -> None:
        """Update the progress from a line of Snakemake's log."""
        if (match := _COUNT.match(line)) and match[1] in self._expected:
            self._planned[match[1]] = int(match[2])
        elif match := _CORES.match(line):
            self._cores = int(match[1])
        elif match := _RULE.match(line) or _FAILED.match(line):
            self._rule, self._failed, self._log = match[1], line.lstrip().startswith("Error"), None
        elif match := _JOB.match(line):
            self._start_or_fail(match[1])
        elif match := _LOG.match(line):
            self._set_log(Path(match[1]))
        elif match := _RESTARTED.match(line):
            self._restart(match[1])
        elif (match := _FINISHED.match(line)) and match[2] in self._expected:  # the rule `all` does no work
            job = self._running.pop(match[1], RunningJob(match[2], self._clock()))
            self._finish(job)

    def _finish(self, job: RunningJob) -> None:
        """A job was finished."""
        if job.subject in self._done_ahead[job.rule]:
            self._found_done[job.rule] += 1
            return
        # Compilation is not part of what the next job of the rule will take.
        usual = self._usual_seconds(job.rule)
        share = usual / (usual + self._compilation(job.rule)) if usual else 1.0
        self._durations[job.rule].append(share * (self._clock() - job.start))
        if job.log and job.rule in AHEAD:
            self._done_ahead[AHEAD[job.rule]].add(job.subject)

    def _start_or_fail(self, job: str) -> None:
        """A job was started, or failed: its number follows the name of its rule."""
        self._job = job
        if self._failed:
            running = self._running.pop(job, None)
            rule = running.rule if running else self._rule
            if job not in self._failures:
                self._failures[job] = rule
                self._planned[rule] -= 1
        elif self._rule in self._planned:
            self._running[job] = RunningJob(self._rule, self._clock(), self._log)

    def _set_log(self, log: Path) -> None:
        """The log of a job stands before the number of one that was started, and after that of one that failed."""
        if self._failed:
            self._failure_logs[self._job] = log
        else:
            self._log = log

    def _restart(self, job: str) -> None:
        """A job that failed is tried again."""
        if rule := self._failures.pop(job, None):
            self._failure_logs.pop(job, None)
            self._planned[rule] += 1

    @property
    def logs(self) -> list[Path]:
        """Logs of the jobs that failed."""
        return list(self._failure_logs.values())

    @property
    def failed_jobs(self) -> Counter[str]:
        """Rule -> number of its jobs that failed and were not started again."""
        return Counter(self._failures.values())

    @property
    def running_jobs(self) -> list[RunningJob]:
        """Jobs that were started and have not ended; on a cluster some of them may still be in its queue."""
        return list(self._running.values())

    @property
    def is_planned(self) -> bool:
        """Whether Snakemake has said which jobs it will run."""
        return bool(self._planned)

    @property
    def fraction_done(self) -> float:
        """Fraction of the work that is done; it never decreases."""
        done = sum(map(sum, self._durations.values())) + sum(self._elapsed(rule) for rule in self._planned)
        left = sum(self._remaining_work(rule) for rule in self._planned)
        fraction = done / (done + left) if left else 1.0 if self._planned else 0.0
        self._fraction_done = max(self._fraction_done, fraction)
        return self._fraction_done

    @property
    def seconds_left(self) -> float:
        """Time to the end, s, if the rules run one after the other, each on as many cores as it has jobs."""
        return sum(
            self._remaining_work(rule) / max(1, min(self._cores, self._unfinished(rule))) for rule in self._planned
        )

    @property
    def running(self) -> str:
        """Running rules, such as `imaging (2 of 4)`."""
        running = {job.rule for job in self._running.values()}
        rules = [rule for rule in self._planned if rule in running]
        shown = [rule for rule in rules if rule != "compile"] or rules
        texts = (f"{rule} ({self._job_number(rule)} of {self._planned[rule]})" for rule in shown)
        return ", ".join(texts).replace("_", " ") or "starting"

    def _job_number(self, rule: str) -> int:
        return min(self._planned[rule], self._finished(rule) + 1)

    def _finished(self, rule: str) -> int:
        return len(self._durations[rule]) + self._found_done[rule]

    def _unfinished(self, rule: str) -> int:
        return self._planned[rule] - self._finished(rule)

    def _planned_ahead(self, rule: str) -> int:
        """Number of jobs of a rule whose work is done by jobs of another."""
        return sum(min(self._planned[first], self._planned[later]) for first, later in AHEAD.items() if later == rule)

    def _elapsed(self, rule: str) -> float:
        return sum(self._clock() - job.start for job in self._running.values() if job.rule == rule)

    def _expected_seconds(self, rule: str) -> float:
        """Mean duration of a job in this run, s; without one, the expected one scaled to the speed of this run."""
        durations = self._durations[rule]
        return sum(durations) / len(durations) if durations else self._usual_seconds(rule) * self._slowdown

    def _usual_seconds(self, rule: str) -> float:
        """Expected duration of a job that does its work itself, s, with the work that it does ahead."""
        later = AHEAD.get(rule, "")
        return self._expected[rule] + (self._expected[later] if self._planned_ahead(later) else 0.0)

    @property
    def _slowdown(self) -> float:
        """Measured over expected duration of the finished jobs; what there is to compile tells nothing of others."""
        finished = {rule: durations for rule, durations in self._durations.items() if rule != "compile"}
        expected = sum(self._usual_seconds(rule) * len(durations) for rule, durations in finished.items())
        return sum(map(sum, finished.values())) / expected if expected else 1.0

    def _remaining_work(self, rule: str) -> float:
        """Remaining work of the unfinished jobs of a rule, s; each running job has at least 1/20 of its work left."""
        expected = self._expected_seconds(rule)
        starts = [
            job.start
            for job in self._running.values()
            if job.rule == rule and job.subject not in self._done_ahead[rule]
        ]
        waiting = self._planned[rule] - self._planned_ahead(rule) - len(self._durations[rule]) - len(starts)
        running = sum(max(expected - (self._clock() - start), expected / 20) for start in starts)
        compilation = self._compilation(rule) if self._unfinished(rule) > 0 else 0.0
        return running + compilation + max(0, waiting) * expected

    def _compilation(self, rule: str) -> float:
        """Time for which the first job of the mechanics compiles, s; the others load what it made."""
        return self._expected.get(COMPILATION, 0.0) if rule == "mechanics" and not self._durations[rule] else 0.0


def format_duration(seconds: float) -> str:
    """Rounded duration, such as `2 min`."""
    if seconds < 50:
        return f"{max(10, 10 * round(seconds / 10))} s"
    if seconds < 5400:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h" if seconds < 100 * 3600 else f"{seconds / 86_400:.1f} days"


class _LogTime:
    """Clock that stands at the time of what was read last, and runs from the present once all of it was read."""

    def __init__(self) -> None:
        self.read: float | None = 0.0

    def __call__(self) -> float:
        return time.time() if self.read is None else self.read


def replay(log: Path, expected: dict[str, float], runs: bool) -> Progress:
    """Progress of a run from the log that Snakemake has written so far.

    Parameters
    ----------
    log : Path
        Output of Snakemake; it need not exist.
    expected : dict
        Rule -> expected duration of its job, s.
    runs : bool
        Whether it goes on. Else no time passes after the last line.
    """
    clock = _LogTime()
    progress = Progress(expected, clock)
    if log.is_file():
        with log.open(encoding="utf-8", errors="replace") as lines:
            for line in lines:
                if match := _TIME.match(line):
                    clock.read = time.mktime(time.strptime(match[1], "%a %b %d %H:%M:%S %Y"))
                else:
                    progress.read_line(line.rstrip("\n"))
    if runs:
        clock.read = None
    return progress


def expected_durations(folder: Path) -> dict[str, float]:
    """Rule -> duration that the last run expected of its job, s, as it wrote it beside its log; empty without one.

    Parameters
    ----------
    folder : Path
        Folder of the logs.
    """
    try:
        found = json.loads((folder / EXPECTED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return {rule: float(seconds) for rule, seconds in found.items()} if isinstance(found, dict) else {}


def write_expected(folder: Path, expected: dict[str, float]) -> None:
    """Write the durations that a run expects beside its log, for whoever asks how it is going.

    Parameters
    ----------
    folder : Path
        Folder of the logs.
    expected : dict
        Rule -> duration of its job, s.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / EXPECTED).write_text(json.dumps({rule: round(seconds, 1) for rule, seconds in expected.items()}))
