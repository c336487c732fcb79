"""Lease of the folder of a repository: one run at a time writes it, whatever machines its jobs run on.

The lease is a numbered file in `out/NAME/.lease`. The highest number counts; its JSON names the run and the process
that holds it, and its modification time is the heartbeat, so that the clock is that of the file system and renewing it
needs no space. A lease is taken by creating the next number, which only one process can do (`O_EXCL`, atomic also on
NFS from version 3, open(2)), and lost when its file is gone. The environment variable `ECHOTRUTH_RUN` hands the name of
the run to its processes: each of them ends when the lease of its run does.
"""

from __future__ import annotations

import atexit
import errno
import json
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from uuid import uuid4

import psutil

NAME = ".lease"
"""Folder of the leases in the folder of a repository."""
VARIABLE = "ECHOTRUTH_RUN"
"""Environment variable with the name of the run that a process belongs to."""
HEARTBEAT_SECONDS = 10.0
"""Interval at which a lease is renewed."""
STALE_SECONDS = 60.0
"""Age of the heartbeat from which other machines take a lease over, if none follows within another interval."""
MISSED_HEARTBEATS = 4
"""Heartbeats that processes on other machines miss before they end: sooner than their lease is taken over."""
POLL_SECONDS = 1.0
"""Interval at which processes on the machine of the holder look whether it lives."""
END_SECONDS = 10.0
"""Time that the killed processes of an ended run have to disappear."""


class LeaseError(OSError):
    """A folder cannot be written because another run holds its lease, or because the own run has ended."""


@dataclass(frozen=True)
class Holder:
    """Process that holds a lease.

    Attributes
    ----------
    run : str
        Name of the run.
    host : str
        Name of its machine, for people.
    machine : str
        Machine, start of the machine and process namespace: where they are the same, the process can be looked up.
    pid : int
        Number of the process.
    started : float
        Start of the process since that of the machine, s: numbers of processes are used again.
    since : str
        Date and time at which it took the lease, for people.
    released : bool
        Whether it has given the lease back.
    """

    run: str
    host: str
    machine: str
    pid: int
    started: float
    since: str
    released: bool = False

    @classmethod
    def here(cls, run: str) -> Holder:
        """This process."""
        since = time.strftime("%Y-%m-%d %H:%M:%S")
        return cls(run, socket.gethostname(), _machine(), os.getpid(), _start_time(os.getpid()), since)

    @property
    def is_here(self) -> bool:
        """Whether it is a process of this machine."""
        return self.machine == _machine()

    @property
    def lives(self) -> bool:
        """Whether the process, of this machine, has not ended."""
        with suppress(psutil.NoSuchProcess):
            is_same = abs(_start_time(self.pid) - self.started) < 0.1
            return is_same and psutil.Process(self.pid).status() != psutil.STATUS_ZOMBIE
        return False

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}, since {self.since}"


UNKNOWN = Holder("", "an unknown host", "", 0, 0.0, "an unknown time")
"""Holder of a lease that is just being written."""


def _machine() -> str:
    boot = Path("/proc/sys/kernel/random/boot_id")
    namespace = Path("/proc/self/ns/pid")
    start = boot.read_text().strip() if boot.exists() else f"{psutil.boot_time():.0f}"
    return f"{socket.gethostname()} {start} {os.readlink(namespace) if namespace.exists() else ''}".strip()


def _start_time(pid: int) -> float:
    """Start of a process since that of the machine, s; the clock of the machine may be set in between."""
    boot = psutil.boot_time()
    return psutil.Process(pid).create_time() - boot


class Lease:
    """Lease that this process holds and renews until it gives it back.

    Parameters
    ----------
    path : Path
        File of the lease.
    holder : Holder
    end : callable
        Called with a sentence if the lease is lost (default: ends this process and its descendants).
    """

    def __init__(self, path: Path, holder: Holder, end: Callable[[str], None] | None = None) -> None:
        self.path, self.holder = path, holder
        self._end, self._released = end or end_tree, threading.Event()
        self._thread = threading.Thread(target=self._renew, name="heartbeat", daemon=True)
        self._thread.start()

    def _renew(self) -> None:
        while not self._released.wait(HEARTBEAT_SECONDS):
            try:
                os.utime(self.path)
            except OSError as error:
                if error.errno in (errno.ENOENT, errno.ESTALE):
                    return self._end(f"the lease {self.path} was taken by another run")

    def release(self) -> None:
        """End what is left of the run on this machine, and give the lease back."""
        if os.getpid() != self.holder.pid:  # a fork of the holder
            return
        self._released.set()
        self._thread.join()
        end_processes(self.holder.run)
        if self.path.exists():
            draft = self.path.with_name(f".{uuid4().hex}")
            draft.write_text(json.dumps(asdict(self.holder) | {"released": True}))
            draft.replace(self.path)


