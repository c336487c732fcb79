"""Progress of a run, from the logs of its Snakemakes and the time that jobs are expected to take."""

import re
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

_COUNT = re.compile(r"^(\w+) +(\d+)$")
_RULE = re.compile(r"^ *(?:local|(Error in ))?rule (\w+):$")  # indented in a group of jobs on a cluster
_JOB = re.compile(r"^ +jobid: (\d+)$")
_LOG = re.compile(r"^ +log: (\S+)")
_RESTARTED = re.compile(r"^Trying to restart job (\d+)\.")
_TIME = re.compile(r"^ *\[(\w{3} \w{3} +\d+ \d+:\d+:\d+ \d{4})\]$")
_FINISHED = re.compile(r"^Finished jobid: (\d+) \(Rule: (\w+)\)$")
_CORES = re.compile(r"^Provided (?:cores|jobs|remote nodes): (\d+)")


@dataclass
class StartedJob:
    """A job that was started: its rule, the time, s, and its log."""

    rule: str
    start: float
    log: Path | None = None


class RunLog:
    """What the log of one Snakemake tells.

    Attributes
    ----------
    planned, ended, spent : Counter
        Rule -> number of its jobs, of those that have ended well, and the sum of the durations of these, s.
    running, failed : dict
        Number of a job -> the job, of those that have not ended, and of those that ended with an error.
    cores : int
    """

    def __init__(self) -> None:
        self.planned, self.ended, self.spent = Counter[str](), Counter[str](), Counter[str]()
        self.running: dict[str, StartedJob] = {}
        self.failed: dict[str, StartedJob] = {}
        self.cores = 1
        self._now, self._job, self._group = 0.0, StartedJob("", 0.0), self.running

    def read_line(self, line: str) -> None:
        """Take notice of one line."""
        if match := _TIME.match(line):
            self._now = time.mktime(time.strptime(match[1], "%a %b %d %H:%M:%S %Y"))
        elif match := _COUNT.match(line):
            self.planned[match[1]] += int(match[2])
        elif match := _CORES.match(line):
            self.cores = int(match[1])
        else:
            self._read_job(line)

    def _read_job(self, line: str) -> None:
        if match := _RULE.match(line):
            self._job, self._group = StartedJob(match[2], self._now), self.failed if match[1] else self.running
        elif match := _LOG.match(line):
            self._job.log = Path(match[1])
        elif match := _JOB.match(line):
            self.running.pop(match[1], None)
            self._group[match[1]] = self._job
        elif match := _RESTARTED.match(line):
            self.failed.pop(match[1], None)
        elif match := _FINISHED.match(line):
            job = self.running.pop(match[1], StartedJob(match[2], self._now))
            self.ended[job.rule] += 1
            self.spent[job.rule] += round(self._now - job.start)


class Progress:
    """Progress of a run, which may be several Snakemakes, one after the other or side by side.

    Parameters
    ----------
    expected : mapping
        Rule -> expected duration of one of its jobs, s; other rules do not count.
    jobs : mapping, optional
        Rule -> number of its jobs in all Snakemakes, if not all have said yet what they plan.
    clock : callable, optional
        Returns the time, s.

    Attributes
    ----------
    logs : list of RunLog
        One for each Snakemake that was started.
    """

    def __init__(
        self, expected: Mapping[str, float], jobs: Mapping[str, int] | None = None, clock: Callable = time.time
    ) -> None:
        self.logs: list[RunLog] = []
        self._expected, self._jobs, self._clock = expected, jobs or {}, clock
        self._share, self._cores = 0.0, 1

    @property
    def is_planned(self) -> bool:
        """Whether a Snakemake has said which jobs it will run."""
        return any(log.planned for log in self.logs)

    @property
    def running(self) -> list[StartedJob]:
        """Jobs that were started and have not ended; on a cluster some of them may still be in its queue."""
        return [job for log in self.logs for job in log.running.values() if job.rule in self._expected]

    @property
    def failed(self) -> list[StartedJob]:
        """Jobs that ended with an error and were not started again."""
        return [job for log in self.logs for job in log.failed.values()]

    @property
    def share(self) -> float:
        """Share of the expected work that is done; it never decreases."""
        total = sum(self._number(rule) * seconds for rule, seconds in self._expected.items())
        left = sum(self._left(rule) * seconds for rule, seconds in self._expected.items())
        self._share = max(self._share, 1 - left / total if total else 0.0)
        return self._share

    @property
    def seconds_left(self) -> float:
        """Time to the end, s, if the rules run one after the other, each on as many cores as it has jobs."""
        self._cores = max(self._cores, sum(log.cores for log in self.logs if log.running))
        done = sum(seconds * self._sum("ended", rule) for rule, seconds in self._expected.items())
        pace = sum(self._sum("spent", rule) for rule in self._expected) / done if done else 1.0
        cores = {rule: max(1, min(self._cores, self._waiting(rule))) for rule in self._expected}
        return pace * sum(self._left(rule) * seconds / cores[rule] for rule, seconds in self._expected.items())

    @property
    def activity(self) -> str:
        """Rules that run, such as `rf (2 of 4)`."""
        at_work = {job.rule for job in self.running}
        places = {rule: (self._sum("ended", rule) + 1, self._number(rule)) for rule in self._expected}
        texts = (f"{rule} ({min(number)} of {number[1]})" for rule, number in places.items() if rule in at_work)
        return ", ".join(texts) or "starting"

    def _sum(self, name: str, rule: str) -> int:
        """Sum over the logs of one of their counts of a rule."""
        return sum(getattr(log, name)[rule] for log in self.logs)

    def _number(self, rule: str) -> int:
        """Jobs of a rule, without those that failed."""
        planned = max(self._jobs.get(rule, 0), self._sum("planned", rule))
        return max(0, planned - sum(job.rule == rule for job in self.failed))

    def _waiting(self, rule: str) -> int:
        """Jobs of a rule that have not ended."""
        return max(0, self._number(rule) - self._sum("ended", rule))

    def _left(self, rule: str) -> float:
        """Jobs of a rule that are left; each that runs counts with what it has left, a twentieth at least."""
        usual = self._expected[rule]
        begun = [min((self._clock() - job.start) / usual, 0.95) for job in self.running if job.rule == rule and usual]
        return max(0.0, self._waiting(rule) - sum(begun))


def format_duration(seconds: float) -> str:
    """Rounded duration, such as `2 min`."""
    if seconds < 50:
        return f"{max(10, 10 * round(seconds / 10))} s"
    if seconds < 5400:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h" if seconds < 100 * 3600 else f"{seconds / 86_400:.1f} days"
