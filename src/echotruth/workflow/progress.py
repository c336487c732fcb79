"""How far a run is, by what Snakemake says of its jobs and by what such jobs have taken before."""

from __future__ import annotations

import json
import re
import time
from collections import Counter, defaultdict
from pathlib import Path

SECONDS = {
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
"""Rule to the seconds that its job takes of a heart of 40 frames, until one has been timed."""
STAGES = {"imaging": ("phantom", "truth", "rf", "bmode"), "tracking": ("tracking", "evaluation")}
"""Rule to the stages that its job does, where these are several."""
TIMED = 20
"""Records that are read to know what the job of a stage takes."""

_COUNT = re.compile(r"^(\w+) +(\d+)$")
_RULE = re.compile(r"^(?:local)?rule (\w+):$")
_FAILED = re.compile(r"^Error in rule (\w+):$")
_JOB = re.compile(r"^ +jobid: (\d+)$")
_LOG = re.compile(r"^ +log: (\S+)")
_FINISHED = re.compile(r"^Finished jobid: (\d+) \(Rule: (\w+)\)$")
_CORES = re.compile(r"^Provided (?:cores|jobs): (\d+)")


def measured(ledger: Path) -> dict[str, float]:
    """Rule to the seconds that its jobs took, as the records of a repository tell.

    Parameters
    ----------
    ledger : Path
        Folder of the records; it need not be there.

    Returns
    -------
    dict
        Rules of which a stage has no record yet are left out.
    """
    found = {}
    for rule in SECONDS:
        means = [_mean(ledger / stage) for stage in STAGES.get(rule, (rule,))]
        if all(means):
            found[rule] = sum(means)
    return found


def _mean(stage: Path) -> float:
    """Mean of the seconds of a stage, starting included; 0 where none was timed."""
    paths = list(stage.glob("**/[!.]*.json"))[:TIMED]
    records = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    times = [record["seconds"] + record["start_seconds"] for record in records if "start_seconds" in record]
    return sum(times) / len(times) if times else 0.0


class Progress:
    """State of a run.

    Parameters
    ----------
    weights : dict
        Rule to the seconds that its job may take.
    clock : callable
        Seconds.

    Attributes
    ----------
    logs : list of Path
        Of the jobs that failed.
    """

    def __init__(self, weights: dict[str, float], clock=time.monotonic) -> None:
        self._weights, self._clock = SECONDS | weights, clock
        self._planned: Counter[str] = Counter()
        self._running: dict[str, tuple[str, float]] = {}
        self._took: dict[str, list[float]] = defaultdict(list)
        self._cores, self._share = 1, 0.0
        self._rule, self._failed = "", False
        self.logs: list[Path] = []

    def hear(self, line: str) -> None:
        """Take in a line of Snakemake's log."""
        if (found := _COUNT.match(line)) and found[1] in self._weights:
            self._planned[found[1]] = int(found[2])
        elif found := _CORES.match(line):
            self._cores = int(found[1])
        elif found := _RULE.match(line) or _FAILED.match(line):
            self._rule, self._failed = found[1], line.startswith("Error")
        elif found := _JOB.match(line):
            self._begin_or_fail(found[1])
        elif (found := _LOG.match(line)) and self._failed:
            self.logs.append(Path(found[1]))
        elif found := _FINISHED.match(line):
            rule, begun = self._running.pop(found[1], (found[2], self._clock()))
            self._took[rule].append(self._clock() - begun)

    def _begin_or_fail(self, job: str) -> None:
        if self._failed:
            rule, _ = self._running.pop(job, (self._rule, 0.0))
            self._planned[rule] -= 1
        elif self._rule in self._planned:
            self._running[job] = (self._rule, self._clock())

    @property
    def share(self) -> float:
        """Share of the work that is done, from 0 to 1; it never falls."""
        done = sum(map(sum, self._took.values())) + sum(self._elapsed(rule) for rule in self._planned)
        left = sum(self._remaining(rule) for rule in self._planned)
        self._share = max(self._share, done / (done + left) if left else 1.0 if self._planned else 0.0)
        return self._share

    @property
    def left(self) -> float:
        """Seconds until the end: stage after stage, each on as many cores as it has jobs for."""
        waits = (self._remaining(rule) / max(1, min(self._cores, self._open(rule))) for rule in self._planned)
        return sum(waits)

    @property
    def stage(self) -> str:
        """What is being done, as `imaging (2 of 4)`."""
        rules = [rule for rule in self._planned if rule in {name for name, _ in self._running.values()}]
        named = [rule for rule in rules if not rule.startswith("compile")] or rules
        told = (f"{rule} ({self._at(rule)} of {self._planned[rule]})" for rule in named)
        return ", ".join(told).replace("_", " ") or "starting"

    def _at(self, rule: str) -> int:
        return min(self._planned[rule], len(self._took[rule]) + 1)

    def _open(self, rule: str) -> int:
        return self._planned[rule] - len(self._took[rule])

    def _elapsed(self, rule: str) -> float:
        return sum(self._clock() - begun for name, begun in self._running.values() if name == rule)

    def _expected(self, rule: str) -> float:
        """Seconds of a job: as timed in this run, or as weighed, at the pace of this run."""
        took = self._took[rule]
        return sum(took) / len(took) if took else self._weights[rule] * self._pace

    @property
    def _pace(self) -> float:
        weighed = sum(self._weights[rule] * len(took) for rule, took in self._took.items())
        return sum(map(sum, self._took.values())) / weighed if weighed else 1.0

    def _remaining(self, rule: str) -> float:
        """Seconds of work of the jobs of a rule that have not ended; none has less than a twentieth of its own."""
        expected = self._expected(rule)
        begun = [begun for name, begun in self._running.values() if name == rule]
        running = sum(max(expected - (self._clock() - each), expected / 20) for each in begun)
        return running + max(0, self._open(rule) - len(begun)) * expected


def words(seconds: float) -> str:
    """A time in words, as `2 min`."""
    if seconds < 50:
        return f"{max(10, 10 * round(seconds / 10))} s"
    return f"{round(seconds / 60)} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
