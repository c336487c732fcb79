"""Files that are there as a whole or not at all, also after a power cut; and folders for what can be made again."""

import atexit
import os
import shutil
import tempfile
from pathlib import Path
from uuid import uuid4


def write(path: Path, content: bytes) -> None:
    """Write a file in one step, so that whoever reads it reads the old or the new one; make its folder if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{uuid4().hex[:8]}.partial")
    try:
        draft.write_bytes(content)
        sync(draft)
        draft.replace(path)
        sync(path.parent)
    finally:
        draft.unlink(missing_ok=True)


def remove_drafts(folder: Path) -> None:
    """Remove what a process that was killed left of files that it was writing into a folder."""
    for draft in folder.glob(".*.partial"):
        draft.unlink(missing_ok=True)


def update(path: Path, content: bytes) -> None:
    """Write a file if its content differs from that on disk, so that its date says when it changed."""
    if not path.is_file() or path.read_bytes() != content:
        write(path, content)


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_all(folder: Path) -> None:
    """Wait until a folder is on the disk with all that is in it."""
    for at, _, names in os.walk(folder):
        for path in (*(Path(at) / name for name in names), Path(at)):
            sync(path)


def user_cache() -> Path | None:
    """Folder of echotruth in the user's cache, if it is private; `$XDG_CACHE_HOME/echotruth`, or that of `~/.cache`."""
    home = os.environ.get("XDG_CACHE_HOME", "")
    try:
        return private(Path(home if os.path.isabs(home) else Path.home() / ".cache") / "echotruth")
    except RuntimeError:  # the user has no home
        return None


def private(folder: Path) -> Path | None:
    """The folder, made if need be; none if it is another user's, if others can write to it, or if this user cannot."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError:
        return None
    is_own = found.st_uid == os.getuid() and not found.st_mode & 0o022
    return folder if is_own and os.access(folder, os.W_OK | os.X_OK) else None


def temporary() -> Path:
    """A folder that is deleted when the process ends."""
    folder = tempfile.mkdtemp(prefix="echotruth-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)
