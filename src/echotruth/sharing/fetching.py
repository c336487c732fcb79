"""Fetching a release: its parts from a folder, a web server or an archive with a DOI, unpacked to a repository.

Parts are downloaded by pooch, which compares each with its checksum in the registry. A part that is unpacked leaves a
note of it and is deleted, so that what broke off goes on with the part that was under way. Nothing is written but into
the folder of the repository, which must not be there before the first part.
"""

import csv
import re
import shutil
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_STORED, BadZipFile, ZipFile

from echotruth.files import user_cache
from echotruth.repository.choice import Names, chosen
from echotruth.repository.reader import Repository

REGISTRY, PARTS = "registry.txt", "parts.csv"
"""Names of the files of a release that say what the others are."""
STRUCTURE, HEARTS = "structure", "hearts"
"""What the parts hold that make up the repository."""
CHECKSUM = re.compile("sha256:[0-9a-f]{64}")
"""What a registry has of each file."""
REMEDY = "give the folder or address of a release"


class FetchError(OSError):
    """Raised if a release cannot be fetched; the message says which file, why, and what to do."""


def fetch(source: str | Path, cases: Names = None, to: str | Path | None = None) -> Repository:
    """Fetch a release, or some of its hearts, and open it as a repository.

    What was fetched is there the next time. If it breaks off, the same call goes on with the part that was under way.

    Parameters
    ----------
    source : str or Path
        Folder that `echotruth release` wrote, or where its files are now: an address such as
        `https://huggingface.co/datasets/NAME/resolve/main`, or `doi:10.5281/zenodo.NUMBER`.
    cases : iterable of str, optional
        Ids of the hearts to fetch, as in its `cases.csv`. Default: all.
    to : str or Path, optional
        Folder for the repository. Default: one for this source in the user's cache, below `echotruth`.

    Returns
    -------
    Repository
        Hearts that were not asked for are in its table, and have no arrays yet.

    Raises
    ------
    FetchError
        If a file cannot be had, is damaged, is not that of a release, or stands where one of them would be written.
    ValueError
        If there is no such heart.

    Examples
    --------
    >>> import echotruth as et
    >>> hearts = et.fetch("https://example.org/hearts", cases=["healthy"])  # doctest: +SKIP
    >>> et.fetch("absent", to="data")
    Traceback (most recent call last):
    ...
    echotruth.sharing.fetching.FetchError: absent/registry.txt: is not there: give the folder or address of a release
    """
    release = _Release(str(source).rstrip("/"), to)
    rows = release.parts()
    hearts = [row for row in rows if row["holds"] == HEARTS]
    wanted = chosen("case", cases, list(dict.fromkeys(row["case"] for row in hearts)))
    needed = [row for row in rows if row["holds"] == STRUCTURE] + [row for row in hearts if row["case"] in wanted]
    name = release.name(rows)
    for part in dict.fromkeys(row["part"] for row in needed):
        release.unpack(part, name)
    return Repository(release.repository(name))


