"""Files that are whole or absent, on disk before anything vouches for them, and written by one process at a time."""

import fcntl
import os
import shutil
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

_THREADS = 16
"""Requests to force files to disk that wait at the same time: most systems serve many as fast as one."""


def write(path: Path, content: bytes) -> None:
    """Write a file atomically: its content is on disk before the file gets its name, and its name when this returns."""
    write_all({path: content})


def write_all(files: dict[Path, bytes]) -> None:
    """Write files, each of them atomically; all are on disk when this returns.

    A draft has a name of its own in every process of every host, so that two writers never share one.

    Parameters
    ----------
    files : dict
        Content of each file, by its path.
    """
    drafts: dict[Path, Path] = {}
    folders: set[Path] = set()
    try:
        for path, content in files.items():
            folders |= _make_folder(path.parent)
            draft = path.with_name(f".{path.name}.{socket.gethostname()}.{os.getpid()}.{uuid4().hex[:8]}.partial")
            drafts[draft] = path
            draft.write_bytes(content)
        sync(*drafts)
        for draft, path in drafts.items():
            draft.replace(path)
    except BaseException:
        for draft in drafts:
            draft.unlink(missing_ok=True)
        raise
    sync(*folders)


def update_all(files: dict[Path, bytes]) -> None:
    """Write the files whose content differs from that on disk, and leave the others untouched."""
    write_all({path: content for path, content in files.items() if not path.is_file() or path.read_bytes() != content})


def sync(*paths: Path) -> None:
    """Force files and folders to disk; a folder holds the names of its files."""
    with ThreadPoolExecutor(_THREADS) as pool:
        list(pool.map(_sync, paths))


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _make_folder(folder: Path) -> set[Path]:
    """Make a folder; return it and the folders above it that hold a new name."""
    changed = [folder]
    while not changed[-1].exists():
        changed.append(changed[-1].parent)
    folder.mkdir(parents=True, exist_ok=True)
    return set(changed)


def link(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no links; the target is replaced as a whole."""
    folders = _make_folder(target.parent)
    draft = target.with_name(f"{target.name}.{uuid4().hex}.partial")
    try:
        os.link(source, draft)
    except OSError:
        shutil.copyfile(source, draft)
        sync(draft)
    draft.replace(target)
    draft.unlink(missing_ok=True)  # a link is not moved onto another link to the same data
    sync(*folders)


@contextmanager
def lock(path: Path) -> Iterator[None]:
    """Hold a lock on a file, which is made if need be, against other processes, over NFS also those of other hosts."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("ab") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield  # closing the file releases the lock, and so does the end of the process
