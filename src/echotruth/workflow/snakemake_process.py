"""Snakemakes as processes: their output goes to logs, their progress to one line, and all jobs end with them."""

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import TextIO

import psutil

from echotruth.config import shipped
from echotruth.workflow.progress import Progress, RunLog, format_duration

POLL_SECONDS = 0.5
"""Interval at which the log is read."""
LINE_SECONDS = 30.0
"""Interval between progress lines on a stream that is not a terminal."""
TERMINATION_SECONDS = 10.0
"""Time that jobs have to end after SIGTERM, before they are killed."""
PLANNING_SECONDS = 10.0
"""Time of planning after which the progress line says so."""
LOG_LINES = 15
"""Number of lines shown of the log of a failed job."""
MAX_LOGS = 3
"""Largest number of logs shown."""


def snakemake_command(path: Path | str, options: list[str]) -> list[str]:
    """Command that runs the workflow of a configuration file, with options, and rules and files to make after them.

    Snakemake's own lock is that of the working folder, where other names may run; a repository has its lease.
    """
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(shipped.ROOT / "Snakefile")]
    # Not at the end: --configfile takes all that follows, files to make too.
    return [*command, "--configfile", str(path), "--nolock", *options]


class Snakemake:
    """A Snakemake, whose words go to a file and to a progress.

    Parameters
    ----------
    command : list of str
    log : Path
        File for its output.
    """

    def __init__(self, command: list[str], log: Path) -> None:
        self._command, self._log, self._incomplete = command, log, ""
        self.told = RunLog()

    def start(self, environment: dict[str, str] | None) -> None:
        """Start it with some environment variables; None for those of this process."""
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("w") as output:
            self.process = subprocess.Popen(self._command, stdout=output, stderr=subprocess.STDOUT, env=environment)
        self._output = self._log.open(errors="replace")

    def is_over(self) -> bool:
        """Read what it has said since; whether it has ended."""
        is_over = self.process.poll() is not None
        *complete, self._incomplete = (self._incomplete + self._output.read()).split("\n")
        for line in complete:
            self.told.read_line(line)
        if is_over:
            self._output.close()
        return is_over

    def print_logs(self) -> None:
        """Print the ends of the logs of its jobs that failed, else of its own."""
        logs = [job.log for job in self.told.failed.values() if job.log] or [self._log]
        for log in logs[:MAX_LOGS]:
            lines = log.read_text(errors="replace").splitlines() if log.is_file() else []
            print(f"\nThe last lines of {log}:", *lines[-LOG_LINES:], sep="\n    ", file=sys.stderr)
        if len(logs) > MAX_LOGS:
            print(f"\nOther logs of failed jobs: {', '.join(map(str, logs[MAX_LOGS:]))}", file=sys.stderr)


def execute(
    runs: Iterable[Snakemake],
    name: str,
    progress: Progress,
    environment: dict[str, str] | None = None,
    at_once: int = 1,
) -> int:
    """Run Snakemakes, show their progress or what failed on stderr, and return the largest exit status.

    After a status above 1, which is not that of failed jobs, none is started any more.

    Parameters
    ----------
    runs : iterable of Snakemake
        They are started in this order.
    name : str
        Name of the repository.
    progress : Progress
        That of all of them.
    environment : dict, optional
        Environment variables of Snakemake (default: those of this process).
    at_once : int
        Largest number of them that run side by side.
    """
    waiting, started, status = iter(runs), list[Snakemake](), 0
    with _ended_with_this(started), closing(ProgressLine(name, sys.stderr)) as line:
        while True:
            while status <= 1 and len(started) < at_once and (following := next(waiting, None)):
                following.start(environment)
                started.append(following)
                progress.logs.append(following.told)
            if not started:
                return status
            ended = [run for run in started if run.is_over()]
            line.show(progress)
            for run in ended:
                started.remove(run)
                status = max(status, abs(run.process.returncode))
                if run.process.returncode:
                    line.close()
                    run.print_logs()
            time.sleep(0 if ended else POLL_SECONDS)


class ProgressLine:
    """Line with the progress of a run, rewritten in place on a terminal, and printed at intervals elsewhere.

    Parameters
    ----------
    name : str
        Start of the line.
    stream : TextIO
    clock : callable
        Returns the time, s.
    """

    def __init__(self, name: str, stream: TextIO, clock=time.monotonic) -> None:
        self._name, self._stream, self._clock = name, stream, clock
        self._last, self._next, self._start = "", clock(), clock()

    def show(self, progress: Progress) -> None:
        """Print the line if it has changed and the interval has passed."""
        text = self._text(progress)
        if not text or text == self._last or self._clock() < self._next:
            return
        self._last = text
        if not self._stream.isatty():
            self._next = self._clock() + LINE_SECONDS
        start, end = ("\r\033[K", "") if self._stream.isatty() else ("", "\n")
        print(f"{start}{text[: shutil.get_terminal_size().columns - 1]}", end=end, file=self._stream, flush=True)

    def _text(self, progress: Progress) -> str:
        """The line; empty if there is nothing to say."""
        if not progress.is_planned:
            return f"{self._name}: planning" if self._clock() - self._start > PLANNING_SECONDS else ""
        left = progress.seconds_left
        words = f"{100 * progress.share:.0f} % done, {progress.activity}, about {format_duration(left)} left"
        return f"{self._name}: {words}" if left else ""

    def close(self) -> None:
        """Clear the line on a terminal."""
        if self._stream.isatty():
            print("\r\033[K", end="", file=self._stream, flush=True)


@contextmanager
def _ended_with_this(started: list[Snakemake]) -> Iterator[None]:
    """Terminate processes and their descendants if this process is interrupted or terminated."""
    signals = (signal.SIGTERM, signal.SIGHUP)
    handlers = [signal.signal(number, _raise_exit) for number in signals]
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        _terminate([run.process.pid for run in started])
        raise
    finally:
        for number, handler in zip(signals, handlers, strict=True):
            signal.signal(number, handler)


def _raise_exit(number: int, _: object) -> None:
    raise SystemExit(128 + number)


def _terminate(numbers: list[int]) -> None:
    processes = []
    for number in numbers:
        with suppress(psutil.NoSuchProcess):
            processes += [psutil.Process(number), *psutil.Process(number).children(recursive=True)]
    for member in processes:
        with suppress(psutil.NoSuchProcess):
            member.terminate()
    for member in psutil.wait_procs(processes, timeout=TERMINATION_SECONDS)[1]:
        with suppress(psutil.NoSuchProcess):
            member.kill()
