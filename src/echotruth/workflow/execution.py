"""Execution of the workflow: Snakemake's words in a file, how far it is in one line, and no job that outlives it."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import psutil

from echotruth.workflow.progress import Progress, words

GLANCE = 0.5
"""Seconds between two looks at the log."""
SELDOM = 30.0
"""Seconds between two lines where they are not rewritten in place."""
PATIENCE = 10.0
"""Seconds that jobs have to end when they are asked to."""
LAST = 15
"""Lines shown of the log of a job that failed."""
SHOWN = 3
"""Most logs shown."""


def execute(command: list[str], log: Path, name: str, weights: dict[str, float]) -> int:
    """Run Snakemake and tell on stderr how far it is, or what failed; its exit status.

    Parameters
    ----------
    command : list of str
    log : Path
        Where its words go.
    name : str
        Of the repository.
    weights : dict
        Rule to the seconds that its job may take.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    progress = Progress(weights)
    with log.open("w") as said:
        process = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT)
    with _no_survivors(process), log.open(errors="replace") as said:
        _follow(process, said, progress, Line(name, sys.stderr))
    if process.returncode:
        _complain(progress.logs or [log])
    return process.returncode


class Line:
    """One line that tells how far a run is, rewritten in place on a terminal, and else once in a while.

    Parameters
    ----------
    name : str
        What it begins with.
    stream : TextIO
    clock : callable
        Seconds.
    """

    def __init__(self, name: str, stream: TextIO, clock=time.monotonic) -> None:
        self._name, self._stream, self._clock = name, stream, clock
        self._last, self._next = "", clock()

    def show(self, progress: Progress) -> None:
        """Tell it, if it is time and there is anything new."""
        share = progress.share
        text = f"{self._name}: {100 * share:.0f} % done, {progress.stage}, about {words(progress.left)} left"
        if text == self._last or self._clock() < self._next or not progress.left:
            return
        self._last = text
        if self._stream.isatty():
            self._stream.write(f"\r\033[K{text[: shutil.get_terminal_size().columns - 1]}")
        else:
            self._next = self._clock() + SELDOM
            self._stream.write(f"{text}\n")
        self._stream.flush()

    def close(self) -> None:
        """Leave the terminal's line empty."""
        if self._stream.isatty():
            self._stream.write("\r\033[K")
            self._stream.flush()


def _follow(process: subprocess.Popen[bytes], said: TextIO, progress: Progress, line: Line) -> None:
    rest, ended = "", False
    try:
        while not ended:
            ended = process.poll() is not None
            *whole, rest = (rest + said.read()).split("\n")
            for text in whole:
                progress.hear(text)
            line.show(progress)
            if not ended:
                time.sleep(GLANCE)
    finally:
        line.close()


@contextmanager
def _no_survivors(process: subprocess.Popen[bytes]) -> Iterator[None]:
    """End a process and all that it has started where this one is interrupted or asked to end."""
    asked = (signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, _leave) for number in asked]
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        _end(process)
        raise
    finally:
        for number, handler in zip(asked, before, strict=True):
            signal.signal(number, handler)


def _leave(number: int, _: object) -> None:
    raise SystemExit(128 + number)


def _end(process: subprocess.Popen[bytes]) -> None:
    try:
        snakemake = psutil.Process(process.pid)
        family = [snakemake, *snakemake.children(recursive=True)]
    except psutil.NoSuchProcess:
        return
    for member in family:
        _ask(member.terminate)
    _, left = psutil.wait_procs(family, timeout=PATIENCE)
    for member in left:
        _ask(member.kill)


def _ask(end) -> None:
    try:
        end()
    except psutil.NoSuchProcess:
        return


def _complain(logs: list[Path]) -> None:
    """Show the ends of logs."""
    for log in logs[:SHOWN]:
        lines = log.read_text(errors="replace").splitlines() if log.is_file() else []
        print(f"\nThe last lines of {log}:", *lines[-LAST:], sep="\n    ", file=sys.stderr)
    if len(logs) > SHOWN:
        print(f"\nMore logs of jobs that failed: {', '.join(map(str, logs[SHOWN:]))}", file=sys.stderr)