class _Release:
    """A release, and the folder that it is fetched to; in `.release` there is what it was fetched with, by source."""

    def __init__(self, source: str, to: str | Path | None) -> None:
        import pooch

        self.source, is_remote = source, "://" in source or source.startswith("doi:")
        key = source if is_remote else str(Path(source).absolute())
        digest = sha256(key.encode()).hexdigest()[:12]
        self.folder = (
            Path(to).absolute() if to is not None else Path(user_cache() or pooch.os_cache("echotruth"), digest)
        )
        self.parts_folder = self.folder / ".release" / digest
        self.downloader = None if is_remote else _copy
        tries = 3 if is_remote else 1
        self.pooch = pooch.create(self.parts_folder, f"{source}/", registry={REGISTRY: None}, retry_if_failed=tries - 1)
        self._load_registry()

    def _load_registry(self) -> None:
        """Fetch the registry, or take that of the last time where there is none now."""
        path = self.parts_folder / REGISTRY
        known = path.read_bytes() if path.is_file() else None
        path.unlink(missing_ok=True)
        try:
            self._file(REGISTRY)
        except FetchError:
            if known is None:
                raise
            path.write_bytes(known)
        try:
            self.pooch.load_registry(path)
            if not all(CHECKSUM.fullmatch(known) for name, known in self.pooch.registry.items() if name != REGISTRY):
                raise ValueError
        except (OSError, ValueError):
            path.unlink()
            raise FetchError(f"{self.source}/{REGISTRY}: is not the registry of a release: {REMEDY}") from None

    def parts(self) -> list[dict[str, str]]:
        """Table of the parts: part, what it holds, case."""
        text = self._file(PARTS).read_text(encoding="utf-8", errors="replace")
        try:
            rows = list(csv.DictReader(StringIO(text)))
        except csv.Error:
            rows = []
        if not rows or not {"part", "holds", "case"} <= rows[0].keys():
            raise FetchError(f"{self.source}/{PARTS}: is not the table of a release: {REMEDY}")
        return [{name: row[name] or "" for name in ("part", "holds", "case")} for row in rows]

    def name(self, rows: list[dict[str, str]]) -> str:
        """Name of the repository, given the table of the parts."""
        names = [row["part"].removesuffix(f"-{STRUCTURE}.zip") for row in rows if row["holds"] == STRUCTURE]
        if len(names) != 1:
            raise FetchError(f"{self.source}: its parts hold no repository: {REMEDY}")
        return names[0]

    def repository(self, name: str) -> Path:
        """Folder of the repository, once its parts are unpacked."""
        if not (self.folder / name / "config.yaml").is_file():
            raise FetchError(f"{self.source}: its parts hold no repository: {REMEDY}")
        return self.folder / name

    def unpack(self, part: str, name: str) -> None:
        """Fetch a part and unpack it into the folder of the repository, unless a note has its checksum."""
        note, checksum = self.parts_folder / f".{part}.unpacked", str(self.pooch.registry.get(part))
        if note.is_file() and note.read_text(encoding="utf-8") == checksum:
            return
        path = self._file(part)
        home, begun = self.folder / name, self.parts_folder / f".begun-{name}"
        if not begun.is_file() and (home.exists() or home.is_symlink()):
            remedy = "remove it, or give another folder"
            raise FetchError(f"{home}: is there, and this release did not write it: {remedy}")
        try:
            with ZipFile(path) as archive:
                _check_members(archive, name)
                begun.touch()
                archive.extractall(self.folder)
        except OSError as error:
            remedy = "it must be a folder that you may write to, with space; the same call goes on"
            raise FetchError(
                f"{self.folder}: {part} cannot be unpacked ({error.strerror or error}): {remedy}"
            ) from None
        except Exception as error:  # ZipFile has no common type for what is wrong with an archive
            problem = _line(error) or "it is cut off"
            raise FetchError(f"{self.source}/{part}: is not a part of a release ({problem}): {REMEDY}") from None
        note.write_text(checksum, encoding="utf-8")
        path.unlink()

    def _file(self, name: str) -> Path:
        """A file of the release, fetched and compared with its checksum unless that is done."""
        address = f"{self.source}/{name}"
        is_strange = Path(name).name != name or name.startswith(".")  # with a dot, it could pass for a note
        if is_strange or name not in self.pooch.registry:
            raise FetchError(f"{self.source}/{REGISTRY}: has no file {name!r}: the release is not whole")
        try:
            return Path(self.pooch.fetch(name, downloader=self.downloader))
        except FileNotFoundError:
            raise FetchError(f"{address}: is not there: {REMEDY}") from None
        except ValueError as error:
            said = f"is damaged, its SHA-256 is not that of {REGISTRY}: fetch it again, or tell those who published it"
            problem = said if "hash" in str(error) else f"cannot be had ({_line(error)}): {REMEDY}"
            raise FetchError(f"{address}: {problem}") from None
        except OSError as error:
            from requests.exceptions import ConnectionError as NoConnection  # by which pooch downloads

            offline = "no connection: see that you are online and the address is right"
            said = offline if isinstance(error, NoConnection) else _line(error)
            remedy = "what was fetched stays, and the same call goes on"
            raise FetchError(f"{address}: cannot be had ({said}): {remedy}") from None


def _check_members(archive: ZipFile, name: str) -> None:
    """Refuse an archive of which a file is not below a folder, or is larger than it is in the archive.

    Links are no danger, as :meth:`ZipFile.extractall` writes them as files, and leaves out `..` in names.
    """
    for entry in archive.infolist():
        if entry.compress_type != ZIP_STORED:
            raise BadZipFile("its files are compressed")
        if not entry.filename.startswith(f"{name}/"):
            raise BadZipFile(f"{entry.filename[:80]!r} is no file below {name[:80]}")


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _copy(address: str, output: Any, _: Any) -> None:
    """Copy a file of a folder, as pooch downloads one."""
    shutil.copyfile(address, output)
