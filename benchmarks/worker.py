"""Two interpreters in one run: commands as lines of JSON to a process that waits for them.

Needs the standard library only, as both interpreters import it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

ONE_THREAD = {
    name: "1"
    for name in (
        "OMP_NUM_THREADS",
        "MKL_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "BLIS_NUM_THREADS",
    )
} | {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}
"""What keeps every library of both sides on one thread."""


class Worker:
    """A process that carries out commands one at a time within a `with` block, and waits idly between them.

    Parameters
    ----------
    python : str or Path
        Interpreter.
    script : Path
        Calls `serve`.
    environment : dict, optional
        Added to this process's own, and to `ONE_THREAD`.
    """

    def __init__(self, python: str | Path, script: Path, environment: dict[str, str] | None = None) -> None:
        self._process = subprocess.Popen(
            [str(python), str(script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **ONE_THREAD, **(environment or {})},
        )

    def __call__(self, command: str, **options: Any) -> Any:
        """Carry out a command and return what it gives."""
        self._process.stdin.write(json.dumps([command, options]) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"{' '.join(self._process.args)} ended during the command {command!r}.")
        return json.loads(line)

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()


def serve(commands: dict[str, Callable[..., Any]]) -> None:
    """Carry out commands from the standard input until it ends.

    What the commands print goes to the standard error: the standard output is the answers' own.

    Parameters
    ----------
    commands : dict
        Name to function of keyword arguments; what it returns must be JSON.
    """
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for line in sys.stdin:
        name, options = json.loads(line)
        answers.write(json.dumps(commands[name](**options)) + "\n")
        answers.flush()


def medians(turns: list[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Median over the turns of the wall and CPU seconds of each part, as clocks have them."""
    return {part: {kind: median(turn[part][kind] for turn in turns) for kind in ("wall", "cpu")} for part in turns[0]}


class Clock:
    """Wall and CPU seconds of what runs within a `with` block; blocks of one name add up."""

    def __init__(self) -> None:
        self.seconds: dict[str, dict[str, float]] = {}

    def __call__(self, name: str) -> Clock:
        """Name the block that follows."""
        self._name = name
        return self

    def __enter__(self) -> None:
        self._start = time.perf_counter(), time.process_time()

    def __exit__(self, *_: object) -> None:
        wall, cpu = time.perf_counter() - self._start[0], time.process_time() - self._start[1]
        self._add(self._name, {"wall": wall, "cpu": cpu})

    def add(self, other: Clock) -> None:
        """Add what another clock has."""
        for name, spent in other.seconds.items():
            self._add(name, spent)

    def _add(self, name: str, spent: dict[str, float]) -> None:
        total = self.seconds.setdefault(name, {"wall": 0.0, "cpu": 0.0})
        for kind, value in spent.items():
            total[kind] += value
