"""Files of a series: those that a pattern matches, those that a .pvd or .pvtu file names, and the hash of all."""

import glob
import re
from functools import cache
from hashlib import sha256
from pathlib import Path

from echotruth.mechanics.prescribed import MotionError

_NAMED = {
    ".pvd": re.compile(r'file\s*=\s*["\']([^"\']+)["\']'),
    ".pvtu": re.compile(r'Source\s*=\s*["\']([^"\']+)["\']'),
}
"""Suffix of a file -> other files that it names."""


def series_files(path: str) -> list[Path]:
    """Files that a path names: itself, or those that match its pattern.

    Parameters
    ----------
    path : str
        Path of a file, or a pattern with *, ? or [].

    Returns
    -------
    list of Path
        In the order of the numbers in their names.

    Raises
    ------
    MotionError
        If there is none.
    """
    if Path(path).is_file():
        return [Path(path)]
    files = sorted((Path(file) for file in glob.glob(path) if Path(file).is_file()), key=natural_order)
    if not files:
        remedy = "give its path, or a pattern such as heart_*.vtu, from the working folder"
        raise MotionError(f"motion.file.path = {path!r}: there is no file {Path(path).absolute()}: {remedy}.")
    return files


def content_hash(path: str) -> str:
    """Hash of the content of all files of a series: a changed file is a changed motion; empty where there is none."""
    try:
        files = series_files(path)
    except MotionError:
        return ""
    digest = sha256()
    for file in _with_named(files):
        status = file.stat()
        digest.update(_file_hash(file, status.st_mtime_ns, status.st_size))
    return digest.hexdigest()[:16]


def _with_named(files: list[Path]) -> list[Path]:
    """The files, and those that they name and that exist."""
    found: list[Path] = []
    pending = list(files)
    while pending:
        file = pending.pop(0)
        if file in found or not file.is_file():
            continue
        found.append(file)
        if named := _NAMED.get(file.suffix.lower()):
            names = named.findall(file.read_text(errors="replace"))
            pending += [file.parent / name.split(":")[0] for name in names]
    return found


@cache
def _file_hash(file: Path, _modified_ns: int, _size: int) -> bytes:
    return sha256(file.read_bytes()).digest()


def natural_order(file: Path) -> list[tuple[int, str]]:
    """Key by which frame_9 comes before frame_10."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", str(file))]
