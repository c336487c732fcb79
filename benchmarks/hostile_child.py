"""The process to which hostile input is given, which may end on it, and what becomes of an input there."""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import select
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from worker import ONE_THREAD, serve

CPU_S, WALL_S = 60.0, 200.0
"""Processor time, and time in all, after which an input is taken to go on for ever."""
MEMORY = 8 * 2**30
"""Address space of the process, bytes, so that a bomb ends it and not the machine."""
LONGEST = 900
"""Characters of the longest line that is still taken for a sentence."""

REFUSED, ACCEPTED, FOUND = "refused in a sentence", "accepted rightly", "found by check"
TRACEBACK, CRASH, LATE, SILENT, UNCLEAR, EXECUTED, OUTSIDE = (
    "fault: traceback",
    "fault: process ended",
    "fault: no end",
    "fault: silence",
    "fault: no sentence",
    "fault: code executed",
    "fault: file outside touched",
)
OUTCOMES = (REFUSED, ACCEPTED, FOUND, TRACEBACK, CRASH, LATE, SILENT, UNCLEAR, EXECUTED, OUTSIDE)


@dataclass(frozen=True)
class Trial:
    """One input, and what became of it."""

    part: str
    kind: str
    name: str
    outcome: str
    said: str
    """What was said of it, or why it is harmless."""

    @property
    def is_fault(self) -> bool:
        return self.outcome.startswith("fault")


@dataclass(frozen=True)
class Answer:
    """What a command did: its exit status and its words; or how it ended without one."""

    status: int | None
    text: str
    fault: str = ""

    @property
    def sentences(self) -> list[str]:
        """Lines by which an error was told."""
        return [line for line in self.text.splitlines() if line.startswith("echotruth: ")]

    def refusal(self, *names: str) -> str:
        """Outcome of an input that was not accepted: a sentence must have the names of its file and key."""
        if self.fault:
            return self.fault
        said = "\n".join(self.sentences)
        is_clear = said and all(name in said for name in names) and max(map(len, self.sentences)) <= LONGEST
        return REFUSED if is_clear else UNCLEAR


class Child:
    """A process that carries out commands, and is started again when an input has ended it.

    Parameters
    ----------
    folder : Path
        Its working folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._process = folder, None
        self.starts = 0

    def __call__(self, command: str, **options: Any) -> Answer:
        """Carry out a command."""
        process = self._process or self._start()
        process.stdin.write(json.dumps([command, options]).encode() + b"\n")
        process.stdin.flush()
        line = process.stdout.readline() if select.select([process.stdout], [], [], WALL_S)[0] else None
        if line:
            return Answer(**json.loads(line))
        if line is None:
            os.killpg(process.pid, signal.SIGKILL)
        ended = process.wait()
        self._process = None
        late = line is None or -ended == signal.SIGPROF
        return Answer(None, f"ended by {ended}", LATE if late else CRASH)

    def _start(self) -> Any:
        self.starts += 1
        self._process = subprocess.Popen(
            [sys.executable, "-W", "ignore", str(Path(__file__).absolute())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=self._folder,
            env={**os.environ, **ONE_THREAD},
            start_new_session=True,
        )
        return self._process

    def close(self) -> None:
        """End the process."""
        if self._process:
            self._process.stdin.close()
            self._process.wait()
            self._process = None


def _bounded(act: Callable[..., int | None]) -> Callable[..., dict[str, Any]]:
    """The command as it is served: with a bound on its processor time, and with what it says and raises."""

    def carried_out(**options: Any) -> dict[str, Any]:
        said = io.StringIO()
        signal.setitimer(signal.ITIMER_PROF, CPU_S)
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                status = act(**options)
            return {"status": status or 0, "text": said.getvalue()}
        except SystemExit as ended:
            # As the interpreter does with what is given to sys.exit.
            words = "" if isinstance(ended.code, int | None) else str(ended.code)
            return {
                "status": ended.code if isinstance(ended.code, int) else int(bool(words)),
                "text": said.getvalue() + words,
            }
        except BaseException:
            return {"status": None, "text": said.getvalue() + traceback.format_exc(), "fault": TRACEBACK}
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)

    return carried_out


def _echotruth(arguments: list[str]) -> None:
    from echotruth.cli import main

    sys.argv = ["echotruth", *arguments]
    main()


def _configuration(path: str) -> None:
    """Print the values of a configuration that is accepted."""
    from echotruth.config.loading import load

    print(json.dumps(load(path).model_dump(mode="json")))


def _passed_on(folder: str, case: str, view: str) -> None:
    """Read the scatterers in the scratch folder, as the next stage does."""
    from echotruth.workflow.job import Job

    job = Job(Path(folder), "rf", case, view, code="1")
    try:
        job.passed_on(job.scatterers)
    except FileNotFoundError as error:
        sys.exit(f"echotruth: {error}")


def _read_clip(path: str) -> None:
    """Read a recorded clip."""
    import echotruth as et

    try:
        et.read_clip(path, spacing_mm=0.1, frame_time_ms=10.0)
    except ValueError as error:
        sys.exit(f"echotruth: {error}")


def _read_array(folder: str, path: str) -> None:
    """Read an array of a repository; Python raises where the command line says a sentence."""
    import echotruth as et

    try:
        et.Repository(folder).read(path, ...)
    except Exception as error:
        sys.exit(f"echotruth: {type(error).__name__}: {str(error)[: LONGEST // 2]}")


COMMANDS = {
    "echotruth": _echotruth,
    "configuration": _configuration,
    "passed_on": _passed_on,
    "read_clip": _read_clip,
    "read_array": _read_array,
}

if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    serve({name: _bounded(act) for name, act in COMMANDS.items()})
