"""What a stage costs: seconds of processors and of the clock, how many of them compiling and starting, and memory."""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path

from numba.core.event import Event, Listener, register

PROCESS = Path("/proc/self")


class Cost:
    """What the stages of this process cost, one after the other; the first bears the start of the process."""

    def __init__(self) -> None:
        self._compiling, self._ended = _Compiling(), 0.0
        register("numba:compile", self._compiling)
        self.begin()

    def begin(self) -> None:
        """A stage begins its work."""
        _forget_peak()
        self._clock, self._compiled, self._begun = time.perf_counter(), self._compiling.seconds, processor()

    def spent(self) -> dict[str, float]:
        """What the stage that ends here has cost.

        Returns
        -------
        dict
            seconds : by the clock; cpu_seconds : of processors, of other processes that it called too;
            compile_seconds : how many of these went into compiling; start_seconds : of processors, before its work
            began; memory_MB : greatest resident memory.
        """
        now = processor()
        found = {
            "seconds": time.perf_counter() - self._clock,
            "cpu_seconds": now - self._begun,
            "compile_seconds": self._compiling.seconds - self._compiled,
            "start_seconds": self._begun - self._ended,
            "memory_MB": _peak(),
        }
        self._ended = now
        return {name: round(value, 3) for name, value in found.items()}


class _Compiling(Listener):
    """Processor seconds spent compiling; what is found in the cache takes none."""

    def __init__(self) -> None:
        self.seconds, self._depth, self._since = 0.0, 0, 0.0

    def on_start(self, event: Event) -> None:
        if not self._depth:
            self._since = time.thread_time()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        self._depth -= 1
        if not self._depth:
            self.seconds += time.thread_time() - self._since


def processor() -> float:
    """Processor seconds of this process and of those that it called and that have ended."""
    # os.times counts in hundredths of a second.
    return time.process_time() + sum(os.times()[2:4])


def _forget_peak() -> None:
    """Let the greatest memory be counted from here, where the system can (Linux, proc(5))."""
    try:
        (PROCESS / "clear_refs").write_text("5")
    except OSError:
        return


def _peak() -> float:
    """Greatest resident memory of this process, MB."""
    try:
        status = (PROCESS / "status").read_text()
    except OSError:
        kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform == "darwin" else 1)
    else:
        kilobytes = float(status.split("VmHWM:")[1].split()[0])
    return kilobytes * 1024 / 1e6
