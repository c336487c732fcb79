"""Fetching a release: its parts from a folder, a web server or an archive with a DOI, unpacked to a repository.

Parts are downloaded by pooch, which compares each with its checksum in the registry. A part that is unpacked leaves a
note of it and is deleted, so that what broke off goes on with the part that was under way.
"""

import csv
import shutil
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_STORED, BadZipFile, ZipFile

from echotruth.repository.choice import Names, chosen
from echotruth.repository.reader import Repository

REGISTRY, PARTS = "registry.txt", "parts.csv"
"""Names of the files of a release that say what the others are."""
STRUCTURE, HEARTS = "structure", "hearts"
"""What the parts hold that make up the repository."""
UNPACKED = ".unpacked"
"""Suffix of the note that a part is unpacked, which holds its checksum."""


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
        If a file cannot be had, is damaged, or is not that of a release.
    ValueError
        If there is no such heart.

    Examples
    --------
    >>> import echotruth as et
    >>> hearts = et.fetch("https://example.org/hearts", cases=["healthy"])  # doctest: +SKIP
    >>> et.fetch("absent", to="data")
    Traceback (most recent call last):
    ...
    echotruth.repository.fetching.FetchError: absent/registry.txt: is not there: give the folder or address of a release
    """
    release = _Release(str(source).rstrip("/"), to)
    rows = release.parts()
    wanted = chosen("case", cases, list(dict.fromkeys(row["case"] for row in rows if row["holds"] == HEARTS)))
    needed = [row for row in rows if row["holds"] == STRUCTURE or (row["holds"] == HEARTS and row["case"] in wanted)]
    for name in dict.fromkeys(row["part"] for row in needed):
        release.unpack(name)
    return Repository(release.repository(rows))


class _Release:
    """A release, and the folder that it is fetched to; in `.release` there is what it was fetched with, by source."""

    def __init__(self, source: str, to: str | Path | None) -> None:
        import pooch

        self.source, is_remote = source, "://" in source or source.startswith("doi:")
        key = source if is_remote else str(Path(source).absolute())
        digest = sha256(key.encode()).hexdigest()[:12]
        self.folder = Path(to).absolute() if to is not None else Path(pooch.os_cache("echotruth"), digest)
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
        except (OSError, UnicodeDecodeError):
            path.unlink()
            raise FetchError(f"{self.source}/{REGISTRY}: is not the registry of a release: {REMEDY}") from None

    def parts(self) -> list[dict[str, str]]:
        """Table of the parts: part, what it holds, case."""
        rows = list(csv.DictReader(StringIO(self._file(PARTS).read_text(encoding="utf-8", errors="replace"))))
        if not rows or not {"part", "holds", "case"} <= rows[0].keys():
            raise FetchError(f"{self.source}/{PARTS}: is not the table of a release: {REMEDY}")
        return [{name: row[name] or "" for name in ("part", "holds", "case")} for row in rows]

    def unpack(self, name: str) -> None:
        """Fetch and unpack a part, unless that is done."""
        note, checksum = self.parts_folder / f"{name}{UNPACKED}", self.pooch.registry.get(name)
        if checksum and note.is_file() and note.read_text() == checksum:
            return
        path = self._file(name)
        try:
            with ZipFile(path) as archive:
                if any(entry.compress_type != ZIP_STORED for entry in archive.infolist()):
                    raise BadZipFile("its files are compressed")
                archive.extractall(self.folder)
        except (BadZipFile, ValueError, RuntimeError) as error:  # what ZipFile raises of archives made otherwise
            raise FetchError(f"{self.source}/{name}: is not a part of a release ({_line(error)}): {REMEDY}") from None
        except OSError as error:
            remedy = "it must be a folder that you may write to, with space; the same call goes on"
            raise FetchError(
                f"{self.folder}: {name} cannot be unpacked ({error.strerror or error}): {remedy}"
            ) from None
        note.write_text(str(checksum))
        path.unlink()

    def repository(self, rows: list[dict[str, str]]) -> Path:
        """Folder of the repository, given the table of the parts."""
        names = [row["part"].removesuffix(f"-{STRUCTURE}.zip") for row in rows if row["holds"] == STRUCTURE]
        if len(names) != 1 or not names[0] or not (self.folder / names[0] / "config.yaml").is_file():
            raise FetchError(f"{self.source}: its parts hold no repository: {REMEDY}")
        return self.folder / names[0]

    def _file(self, name: str) -> Path:
        """A file of the release, fetched and compared with its checksum unless that is done."""
        address = f"{self.source}/{name}"
        if Path(name).name != name or name.startswith(".") or name not in self.pooch.registry:
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
            remedy = "what was fetched stays, and the same call goes on"
            raise FetchError(f"{address}: cannot be had ({_line(error)}): {remedy}") from None


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _copy(address: str, output: Any, _: Any) -> None:
    """Copy a file of a folder, as pooch downloads one."""
    shutil.copyfile(address, output)
