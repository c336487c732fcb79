"""Upload of a repository to object storage, where it has the same files under the same names.

The ledger says what goes up: the files of a record first, then the record that vouches for them, so that at any time
the records there vouch for what is there. Where a record has changed, the old one is removed before its files are
replaced. What is there with the same checksum is not sent again.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from threading import Event, Lock

from echotruth.repository import ledger
from echotruth.repository.remote import Remote, RemoteError

THREADS = 16
"""Files sent at the same time."""
FIGURES = "figures"
"""Folder that goes up beside the hierarchy and the ledger, as the files in the folder of the repository do."""


@dataclass
class Sent:
    """What an upload found and sent."""

    sent: int = 0
    """Number of files sent."""
    size: int = 0
    """Their size, bytes."""
    names: set[str] = field(default_factory=set)
    """All files that are there now, by their path below the folder of the repository."""
    faults: list[str] = field(default_factory=list)
    """A sentence for every file here that is not what its record says; its record did not go up."""


class Upload:
    """Upload of a repository, as often as it has changed.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    remote : Remote
        Folder in object storage.
    stopped : Event, optional
        Ends the upload before its next file.

    Attributes
    ----------
    total : Sent
        What was sent in all, and what is there. Its faults are those of the last time.
    """

    def __init__(self, folder: Path, remote: Remote, stopped: Event | None = None) -> None:
        self._folder, self._remote, self._stopped = folder, remote, stopped or Event()
        self._seen: dict[Path, tuple[int, int]] = {}
        self._lock, self._listed = Lock(), False
        self._there: set[str] = set()
        self.total = Sent()

    def send(self) -> Sent:
        """Send what is not there, of what has changed since the last time.

        Raises
        ------
        RemoteError
            If object storage cannot be reached, or refuses; what was sent stays there.
        """
        if not self._listed:
            self._list()
        self.total.faults.clear()
        with ThreadPoolExecutor(THREADS) as pool:
            for path in self._changed():
                if self._stopped.is_set():
                    break
                state = _state(path)
                if state and self._send(path, pool):
                    self._seen[path] = state
        return self.total

    def differing(self) -> list[str]:
        """Files there whose content, read back, is not what is here or was sent."""
        with ThreadPoolExecutor(THREADS) as pool:
            names = sorted(self.total.names)
            return [name for name, whole in zip(names, pool.map(self._is_same, names), strict=True) if not whole]

    def send_again(self, names: list[str]) -> list[str]:
        """Replace objects whose content is not what was sent, where the file here still is; those that still differ.

        Parameters
        ----------
        names : list of str
            As :meth:`differing` returns them.
        """
        for name in names:
            path = self._folder / name
            content = path.read_bytes() if path.is_file() else b""
            # What an object carries says what was sent: a file here that is another one may be the damaged one.
            if self._remote.checksum(name) in ("", sha256(content).hexdigest()) and content:
                self._put(name, content)
        return [name for name in names if not self._is_same(name)]

    def others(self) -> list[str]:
        """Objects there that belong to no file here, sorted."""
        return sorted(self._there - self.total.names)

    def _list(self) -> None:
        """Ask for the names of all that is there, and raise an error if it is another repository."""
        self._there = set(self._remote.names())
        hierarchies = {name.partition("/")[0] for name in self._there if ".zarr/" in name}
        if other := sorted(hierarchies - {self._hierarchy.name}):
            remedy = "give another folder in the bucket"
            raise RemoteError(f"{self._remote.url}: holds another repository, {other[0]}: {remedy}")
        self._listed = True

    def _changed(self) -> list[Path]:
        """Files that have changed: records, those of the structure first, then the others."""
        structure = self._folder / "ledger/structure.json"
        records = sorted(path for path in (self._folder / "ledger").rglob("[!.]*.json") if path != structure)
        others = [path for pattern in ("[!.]*", f"{FIGURES}/[!.]*") for path in sorted(self._folder.glob(pattern))]
        paths = [structure, *records, *(path for path in others if path.is_file())]
        return [path for path in paths if _state(path) not in (None, self._seen.get(path))]

    def _send(self, path: Path, pool: ThreadPoolExecutor) -> bool:
        """Send a file and before it those for which it vouches; return whether all of them are there."""
        try:
            content = path.read_bytes()
            is_record = path.is_relative_to(self._folder / "ledger")
            expected = ledger.read(path).get("sha256", {}) if is_record else {}
        except FileNotFoundError:  # withdrawn in this moment
            return False
        except ValueError:
            self.total.faults.append(f"{path}: is damaged")
            return False
        name = self._name(path)
        is_there = self._is_there(name, sha256(content).hexdigest())
        if name in self._there and not is_there:
            self._remote.delete(name)
            self._there.remove(name)
        files = {self._hierarchy / file: checksum for file, checksum in expected.items()}
        faults = [fault for fault in pool.map(self._send_vouched, files, files.values()) if fault]
        self.total.faults += faults
        if faults or self._stopped.is_set():
            return False
        if not is_there:
            self._put(name, content)
        self.total.names |= {name, *map(self._name, files)}
        return True

    def _send_vouched(self, file: Path, checksum: str) -> str:
        """Send a file if it is not there; return what is wrong with it."""
        name = self._name(file)
        if self._stopped.is_set() or self._is_there(name, checksum):
            return ""
        content = file.read_bytes() if file.is_file() else b""
        if sha256(content).hexdigest() != checksum:
            return f"{file}: is missing or differs from what was written: echotruth check {self._folder}"
        self._put(name, content)
        return ""

    def _put(self, name: str, content: bytes) -> None:
        self._remote.put(name, content)
        with self._lock:
            self._there.add(name)
            self.total.sent += 1
            self.total.size += len(content)

    @property
    def _hierarchy(self) -> Path:
        """Folder NAME.zarr, which need not be there yet."""
        return next(self._folder.glob("*.zarr"), self._folder / f"{self._folder.resolve().name}.zarr")

    def _is_there(self, name: str, checksum: str) -> bool:
        return name in self._there and self._remote.checksum(name) == checksum

    def _is_same(self, name: str) -> bool:
        try:
            return sha256(self._remote.get(name)).digest() == sha256((self._folder / name).read_bytes()).digest()
        except FileNotFoundError:
            return False

    def _name(self, path: Path) -> str:
        return path.relative_to(self._folder).as_posix()


def _state(path: Path) -> tuple[int, int] | None:
    """Time of the last change, ns, and size, bytes; None if there is no file."""
    try:
        status = path.stat()
    except FileNotFoundError:
        return None
    return status.st_mtime_ns, status.st_size
