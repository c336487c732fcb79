"""Checks of a part of a release before it is unpacked: what its archive holds, and what stands where it would go."""

from pathlib import Path
from stat import S_IFDIR, S_IFMT, S_IFREG
from zipfile import ZIP_STORED, BadZipFile, ZipFile, ZipInfo

KINDS = (0, S_IFREG, S_IFDIR)
"""Types of file that a member may have; an archive need not say any."""


def members(archive: ZipFile, name: str) -> list[str]:
    """Files in a part of a release.

    Parameters
    ----------
    archive : ZipFile
    name : str
        Folder below which all of them are.

    Raises
    ------
    BadZipFile
        If a member is not below it, is no regular file or folder, is compressed, or is in the way of another.
    """
    for entry in archive.infolist():
        if entry.compress_type != ZIP_STORED:
            raise BadZipFile("its files are compressed")
        if not _is_below(entry, name):
            raise BadZipFile(f"{entry.filename[:80]!r} is no file below {name[:80]}")
    files = [entry.filename for entry in archive.infolist() if not entry.is_dir()]
    if len(set(files)) < len(files) or _folders(files) & set(files):
        raise BadZipFile("two of its files have the same place")
    return files


def in_the_way(files: list[str], folder: Path, written: set[str]) -> Path | None:
    """What stands where files would be written, and may not be written over or through; None if nothing does.

    Parameters
    ----------
    files : list of str
        As :func:`members` returns them.
    folder : Path
        Folder that they are unpacked to.
    written : set of str
        Files that were unpacked there before, which may be written again; while there are none, no folder may be there.
    """
    for name in sorted(_folders(files)):
        path = folder / name
        if path.is_symlink() or (path.exists() and not (written and path.is_dir())):
            return path
    for name in files:
        path = folder / name
        if path.is_symlink() or (path.exists() and not (path.is_file() and name in written)):
            return path
    return None


def _is_below(entry: ZipInfo, name: str) -> bool:
    """Whether a member is a regular file or a folder below a folder, and its name is one that can be printed."""
    first, *others = entry.filename.removesuffix("/").split("/")
    is_plain = entry.filename.isprintable() and not {"", ".", ".."} & {first, *others}
    is_kind = S_IFMT(entry.external_attr >> 16) in KINDS
    return is_plain and is_kind and first == name and (bool(others) or entry.is_dir())


def _folders(files: list[str]) -> set[str]:
    """All folders in which files are."""
    return {str(parent) for file in files for parent in Path(file).parents[:-1]}
