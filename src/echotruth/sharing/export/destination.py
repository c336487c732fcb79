"""Files and folders that are whole or absent: they are written under another name first."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import rmtree
from uuid import uuid4

from echotruth.sharing.export.error import ExportError


@contextmanager
def draft(target: Path) -> Iterator[Path]:
    """Give a path to write a file or a folder to; it takes its name, with what it holds on disk, when all is written.

    The draft keeps the suffix, by which some libraries choose the format. An earlier export of the same name is
    replaced.

    Raises
    ------
    ExportError
        If the target is a folder in which something else lies.
    """
    path = target.with_name(f".partial-{os.getpid()}-{uuid4().hex[:8]}-{target.name}")
    old = path.with_name(f"{path.name}.old")
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield path
        _require_replaceable(target, path)
        if target.is_dir():
            target.replace(old)
        path.replace(target)
    finally:
        if old.exists() and not target.exists():
            old.replace(target)
        for rest in (path, old):
            rmtree(rest, ignore_errors=True) if rest.is_dir() else rest.unlink(missing_ok=True)


def _require_replaceable(target: Path, path: Path) -> None:
    """Raise an error for a folder that no export made: one with other kinds of files than the draft, or folders."""
    if not target.is_dir():
        return
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    suffixes, folders = {file.suffix for file in files}, {file.name for file in files if file.is_dir()}
    odd = sorted(
        file.name
        for file in target.iterdir()
        if (file.name not in folders if file.is_dir() else file.suffix not in suffixes)
    )
    if odd:
        raise ExportError(f"{target} holds something else ({odd[0]}): give another folder with --output")
