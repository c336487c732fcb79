"""Cost of a stage: wall-clock, CPU, compilation and start-up time, and memory."""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path

from numba.core.event import Event, Listener, register

PROCESS = Path("/proc/self")


class Cost:
    """Cost of the stages that a process runs one after the other; the first includes the start of the process."""

    def __init__(self) -> None:
        self._compilation, self._stop_cpu = _CompilationTime(), 0.0
        register("numba:compile", self._compilation)
        self.start()

    def start(self) -> None:
        """Start the measurement of a stage."""
        _reset_peak_memory()
        self._start_clock, self._start_cpu = time.perf_counter(), cpu_seconds()
        self._start_compilation = self._compilation.seconds

    def stop(self) -> dict[str, float]:
        """Cost of the stage since :meth:`start`.

        Returns
        -------
        dict
            seconds : wall-clock time; cpu_seconds : CPU time, including that of child processes; compile_seconds : CPU
            time of compilation; start_seconds : CPU time before the stage started; memory_MB : peak resident memory.
        """
        now = cpu_seconds()
        cost = {
            "seconds": time.perf_counter() - self._start_clock,
            "cpu_seconds": now - self._start_cpu,
            "compile_seconds": self._compilation.seconds - self._start_compilation,
            "start_seconds": self._start_cpu - self._stop_cpu,
            "memory_MB": _peak_memory(),
        }
        self._stop_cpu = now
        return {name: round(value, 3) for name, value in cost.items()}


class _CompilationTime(Listener):
    """CPU time of compilation, s; functions loaded from the cache take none."""

    def __init__(self) -> None:
        self.seconds, self._depth, self._start = 0.0, 0, 0.0

    def on_start(self, event: Event) -> None:
        if not self._depth:
            self._start = time.thread_time()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        self._depth -= 1
        if not self._depth:
            self.seconds += time.thread_time() - self._start


def cpu_seconds() -> float:
    """CPU time of this process and of its child processes that have ended, s."""
    # os.times resolves only hundredths of a second, so it is used for child processes alone.
    return time.process_time() + sum(os.times()[2:4])


def _reset_peak_memory() -> None:
    """Reset the peak resident memory, on systems that support it (Linux, proc(5))."""
    try:
        (PROCESS / "clear_refs").write_text("5")
    except OSError:
        return


def _peak_memory() -> float:
    """Peak resident memory of this process, MB."""
    try:
        status = (PROCESS / "status").read_text()
    except OSError:
        kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform == "darwin" else 1)
    else:
        kilobytes = float(status.split("VmHWM:")[1].split()[0])
    return kilobytes * 1024 / 1e6
