"""What the server of the viewer answers: its own page, and only so many at a time."""

from http import HTTPStatus
from typing import Any

from bokeh.server.tornado import BokehTornado
from tornado.httputil import HTTPServerRequest
from tornado.web import RequestHandler

HOSTS = ("localhost", "127.0.0.1", "[::1]")
"""Names by which the page may be asked for: under another, a page of the web could pass for it (DNS rebinding)."""
MAX_PAGES = 20
"""Pages that are open, or were closed less than :data:`UNUSED` ago: each takes some 2 MB and more with its clips."""
UNUSED, CHECKED = 60_000, 5_000
"""Time after which a page without a connection is forgotten, long enough to load the scripts, and time between looks
for such pages, ms."""


class Access(BokehTornado):
    """Bokeh's application for one page, which answers in a sentence what it does not serve.

    Parameters
    ----------
    application : Application
        What makes the page.
    """

    def __init__(self, application: Any) -> None:
        super().__init__(
            application,
            extra_websocket_origins=[f"{name}:*" for name in HOSTS],
            unused_session_lifetime_milliseconds=UNUSED,
            check_unused_sessions_milliseconds=CHECKED,
        )

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        """Handler of a request, as :class:`tornado.routing.Router` asks for it before anything else is done."""
        refused = self._refusal(request)
        if refused is None:
            return super().find_handler(request, **kwargs)
        status, sentence = refused
        return self.get_handler_delegate(request, Refusal, {"status": status, "sentence": sentence})

    def _refusal(self, request: HTTPServerRequest) -> tuple[HTTPStatus, str] | None:
        """Status and sentence for what is not served, in the order in which it may be said."""
        if request.host_name not in HOSTS or request.headers.get("Origin") not in (None, f"http://{request.host}"):
            return HTTPStatus.FORBIDDEN, f"This page answers at the names {', '.join(HOSTS)} alone."
        sessions = self.get_sessions("/")
        if request.path == "/ws":
            token = request.headers.get("Sec-WebSocket-Protocol", "").rpartition(",")[2].strip()
            if token not in {session.token for session in sessions}:
                return HTTPStatus.GONE, "This page is no longer known: load it again."
        elif request.path == "/":
            if any(name.startswith("bokeh-") for name in (*request.arguments, *map(str.lower, request.headers))):
                return HTTPStatus.BAD_REQUEST, "Names that begin with bokeh- are not for this page: leave them out."
            if len(sessions) >= MAX_PAGES:
                wait = f"close one, and load this again after {(UNUSED + CHECKED) / 1000:g} s"
                return HTTPStatus.SERVICE_UNAVAILABLE, f"{MAX_PAGES} pages are open, which is the most: {wait}."
        elif not request.path.startswith(("/static/", "/favicon.ico")):
            return HTTPStatus.NOT_FOUND, "There is no such page."
        return None


class Refusal(RequestHandler):
    """An answer of one sentence, whatever the method."""

    def initialize(self, status: HTTPStatus, sentence: str) -> None:
        """Take what is said."""
        self.status, self.sentence = status, sentence

    def prepare(self) -> None:
        """Say it, in place of a method."""
        self.set_status(self.status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{self.sentence}\n")