@contextmanager
def held(folder: Path) -> Iterator[str]:
    """Hold the lease of a folder, once no other run does, and give the name of the run for :data:`VARIABLE`.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    lease = acquire(folder, uuid4().hex, wait=True)
    try:
        yield lease.holder.run
    finally:
        with suppress(OSError):  # e.g. a full disk: this process ends, so others find the lease free
            lease.release()


def acquire(folder: Path, run: str, wait: bool, end: Callable[[str], None] | None = None) -> Lease:
    """Take the lease of a folder, also from a run that ended without giving it back.

    Parameters
    ----------
    folder : Path
        Folder of the repository; made if need be.
    run : str
        Name of the run.
    wait : bool
        Whether to wait for a run that holds it.
    end : callable, optional
        Called with a sentence if the lease is lost later (default: ends this process and its descendants).

    Raises
    ------
    LeaseError
        If another run holds it and `wait` is false.
    OSError
        If the folder cannot be written.
    """
    (folder / NAME).mkdir(parents=True, exist_ok=True)
    told = False
    while True:
        number, holder = _newest(folder)
        if holder is not None and _is_used(folder, number, holder):
            if not wait:
                raise LeaseError(f"{folder} is in use by another run ({holder}): wait until it ends")
            if not told:
                _say(f"{folder} is in use by another run ({holder}); waiting until it ends")
            told = True
            time.sleep(POLL_SECONDS)
        elif path := _claim(folder, number + 1, Holder.here(run)):
            if holder is not None and not holder.released:
                _say(f"the run that used {folder} ({holder}) ended without giving it back; continuing in its place")
                end_processes(holder.run)
            return Lease(path, Holder.here(run), end)


def join(folder: Path) -> None:
    """Make this Snakemake end with its run, or name the run if this process is to start one (see :func:`hold`).

    Raises
    ------
    LeaseError
        If the run of this process has ended.
    """
    if VARIABLE in os.environ:
        follow(folder)
    else:
        os.environ[VARIABLE] = uuid4().hex


def hold(folder: Path) -> None:
    """Hold the lease of a folder until this Snakemake ends, unless the process that started it does so.

    Raises
    ------
    LeaseError
        If another run holds it.
    """
    run = os.environ[VARIABLE]
    _, holder = _newest(folder)
    if holder is None or holder.released or holder.run != run:
        atexit.register(acquire(folder, run, wait=False).release)


def current(folder: Path) -> tuple[Holder | None, bool]:
    """Process that holds the lease of a folder, or held it last, and whether it lives; nothing is written.

    Parameters
    ----------
    folder : Path
        Folder of the repository; it need not exist.

    Returns
    -------
    holder : Holder or None
        None if the folder never had a lease.
    lives : bool
        Of a process on another machine, whether its last heartbeat is younger than `STALE_SECONDS` by the clock of this
        one.
    """
    number, holder = _newest(folder)
    if holder is None or holder.released:
        return holder, False
    if holder.is_here:
        return holder, holder.lives
    return holder, time.time() - _heartbeat(_path(folder, number)) < STALE_SECONDS


_followed: list[Path] = []
"""Lease that this process follows."""


def follow(folder: Path, end: Callable[[str], None] | None = None) -> None:
    """Make this process end when the lease of its run does; without a run, make sure that no run writes the folder.

    Parameters
    ----------
    folder : Path
        Folder of the repository. One that never had a lease is free.
    end : callable, optional
        Called with a sentence when the run ends (default: ends this process and its descendants).

    Raises
    ------
    LeaseError
        If the run of this process has ended, or another run writes the folder.
    """
    number, holder = _newest(folder)
    if _followed or holder is None:
        return
    if (run := os.environ.get(VARIABLE)) is None:
        if _is_used(folder, number, holder):
            raise LeaseError(f"{folder} is in use by another run ({holder}): wait until it ends")
        return
    if holder.run != run or holder.released:
        raise LeaseError(f"the run of this job on {folder} has ended: start it again")
    _followed.append(_path(folder, number))
    threading.Thread(target=_watch, args=(_followed[0], holder, end or end_tree), name="lease", daemon=True).start()


def confirm() -> None:
    """End this process, before it records a result, if its run no longer holds the lease."""
    for path in _followed:
        if (holder := _read(path)) is None or holder.released:
            end_tree(f"the run that held {path} has ended")


def _watch(path: Path, holder: Holder, end: Callable[[str], None]) -> None:
    """Call `end` when a lease is lost or given back, or its holder dies or misses its heartbeats."""
    missed, last_heartbeat = 0, 0.0
    while missed < MISSED_HEARTBEATS:
        time.sleep(POLL_SECONDS if holder.is_here else HEARTBEAT_SECONDS)
        now = _read(path)
        if now is None or now.released:
            return end(f"the run that holds {path} has ended")
        if holder.is_here and not holder.lives:
            return end(f"the process that holds {path} ({holder}) has ended")
        heartbeat = _heartbeat(path)
        missed = 0 if holder.is_here or heartbeat != last_heartbeat else missed + 1
        last_heartbeat = heartbeat
    end(f"the process that holds {path} ({holder}) has given no sign of life")


def _path(folder: Path, number: int) -> Path:
    return folder / NAME / f"{number}.json"


def _newest(folder: Path) -> tuple[int, Holder | None]:
    """Number of the newest lease and its holder; 0 and None if there was never one."""
    while True:
        number = max((int(path.stem) for path in (folder / NAME).glob("[0-9]*.json")), default=0)
        holder = _read(_path(folder, number)) if number else None
        if holder is not None or not number:
            return number, holder


def _read(path: Path) -> Holder | None:
    """Holder of a lease; None if the lease is gone."""
    try:
        return Holder(**json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, TypeError):
        return UNKNOWN
    except OSError as error:
        if error.errno in (errno.ENOENT, errno.ESTALE):
            return None
        raise


def _heartbeat(path: Path) -> float:
    """Time of the last heartbeat by the clock of the file system, s; 0 if the lease is gone."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _is_used(folder: Path, number: int, holder: Holder) -> bool:
    """Whether the holder of a lease lives."""
    path = _path(folder, number)
    if holder.released or holder.is_here:
        return not holder.released and holder.lives
    heartbeat = _heartbeat(path)
    if _now(folder) - heartbeat < STALE_SECONDS:
        return True
    # After a stall of the file system, all heartbeats are old until their processes write again.
    time.sleep(HEARTBEAT_SECONDS)
    return _heartbeat(path) != heartbeat


