"""Progress of a run, by what its Snakemake says of its steps."""

import re
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from echotruth.workflow.cost import duration

_COUNT = re.compile(r"^(\w+) +(\d+)$")
_RULE = re.compile(r"^ *(?:local|(Error in ))?rule (\w+):$")  # indented in a group of jobs on a cluster
_JOB = re.compile(r"^ +jobid: (\d+)$")
_LOG = re.compile(r"^ +log: (\S+)")
_FINISHED = re.compile(r"^Finished jobid: (\d+) \(Rule: (\w+)\)$")
_RESTARTED = re.compile(r"^Trying to restart job (\d+)\.")


@dataclass
class Step:
    """A job that was started: its rule, and its log."""

    rule: str
    log: Path | None = None


@dataclass
class Progress:
    """Progress of a run.

    Attributes
    ----------
    seconds : mapping
        Rule -> expected CPU time of one of its jobs, s.
    clock : callable
        Returns the time, s.
    planned, ended : Counter
        Rule -> number of its jobs, and of those that have ended well.
    running, failed : dict
        Number of a job -> the job, of those that have not ended, and of those that ended with an error.
    """

    seconds: Mapping[str, float]
    clock: Callable[[], float] = time.monotonic
    planned: Counter[str] = field(default_factory=Counter)
    ended: Counter[str] = field(default_factory=Counter)
    running: dict[str, Step] = field(default_factory=dict)
    failed: dict[str, Step] = field(default_factory=dict)
    _step: Step = field(default_factory=lambda: Step(""))
    _is_error: bool = False
    _start: float | None = None

    def read_line(self, line: str) -> None:
        """Take notice of one line of Snakemake's output."""
        if (match := _COUNT.match(line)) and match[1] != "total":
            self.planned[match[1]] += int(match[2])
        elif match := _RULE.match(line):
            self._step, self._is_error = Step(match[2]), bool(match[1])
        elif match := _LOG.match(line):
            self._step.log = Path(match[1])
        elif match := _JOB.match(line):
            self._start = self.clock() if self._start is None else self._start
            self.running.pop(match[1], None)
            (self.failed if self._is_error else self.running)[match[1]] = self._step
        elif match := _FINISHED.match(line):
            self.running.pop(match[1], None)
            self.ended[match[2]] += 1
        elif match := _RESTARTED.match(line):
            self.failed.pop(match[1], None)

    @property
    def share(self) -> float:
        """Share of the expected CPU time that is spent."""
        total = sum(number * self.seconds.get(rule, 0.0) for rule, number in self.planned.items())
        done = sum(number * self.seconds.get(rule, 0.0) for rule, number in self.ended.items())
        return done / total if total else 0.0

    @property
    def text(self) -> str:
        """What is done, what runs and the time left, in one line; empty before anything is planned."""
        steps, done = (sum(jobs.values()) - jobs["all"] for jobs in (self.planned, self.ended))
        if not steps:
            return ""
        at_work = Counter(step.rule for step in self.running.values())
        activity = ", ".join(f"{rule} x {number}" if number > 1 else rule for rule, number in at_work.items())
        words = [f"{done} of {steps} jobs, {100 * self.share:.0f} %"]
        words += [activity or "starting"] if done < steps else []
        words += [f"{len(self.failed)} failed"] if self.failed else []
        if self.share > 0 and self._start is not None:
            left = (self.clock() - self._start) * (1 / self.share - 1)
            words += [f"about {duration(left)} left"] if left else []
        return ", ".join(words)
