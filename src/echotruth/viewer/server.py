"""The server of the viewer, on this machine alone."""

import signal
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.document import Document
from bokeh.models import Div
from bokeh.server.server import BaseServer
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop

from echotruth.config.loading import ConfigError
from echotruth.repository.choice import require_slices
from echotruth.repository.reader import Repository
from echotruth.viewer.access import Access
from echotruth.viewer.choice import asked
from echotruth.viewer.page import Page

LOCAL = "localhost"


class ShowError(ValueError):
    """Raised if a repository cannot be shown."""


def serve(repository: str | Path, port: int = 0) -> BaseServer:
    """Start a server that answers to this machine alone.

    Parameters
    ----------
    repository : str or Path
        `out/NAME`, `out/NAME/NAME.zarr`, or the address `s3://BUCKET/FOLDER`.
    port : int
        Default: any that is free.

    Returns
    -------
    BaseServer
        Listening; its `io_loop` is to be started.

    Raises
    ------
    ConfigError, OSError, ShowError
        If there is nothing to show that can be read, or the port is in use.
    """
    opened(repository)  # so that what cannot be shown is said at once

    def page(document: Document) -> None:
        context = document.session_context
        query = context.request.arguments if context is not None and context.request is not None else {}
        try:
            now = opened(repository)  # a run may be going on
            Page(now, *asked(now, texts(query)), document)
        except Exception as error:  # the folder may be gone, and what is damaged fails in many ways
            said = str(error).removeprefix(f"{repository}: ")
            document.add_root(Div(text=escape(f"{repository} cannot be shown: {said}"), name="message"))

    access = Access(Application(FunctionHandler(page)))
    http = HTTPServer(access, max_body_size=0)
    try:
        http.listen(port, LOCAL)
    except OSError as error:
        raise ShowError(f"port {port}: {error.strerror or error}: give another with --port, or leave it out") from None
    server = BaseServer(IOLoop.current(), access, http)
    server.start()
    return server


def texts(query: Mapping[str, Sequence[bytes]]) -> dict[str, list[str]]:
    """Values of a query as text, whatever bytes an address has."""
    return {name: [value.decode(errors="replace") for value in values] for name, values in query.items()}


def opened(repository: str | Path) -> Repository:
    """A repository that has something to show.

    Raises
    ------
    ConfigError, OSError, ShowError
        If the folder holds no repository, or one that is damaged or without cases.
    """
    try:
        found = Repository(repository)
        is_empty = not found.present
    except (ConfigError, OSError):
        raise
    except Exception as error:  # Zarr raises many kinds of what is damaged
        said = str(error).partition("\n")[0] or type(error).__name__
        raise ShowError(f"{repository}: cannot be read ({said}): run echotruth check {repository}") from error
    if is_empty:
        raise ShowError(f"{repository}: has no cases: run its configuration, which writes them into cases.csv")
    require_slices(found.config, "the viewer")
    return found


def address(server: BaseServer) -> str:
    """Address of the page."""
    return f"http://{LOCAL}:{server.port}/"


def run(server: BaseServer, ready: Callable[[], None]) -> None:
    """Answer until the process is interrupted or asked to end.

    Parameters
    ----------
    server : BaseServer
    ready : callable
        Called once the server answers.
    """
    server.io_loop.add_callback(ready)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: server.io_loop.add_callback_from_signal(server.io_loop.stop))
    server.io_loop.start()
    server.stop()
