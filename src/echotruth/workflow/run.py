"""A run: Snakemake on the workflow of the package, with its output in a file and its progress on one line."""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TextIO

import psutil

from echotruth.config import shipped
from echotruth.extras import require
from echotruth.workflow import lock
from echotruth.workflow.progress import Progress

POLL_SECONDS, LINE_SECONDS = 0.5, 30.0
"""Interval at which the output is read, and between lines on a stream that is not a terminal."""
TERMINATION_SECONDS = 10.0
"""Time that jobs have to end after SIGTERM, before they are killed."""
LOG_LINES, MAX_LOGS = 15, 3
"""Lines that are shown of the log of a failed job, and largest number of logs."""


def snakemake_command(path: Path | str, options: list[str], targets: list[str]) -> list[str]:
    """Command that runs the workflow of a configuration file, with options, and rules and files to make."""
    require("snakemake")
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(shipped.ROOT / "Snakefile")]
    # Snakemake's lock is that of the working folder, where other names may run; a repository has its own.
    # --configfile takes all that follows it, up to the next option.
    return [*command, "--configfile", str(path), "--nolock", *options, *(["--", *targets] if targets else [])]


def execute(command: list[str], folder: Path, progress: Progress) -> int:
    """Run Snakemake, show its progress or what failed on stderr, and return its exit status.

    Parameters
    ----------
    command : list of str
    folder : Path
        Of the repository; the output is in its `logs/snakemake.log`.
    progress : Progress

    Raises
    ------
    LockError
        If another run works on the folder; its log stays as it is.
    """
    log = folder / "logs/snakemake.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    line = ProgressLine(folder.name, sys.stderr)
    with log.open("a") as output, log.open("a+", errors="replace") as reader:
        lock.claim(reader, folder)
        reader.truncate(0)
        reader.seek(0)
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        # What is ignored, as by nohup, stays so.
        signals = [one for one in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(one) != signal.SIG_IGN]
        handlers = [signal.signal(number, _raise_exit) for number in signals]
        try:
            incomplete = ""
            while True:
                is_over = process.poll() is not None
                *complete, incomplete = (incomplete + reader.read()).split("\n")
                for text in complete:
                    progress.read_line(text)
                if is_over:
                    break
                line.show(progress.text)
                time.sleep(POLL_SECONDS)
        except (KeyboardInterrupt, SystemExit):
            _terminate(process.pid)
            raise
        finally:
            line.close()
            for number, handler in zip(signals, handlers, strict=True):
                signal.signal(number, handler)
    if process.returncode:
        _print_logs([step.log for step in progress.failed.values() if step.log] or [log])
    return process.returncode


def _print_logs(logs: list[Path]) -> None:
    """Print the ends of the logs of jobs that failed."""
    for log in logs[:MAX_LOGS]:
        lines = log.read_text(errors="replace").splitlines() if log.is_file() else []
        print(f"\nThe last lines of {log}:", *lines[-LOG_LINES:], sep="\n    ", file=sys.stderr)
    if len(logs) > MAX_LOGS:
        print(f"\nOther logs of failed jobs: {', '.join(map(str, logs[MAX_LOGS:]))}", file=sys.stderr)


class ProgressLine:
    """Line with the progress of a run, rewritten in place on a terminal, and printed at intervals elsewhere.

    Parameters
    ----------
    name : str
        Start of the line.
    stream : TextIO
    """

    def __init__(self, name: str, stream: TextIO) -> None:
        self._name, self._stream, self._last, self._next = name, stream, "", 0.0

    def show(self, text: str) -> None:
        """Print the line if it has changed and, elsewhere than on a terminal, the interval has passed."""
        if not text or text == self._last or time.monotonic() < self._next:
            return
        self._last, is_terminal = text, self._stream.isatty()
        self._next = 0.0 if is_terminal else time.monotonic() + LINE_SECONDS
        start, end = ("\r\033[K", "") if is_terminal else ("", "\n")
        shown = f"{self._name}: {text}"[: shutil.get_terminal_size().columns - 1]
        print(f"{start}{shown}", end=end, file=self._stream, flush=True)

    def close(self) -> None:
        """Clear the line on a terminal."""
        if self._stream.isatty():
            print("\r\033[K", end="", file=self._stream, flush=True)


def _raise_exit(number: int, _: object) -> None:
    raise SystemExit(128 + number)


def _terminate(number: int) -> None:
    """Terminate a process and its descendants."""
    try:
        parent = psutil.Process(number)
        processes = [parent, *parent.children(recursive=True)]
    except psutil.NoSuchProcess:
        return
    for member in processes:
        member.terminate()
    for member in psutil.wait_procs(processes, timeout=TERMINATION_SECONDS)[1]:
        member.kill()
