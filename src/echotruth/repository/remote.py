"""A folder in object storage (S3), to be read: objects by their name.

Where it is, and who asks, is said by the environment variables of AWS that :class:`obstore.store.S3Store` reads:
AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION, AWS_ENDPOINT_URL and others.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from echotruth.extras import optional

if TYPE_CHECKING:
    from obstore.store import S3Store
    from zarr.storage import ObjectStore

T = TypeVar("T")

MAX_RETRIES, RETRY_SECONDS = 3, 60
"""Failed requests are sent again so often, and no longer than that."""
CONNECT_SECONDS, REQUEST_SECONDS = 10, 300
REMEDY = "check the address and the variables AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION and AWS_ENDPOINT_URL"


class RemoteError(OSError):
    """Raised if object storage cannot be reached, or refuses what is asked."""


def is_url(place: str | Path) -> bool:
    """Whether a place is an address rather than a folder."""
    return isinstance(place, str) and "://" in place


class Remote:
    """A folder in a bucket.

    Parameters
    ----------
    url : str
        s3://BUCKET/FOLDER, or s3://BUCKET.

    Raises
    ------
    RemoteError
        If the address is not one, or the package obstore is missing.
    """

    def __init__(self, url: str) -> None:
        if not re.fullmatch(r"s3://[^/\s]+(/\S*)?", url):
            raise RemoteError(f"{url}: is not an address in object storage: give s3://BUCKET/FOLDER")
        self.url, self._api = url.rstrip("/"), optional("obstore", "s3", RemoteError, f"{url}: ")
        self.store = self._asked(lambda: _store(self.url))

    def __reduce__(self) -> tuple[type[Remote], tuple[str]]:
        """Another process opens the address anew."""
        return type(self), (self.url,)

    def get(self, name: str) -> bytes:
        """Read an object; a FileNotFoundError is raised if it is not there."""
        return self._asked(lambda: bytes(self._api.get(self.store, name).bytes()))

    def hierarchies(self) -> list[str]:
        """Names of the Zarr hierarchies, as `demo.zarr`."""
        found = self._asked(lambda: self._api.list_with_delimiter(self.store))
        names = (prefix.rstrip("/").rpartition("/")[2] for prefix in found["common_prefixes"])
        return sorted(name for name in names if name.endswith(".zarr"))

    def _asked(self, request: Callable[[], T]) -> T:
        """Answer to a request; a failure is a sentence."""
        from obstore.exceptions import BaseError

        try:
            return request()
        except (BaseError, ValueError) as error:
            raise RemoteError(f"{self.url}: {_reason(error)}: {REMEDY}") from None


def hierarchy(url: str) -> tuple[Remote, ObjectStore]:
    """Open a repository in object storage, to be read: its folder, and its Zarr hierarchy.

    Parameters
    ----------
    url : str
        Address of a repository, or of its folder `NAME.zarr`.

    Raises
    ------
    RemoteError
        If it cannot be reached.
    FileNotFoundError
        If there is no repository.
    """
    from zarr.storage import ObjectStore

    parent, _, name = url.rstrip("/").rpartition("/")
    folder = Remote(parent if name.endswith(".zarr") else url)
    names = folder.hierarchies()
    if len(names) != 1:
        raise FileNotFoundError(f"{url}: is not a repository: give an address to which one was uploaded")
    return folder, ObjectStore(Remote(f"{folder.url}/{names[0]}").store, read_only=True)


def size(store: Any, name: str) -> int:
    """Bytes of an object of a hierarchy; 0 if it is not there."""
    import obstore

    try:
        return int(obstore.head(store.store, name)["size"])
    except FileNotFoundError:
        return 0


def _store(url: str) -> S3Store:
    from obstore.store import S3Store

    connecting, request = (timedelta(seconds=seconds) for seconds in (CONNECT_SECONDS, REQUEST_SECONDS))
    return S3Store.from_url(
        url,
        # Whoever gives an endpoint without encryption, as of a server on the own machine, wants that one.
        client_options={"allow_http": True, "connect_timeout": connecting, "timeout": request},
        retry_config={"max_retries": MAX_RETRIES, "retry_timeout": timedelta(seconds=RETRY_SECONDS)},
    )


def _reason(error: Exception) -> str:
    """What went wrong: the message of the server, if it gave one."""
    text = str(error).partition("\n\nDebug source")[0]
    found = re.search(r"<Message>(.+?)</Message>", text, re.DOTALL)
    return " ".join((found[1] if found else text.rpartition(" - ")[2]).split()).rstrip(".:")