def _now(folder: Path) -> float:
    """Time by the clock of the file system, s."""
    path = folder / NAME / f".{uuid4().hex}"
    path.touch()
    try:
        return path.stat().st_mtime
    finally:
        path.unlink()


def _claim(folder: Path, number: int, holder: Holder) -> Path | None:
    """Create the lease of a number and delete earlier ones; None if another process was first."""
    path = _path(folder, number)
    try:
        with path.open("x", encoding="utf-8") as file:
            json.dump(asdict(holder), file)
            file.flush()
            os.fsync(file.fileno())
    except FileExistsError:
        return None
    except OSError:
        path.unlink(missing_ok=True)
        raise
    if _newest(folder)[0] != number:  # a late process took the number of a lease that has come and gone
        path.unlink()
        return None
    for other in (folder / NAME).glob("[0-9]*.json"):
        if int(other.stem) < number:
            other.unlink(missing_ok=True)
    return path


def end_processes(run: str) -> None:
    """Kill what is left of a run on this machine, except this process and its ancestors; wait until it is gone."""
    if not run:
        return
    spared = {os.getpid(), *(process.pid for process in psutil.Process().parents())}
    killed = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.pid not in spared and process.environ().get(VARIABLE) == run:
                process.kill()
                killed.append(process)
    psutil.wait_procs(killed, timeout=END_SECONDS)


def end_tree(reason: str) -> None:
    """Say why, and end this process and its descendants at once."""
    _say(f"{reason}; ending")
    with suppress(psutil.Error):
        for process in psutil.Process().children(recursive=True):
            with suppress(psutil.Error):
                process.kill()
    os._exit(1)


def _say(sentence: str) -> None:
    print(f"echotruth: {sentence}", file=sys.stderr, flush=True)
