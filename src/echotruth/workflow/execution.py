"""Run Snakemake with its output in a log and its progress on one line, and end all jobs with it."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

import psutil

from echotruth.workflow.progress import Progress, format_duration

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


def execute(
    command: list[str], log: Path, name: str, expected: dict[str, float], environment: dict[str, str] | None = None
) -> int:
    """Run Snakemake, show its progress or what failed on stderr, and return its exit status.

    Parameters
    ----------
    command : list of str
    log : Path
        File for its output.
    name : str
        Name of the repository.
    expected : dict
        Rule -> expected duration of its job, s.
    environment : dict, optional
        Environment variables of Snakemake (default: those of this process).
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    progress = Progress(expected)
    with log.open("w") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, env=environment)
    with _terminate_on_exit(process), log.open(errors="replace") as output:
        _follow(process, output, progress, ProgressLine(name, sys.stderr))
    if process.returncode:
        _print_logs(progress.logs or [log])
    return process.returncode


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
        self._last_text, self._next_time, self._start = "", clock(), clock()

    def show(self, progress: Progress) -> None:
        """Print the line if it has changed and the interval has passed."""
        text = self._text(progress)
        if not text or text == self._last_text or self._clock() < self._next_time:
            return
        self._last_text = text
        if self._stream.isatty():
            self._stream.write(f"\r\033[K{text[: shutil.get_terminal_size().columns - 1]}")
        else:
            self._next_time = self._clock() + LINE_SECONDS
            self._stream.write(f"{text}\n")
        self._stream.flush()

    def _text(self, progress: Progress) -> str:
        """The line; empty if there is nothing to say."""
        if not progress.is_planned:
            return f"{self._name}: planning" if self._clock() - self._start > PLANNING_SECONDS else ""
        left = progress.seconds_left
        share = f"{100 * progress.fraction_done:.0f} % done"
        return f"{self._name}: {share}, {progress.running}, about {format_duration(left)} left" if left else ""

    def close(self) -> None:
        """Clear the line on a terminal."""
        if self._stream.isatty():
            self._stream.write("\r\033[K")
            self._stream.flush()


def _follow(process: subprocess.Popen[bytes], output: TextIO, progress: Progress, line: ProgressLine) -> None:
    incomplete, ended = "", False
    try:
        while not ended:
            ended = process.poll() is not None
            *complete, incomplete = (incomplete + output.read()).split("\n")
            for text in complete:
                progress.read_line(text)
            line.show(progress)
            if not ended:
                time.sleep(POLL_SECONDS)
    finally:
        line.close()


@contextmanager
def _terminate_on_exit(process: subprocess.Popen[bytes]) -> Iterator[None]:
    """Terminate a process and its descendants if this process is interrupted or terminated."""
    signals = (signal.SIGTERM, signal.SIGHUP)
    handlers = [signal.signal(number, _raise_exit) for number in signals]
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        _terminate(process)
        raise
    finally:
        for number, handler in zip(signals, handlers, strict=True):
            signal.signal(number, handler)


def _raise_exit(number: int, _: object) -> None:
    raise SystemExit(128 + number)


def _terminate(process: subprocess.Popen[bytes]) -> None:
    try:
        snakemake = psutil.Process(process.pid)
        processes = [snakemake, *snakemake.children(recursive=True)]
    except psutil.NoSuchProcess:
        return
    for member in processes:
        with suppress(psutil.NoSuchProcess):
            member.terminate()
    _, alive = psutil.wait_procs(processes, timeout=TERMINATION_SECONDS)
    for member in alive:
        with suppress(psutil.NoSuchProcess):
            member.kill()


def _print_logs(logs: list[Path]) -> None:
    """Print the ends of logs."""
    for log in logs[:MAX_LOGS]:
        lines = log.read_text(errors="replace").splitlines() if log.is_file() else []
        print(f"\nThe last lines of {log}:", *lines[-LOG_LINES:], sep="\n    ", file=sys.stderr)
    if len(logs) > MAX_LOGS:
        print(f"\nOther logs of failed jobs: {', '.join(map(str, logs[MAX_LOGS:]))}", file=sys.stderr)
