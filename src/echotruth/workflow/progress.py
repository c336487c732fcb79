"""Progress of a run, from Snakemake's log and the durations of earlier jobs."""

from __future__ import annotations

import json
import re
import time
from collections import Counter, defaultdict
from pathlib import Path

DEFAULT_SECONDS = {
    "mechanics": 50.0,
    "physiology": 3.0,
    "imaging": 100.0,
    "tracking": 60.0,
    "compile_imaging": 45.0,
    "compile_tracking": 40.0,
    "repository": 3.0,
    "report": 12.0,
    "report_images": 12.0,
}
"""Rule -> duration of its job for a heart of 40 frames, s; used until one has been measured."""
STAGES = {"imaging": ("phantom", "truth", "rf", "bmode"), "tracking": ("tracking", "evaluation")}
"""Rule -> stages of its job, if there are several."""
AHEAD = {"mechanics": "physiology", "imaging": "tracking"}
"""Rule -> rule whose work its jobs do as well; the jobs of that rule then only move their records."""
MAX_RECORDS = 20
"""Largest number of records from which the mean duration of a stage is taken."""

_COUNT = re.compile(r"^(\w+) +(\d+)$")
_RULE = re.compile(r"^ *(?:local)?rule (\w+):$")  # indented in a group of jobs on a cluster
_FAILED = re.compile(r"^ *Error in rule (\w+):$")
_JOB = re.compile(r"^ +jobid: (\d+)$")
_LOG = re.compile(r"^ +log: (\S+)")
_FINISHED = re.compile(r"^Finished jobid: (\d+) \(Rule: (\w+)\)$")
_CORES = re.compile(r"^Provided (?:cores|jobs|remote nodes): (\d+)")


def measured_seconds(ledger: Path) -> dict[str, float]:
    """Mean duration of the jobs of each rule, from the records of a repository.

    Parameters
    ----------
    ledger : Path
        Folder of the records; it need not exist.

    Returns
    -------
    dict
        Rule -> duration, s, for rules with records of all their stages.
    """
    durations = {}
    for rule in DEFAULT_SECONDS:
        means = [_mean_seconds(ledger / stage) for stage in STAGES.get(rule, (rule,))]
        if all(means):
            durations[rule] = sum(means)
    return durations


def _mean_seconds(stage: Path) -> float:
    """Mean duration of a stage including its start, s; 0 without records."""
    paths = list(stage.glob("**/[!.]*.json"))[:MAX_RECORDS]
    records = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    times = [record["seconds"] + record["start_seconds"] for record in records if "start_seconds" in record]
    return sum(times) / len(times) if times else 0.0


class Progress:
    """Progress of a run.

    Parameters
    ----------
    expected : dict
        Rule -> expected duration of its job, s; replaces :data:`DEFAULT_SECONDS`.
    clock : callable
        Returns the time, s.

    Attributes
    ----------
    logs : list of Path
        Logs of the jobs that failed.
    """

    def __init__(self, expected: dict[str, float], clock=time.monotonic) -> None:
        self._expected, self._clock = DEFAULT_SECONDS | expected, clock
        self._planned: Counter[str] = Counter()
        self._running: dict[str, tuple[str, float]] = {}  # job -> its rule and start time, s
        self._durations: dict[str, list[float]] = defaultdict(list)
        self._cores, self._fraction_done = 1, 0.0
        self._rule, self._failed = "", False
        self.logs: list[Path] = []

    def read_line(self, line: str) -> None:
        """Update the progress from a line of Snakemake's log."""
        if (match := _COUNT.match(line)) and match[1] in self._expected:
            self._planned[match[1]] = int(match[2])
        elif match := _CORES.match(line):
            self._cores = int(match[1])
        elif match := _RULE.match(line) or _FAILED.match(line):
            self._rule, self._failed = match[1], line.startswith("Error")
        elif match := _JOB.match(line):
            self._start_or_fail(match[1])
        elif (match := _LOG.match(line)) and self._failed:
            self.logs.append(Path(match[1]))
        elif match := _FINISHED.match(line):
            rule, start = self._running.pop(match[1], (match[2], self._clock()))
            self._durations[rule].append(self._clock() - start)

    def _start_or_fail(self, job: str) -> None:
        if self._failed:
            rule, _ = self._running.pop(job, (self._rule, 0.0))
            self._planned[rule] -= 1
        elif self._rule in self._planned:
            self._running[job] = (self._rule, self._clock())

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
        running = {rule for rule, _ in self._running.values()}
        rules = [rule for rule in self._planned if rule in running]
        shown = [rule for rule in rules if not rule.startswith("compile")] or rules
        texts = (f"{rule} ({self._job_number(rule)} of {self._planned[rule]})" for rule in shown)
        return ", ".join(texts).replace("_", " ") or "starting"

    def _job_number(self, rule: str) -> int:
        return min(self._planned[rule], len(self._durations[rule]) + 1)

    def _unfinished(self, rule: str) -> int:
        return self._planned[rule] - len(self._durations[rule])

    def _elapsed(self, rule: str) -> float:
        return sum(self._clock() - start for name, start in self._running.values() if name == rule)

    def _expected_seconds(self, rule: str) -> float:
        """Mean duration of a job in this run, s; without one, the expected one scaled to the speed of this run."""
        durations = self._durations[rule]
        return sum(durations) / len(durations) if durations else self._usual_seconds(rule) * self._slowdown

    def _usual_seconds(self, rule: str) -> float:
        """Expected duration of a job, s, with the work that it does ahead, and without that which was done ahead."""
        seconds = self._expected[rule]
        for first, later in AHEAD.items():
            both = min(self._planned[first], self._planned[later])
            if rule == first and both:
                seconds += self._expected[later]
            elif rule == later and both:
                seconds *= 1 - both / self._planned[later]
        return seconds

    @property
    def _slowdown(self) -> float:
        """Measured over expected duration of the finished jobs."""
        expected = sum(self._usual_seconds(rule) * len(durations) for rule, durations in self._durations.items())
        return sum(map(sum, self._durations.values())) / expected if expected else 1.0

    def _remaining_work(self, rule: str) -> float:
        """Remaining work of the unfinished jobs of a rule, s; each running job has at least 1/20 of its work left."""
        expected = self._expected_seconds(rule)
        starts = [start for name, start in self._running.values() if name == rule]
        running = sum(max(expected - (self._clock() - start), expected / 20) for start in starts)
        return running + max(0, self._unfinished(rule) - len(starts)) * expected


def format_duration(seconds: float) -> str:
    """Rounded duration, such as `2 min`."""
    if seconds < 50:
        return f"{max(10, 10 * round(seconds / 10))} s"
    return f"{round(seconds / 60)} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
