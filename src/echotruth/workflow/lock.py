"""One run at a time writes a repository: a lock on its folder, which the system releases when the run ends."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

VARIABLE = "ECHOTRUTH_RUN"
"""Environment variable that names the folder to the processes of a run, which need no lock of their own."""

JOBS = ".jobs"
"""File that jobs lock together."""
TRIES, SECONDS = 5, 0.1
"""How often, and how long after one another, a lock is tried."""

ANOTHER = "{}: another run works on it: wait for it, or stop it"

_held: list[IO[bytes]] = []


class LockError(RuntimeError):
    """Raised if another run works on a folder."""


def hold(folder: Path) -> bool:
    """Lock a folder until this process ends.

    Returns
    -------
    bool
        Whether this process is the one that runs the folder, and not one of its jobs.

    Raises
    ------
    LockError
        If another run holds it.
    """
    if os.environ.get(VARIABLE) == str(folder.absolute()):
        return False
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / JOBS).open("ab") as jobs:
        if not _is_free(jobs):
            raise LockError(f"{folder}: jobs of a run that was killed still work: wait for them, or stop them")
        file = (folder / ".lock").open("ab")
        if not _is_free(file):
            raise LockError(ANOTHER.format(folder))
    _held.append(file)  # closed, and so released, with this process
    os.environ[VARIABLE] = str(folder.absolute())
    return True


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Lock a folder for a while; LockError if another run holds it."""
    before, is_new = len(_held), hold(folder)
    try:
        yield
    finally:
        if is_new:
            os.environ.pop(VARIABLE)
            _held.pop(before).close()


def share(folder: Path) -> None:
    """Let it be known, until this process ends, that a job works on a folder, whatever becomes of the run it is of."""
    file = (folder / JOBS).open("ab")
    fcntl.flock(file, fcntl.LOCK_SH)
    _held.append(file)


def claim(log: IO[str], folder: Path) -> None:
    """Lock the log of a run, before it has locked its folder, until the file is closed.

    Raises
    ------
    LockError
        If another run holds one of them.
    """
    if is_held(folder) or not _is_free(log):
        raise LockError(ANOTHER.format(folder))


def _is_free(file: IO) -> bool:
    """Lock a file for this process alone; whoever only looks whether it is locked holds it for a moment."""
    for _ in range(TRIES):
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(SECONDS)
    return False


def is_held(folder: Path) -> bool:
    """Whether a run works on a folder."""
    path = folder / ".lock"
    if not path.is_file():
        return False
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
