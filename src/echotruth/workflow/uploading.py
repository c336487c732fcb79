"""Upload of a repository beside its run, and the command `echotruth upload`."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from echotruth.repository.ledger import NOT_A_REPOSITORY
from echotruth.repository.remote import Remote, RemoteError
from echotruth.repository.upload import Upload

POLL_SECONDS = 2.0
"""Interval at which the ledger is read, at least; and ten times as long as that takes, so that it costs little."""
RETRY_SECONDS = 60.0
"""Time after which an upload that failed is tried again."""
NOT_UPLOADED = 3
"""Exit status of a run that made everything, but could not upload it."""


class Uploading:
    """Upload of what a run commits, in a thread of its own.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist yet.
    remote : Remote
        Folder in object storage.
    """

    def __init__(self, folder: Path, remote: Remote) -> None:
        self._folder, self._remote = folder, remote
        self._ended, self._stopped, self._error = threading.Event(), threading.Event(), ""
        self._upload = Upload(folder, remote, self._stopped)
        self._thread = threading.Thread(target=self._follow, name="upload", daemon=True)
        self._thread.start()

    def finish(self) -> int:
        """Send the rest, tell what is there, and return 0; or `NOT_UPLOADED` if not all of it is."""
        self._ended.set()
        self._thread.join()
        try:
            total = self._upload.send()
        except OSError as error:
            print(f"echotruth: not uploaded: {error}; then: {self._command}", file=sys.stderr)
            return NOT_UPLOADED
        for fault in total.faults:
            print(f"echotruth: not uploaded: {fault}", file=sys.stderr)
        print(f"\nUploaded:   {self._remote.url} ({_summary(self._upload)})")
        return NOT_UPLOADED if total.faults else 0

    def stop(self) -> None:
        """End before the next file."""
        self._ended.set()
        self._stopped.set()

    def _follow(self) -> None:
        wait = POLL_SECONDS
        while not self._ended.wait(wait):
            start = time.monotonic()
            try:
                self._upload.send()
                wait = max(POLL_SECONDS, 10 * (time.monotonic() - start))
            except OSError as error:
                if str(error) != self._error:
                    print(f"echotruth: not uploaded yet: {error}", file=sys.stderr)
                self._error, wait = str(error), RETRY_SECONDS

    @property
    def _command(self) -> str:
        return f"echotruth upload {self._folder} {self._remote.url}"


@contextmanager
def uploading(folder: Path, remote: Remote) -> Iterator[Uploading]:
    """Upload what is committed within."""
    upload = Uploading(folder, remote)
    try:
        yield upload
    finally:
        upload.stop()


def upload_repository(folder: Path, url: str, reading_back: bool) -> int:
    """Upload what is not there, and tell what is.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    url : str
        s3://BUCKET/FOLDER.
    reading_back : bool
        Whether to read everything there and compare it with what is here; what is damaged there is sent again.

    Returns
    -------
    int
        0 if everything is there, 1 if something here or there is damaged, 2 if it cannot be uploaded.
    """
    try:
        if not (folder / "config.yaml").is_file():
            raise RemoteError(f"{folder}: {NOT_A_REPOSITORY}")
        upload = Upload(folder, Remote(url))
        faults = list(upload.send().faults)
        if reading_back:
            damaged = upload.differing()
            left = upload.send_again(damaged)
            for name in sorted({*damaged} - {*left}):
                print(f"{url}/{name}: differed from {folder / name}, and was sent again")
            faults += [f"{url}/{name}: differs from {folder / name}: echotruth check {folder}" for name in left]
        others = upload.others()
    except OSError as error:
        print(f"echotruth: {error}", file=sys.stderr)
        return 2
    for fault in faults:
        print(f"echotruth: {fault}", file=sys.stderr)
    if others and not faults:
        print(f"{url}: holds {len(others)} objects of which this repository has no file, first: {others[0]}")
    print(f"{url}: {_summary(upload)}")
    if reading_back and not faults:
        print(f"{url}: read back all {len(upload.total.names)} files; each is the same as here")
    return 1 if faults else 0


def _summary(upload: Upload) -> str:
    total = upload.total
    return f"{len(total.names)} files; sent: {total.sent}, {total.size / 1e6:.1f} MB"
