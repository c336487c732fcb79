"""Folders in one .zip: files are stored as they are and without times, so that the same files give the same bytes."""

import fcntl
import shutil
import zlib
from hashlib import sha256
from pathlib import Path
from zipfile import ZIP_STORED, ZipFile, ZipInfo

EPOCH = (1980, 1, 1, 0, 0, 0)
"""Earliest time that a .zip can have."""


def append(archive: ZipFile, name: str, content: bytes) -> None:
    """Append a file to an archive, given its name there."""
    about = ZipInfo(name, EPOCH)
    about.external_attr = 0o644 << 16
    about.create_system = 3  # the same on every system
    archive.writestr(about, content, ZIP_STORED)


def pack(path: Path, folder: Path, *names: str) -> None:
    """Write an archive of some files and folders of a folder, given their names."""
    found = (file for name in names for file in [folder / name, *(folder / name).rglob("*")] if file.is_file())
    with ZipFile(path, "w") as archive:
        for file in sorted(found):
            append(archive, file.relative_to(folder).as_posix(), file.read_bytes())


def unpacked(path: Path, home: Path) -> Path:
    """Folder with the files of an archive, which are unpacked unless they are there and whole.

    Parameters
    ----------
    path : Path
    home : Path
        Folder in which that folder is; its name has a hash of the archive.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    folder = home / f"{path.stem}-{sha256(path.read_bytes()).hexdigest()[:16]}"
    with ZipFile(path) as archive:
        if not _is_whole(archive, folder):
            with (home / f".{folder.name}.lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                if not _is_whole(archive, folder):  # another process may have unpacked it meanwhile
                    _unpack(archive, folder)
    return folder


def _is_whole(archive: ZipFile, folder: Path) -> bool:
    try:
        return all(zlib.crc32((folder / one.filename).read_bytes()) == one.CRC for one in archive.infolist())
    except OSError:
        return False


def _unpack(archive: ZipFile, folder: Path) -> None:
    draft = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(draft, ignore_errors=True)
    archive.extractall(draft)
    shutil.rmtree(folder, ignore_errors=True)
    draft.rename(folder)
