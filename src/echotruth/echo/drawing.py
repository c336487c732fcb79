"""The page on which the wall of a ventricle is drawn in a clip, served to this machine alone."""

import json
import re
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, get_args
from urllib.parse import urlsplit

import cv2
import numpy as np
import xarray as xr
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from echotruth.echo.failure import FEWEST_FRAMES, EchoError
from echotruth.echo.wall import PARTS, View, Wall, clicked_points, read_wall, write_wall
from echotruth.echo.wall_file import Excerpt, part, said

LOCAL = "127.0.0.1"

HOSTS = (LOCAL, "localhost")
"""Names by which the page may be asked for: under another, a page of the web could pass for it (DNS rebinding)."""

MAX_BODY = 1_000_000
"""Size of what may be sent to be saved, bytes."""

PAGE = {
    "/": ("drawing.html", "text/html"),
    **{f"/{name}": (name, "text/javascript") for name in ("drawing.js", "curve.js")},
}
"""Path -> file beside this one, and its kind."""

FRAME = re.compile(r"/frame/([0-9]{1,9})\.png")
"""Path of a frame."""

HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}
"""What every answer says: the page loads nothing from elsewhere, and no other page may show its images."""

Coordinate = Annotated[float, Field(ge=-1e5, le=1e5)]
Point = tuple[Coordinate, Coordinate]
Border = Annotated[list[Point], Field(max_length=10_000)]


class Drawn(BaseModel):
    """What the page sends: a view, borders as points at about 1 px, of which some were clicked, and insertions.

    Points are lateral and axial, px; of those that were clicked the number along the border is given. End-diastole and
    the next one are frames of the clip that is shown; the next may be the frame after its last.
    """

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    view: str
    endocardium: Border
    epicardium: Border
    endocardium_clicked: Annotated[list[int], Field(max_length=10_000)] = []
    epicardium_clicked: Annotated[list[int], Field(max_length=10_000)] = []
    anterior_insertion: Point | None = None
    inferior_insertion: Point | None = None
    cycle: tuple[int, int] | None = None


@dataclass
class Drawing:
    """A clip, and the wall that is drawn in it at end-diastole.

    Attributes
    ----------
    clip : Dataset
        As :func:`echotruth.read_clip` returns it.
    output : Path
        The .csv that is written.
    begin : Path, optional
        Wall that is corrected.

    Raises
    ------
    EchoError
        If the output is no .csv, there is no wall to be corrected in `begin`, or the clip does not hold its cycle.
    """

    clip: xr.Dataset
    output: Path
    begin: Path | None = None

    def __post_init__(self) -> None:
        if self.output.suffix.lower() != ".csv" or self.output.is_dir():
            raise EchoError(f"{self.output}: cannot hold a wall: give a file of which the name ends in .csv")
        if self.begin is not None and not self.begin.is_file():
            raise EchoError(f"{self.begin}: is not there: give a wall to be corrected, or none to draw a new one")
        if self.begin is None and self.output.is_file():
            self.begin = self.output
        self._cycle(self.wall())  # so that what cannot be corrected is said at once

    @property
    def shape(self) -> tuple[int, int]:
        """Axial and lateral size of the image, px."""
        _, axial, lateral = self.clip["image"].shape
        return axial, lateral

    def wall(self) -> Wall | None:
        """The wall that is corrected, or that was saved last."""
        if self.begin is None or (self.begin == self.output and not self.output.exists()):  # removed since it was saved
            return None
        # The page asks for the view of a file that names none.
        return read_wall(self.begin, said(self.begin, "view") or "short_axis")

    @property
    def _shown(self) -> Excerpt:
        """Frames and pixels of the recording that the page shows."""
        frames, axial, lateral = self.clip["image"].shape
        return part(self.clip.attrs.get("part", "")) or Excerpt((0, frames), (0, 0, lateral, axial))

    def _cycle(self, wall: Wall | None) -> tuple[int, int]:
        """Frames of the page at end-diastole and the next: those of the wall, or the first and the end of the clip.

        Raises
        ------
        EchoError
            If the clip does not hold those of the wall.
        """
        start, stop = self._shown.cycle
        drawn = part(wall.part) if wall else None
        first, last = drawn.cycle if drawn else (start, stop)
        if not start <= first < last <= stop:
            raise EchoError(
                f"{self.begin}: was drawn in frames {first} to {last}, and the clip shows {start} to {stop}: give a "
                "cycle that holds them, or draw a new wall into another file"
            )
        return first - start, last - start

    def _clicked(self) -> dict[str, list[list[float]]]:
        """Points that were clicked, of the borders of which the file says them."""
        if self.begin is None or self.begin.suffix.lower() != ".csv" or not self.begin.is_file():
            return {}
        return {part: points.tolist() for part, points in clicked_points(self.begin).items() if len(points) > 2}

    def description(self) -> dict[str, Any]:
        """What the page has to know."""
        wall, clicked = self.wall(), self._clicked()
        return {
            "source": Path(self.clip.attrs["source"]).name,
            "output": str(self.output),
            "replaces": self.output.exists(),
            "frames": self.clip.sizes["frame"],
            "cycle": self._cycle(wall),
            "fewest_frames": FEWEST_FRAMES,
            "width": self.shape[1],
            "height": self.shape[0],
            "spacing_mm": 1e3 * self.clip.attrs["spacing"],
            "time_ms": (1e3 * self.clip["time"].values).round(3).tolist(),
            "views": list(get_args(View)),
            "wall": None if wall is None else _points(wall) | clicked | {"view": wall.view},
            "clicked": list(clicked),
        }

    def frame(self, number: int) -> bytes:
        """A frame as PNG."""
        return cv2.imencode(".png", self.clip["image"].values[number])[1].tobytes()

    def save(self, body: bytes) -> dict[str, Any]:
        """Check what the page sends, and write it.

        Parameters
        ----------
        body : bytes
            JSON of :class:`Drawn`.

        Returns
        -------
        dict
            The file that was written, and the mean thickness of the wall, mm.

        Raises
        ------
        EchoError
            If it is no wall in this clip, or cannot be written.
        """
        drawn = _parsed(body)
        wall = self._checked(drawn)
        wall.mask(self.shape)
        clicked = {
            "endocardium": np.isin(np.arange(len(wall.endocardium)), drawn.endocardium_clicked),
            "epicardium": np.isin(np.arange(len(wall.epicardium)), drawn.epicardium_clicked),
        }
        try:
            write_wall(self.output, wall, clicked)
        except OSError as error:
            raise EchoError(f"{self.output}: {error.strerror}: see that you may write there") from None
        self.begin = self.output
        return {"saved": str(self.output), "thickness_mm": 1e3 * self.clip.attrs["spacing"] * wall.thickness()}

    def _checked(self, drawn: Drawn) -> Wall:
        """Wall of what the page sends."""
        given = [getattr(drawn, name) for name in PARTS[2:]]
        if given.count(None) == 1:
            raise EchoError(f"{PARTS[2 + given.index(None)]}: is missing: click both insertions, or none")
        insertions = None if None in given else np.array(given)
        borders = np.array(drawn.endocardium), np.array(drawn.epicardium)
        first, stop = drawn.cycle or (0, self.clip.sizes["frame"])
        if not 0 <= first <= stop - FEWEST_FRAMES <= self.clip.sizes["frame"] - FEWEST_FRAMES:
            raise EchoError(f"cycle: frames {first} to {stop} are none of {FEWEST_FRAMES} or more frames of the clip")
        start = self._shown.cycle[0]
        return Wall(*borders, drawn.view, insertions, str(Excerpt((start + first, start + stop), self._shown.crop)))


def _points(wall: Wall) -> dict[str, list[list[float]]]:
    """Points of each part."""
    insertions = [[], []] if wall.insertions is None else [[point.tolist()] for point in wall.insertions]
    return dict(zip(PARTS, [wall.endocardium.tolist(), wall.epicardium.tolist(), *insertions], strict=True))


def _parsed(body: bytes) -> Drawn:
    try:
        return Drawn.model_validate_json(body)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(key) for key in first["loc"]) or "what is sent"
        raise EchoError(f"{place}: {first['msg']}") from None


class DrawingServer(ThreadingHTTPServer):
    """Server of one drawing, which answers to this machine alone.

    Parameters
    ----------
    drawing : Drawing
    port : int
        Default: any that is free.

    Raises
    ------
    EchoError
        If the port is in use.
    """

    def __init__(self, drawing: Drawing, port: int = 0) -> None:
        self.drawing = drawing
        try:
            super().__init__((LOCAL, port), _Handler)
        except OSError as error:
            reason = error.strerror or error
            raise EchoError(f"port {port}: {reason}: give another with --port, or leave it out") from None

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{LOCAL}:{self.server_port}/"

    def run(self, ready: Callable[[], None]) -> None:
        """Answer until the process is interrupted or asked to end.

        Parameters
        ----------
        ready : callable
            Called once the server can be asked.
        """
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            ready()
            self.serve_forever()
        except KeyboardInterrupt:
            pass
        finally:
            self.server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that went away."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers to one request."""

    server: DrawingServer
    timeout = 30  # s, for a request that never ends

    def do_GET(self) -> None:
        """The page, what it has to know, or a frame."""
        drawing, path = self.server.drawing, urlsplit(self.path).path
        if not self._is_ours():
            return
        if path in PAGE:
            name, kind = PAGE[path]
            self._answer(HTTPStatus.OK, (files("echotruth.echo") / name).read_bytes(), f"{kind}; charset=utf-8")
        elif path == "/clip.json":
            self._try(drawing.description)
        elif (match := FRAME.fullmatch(path)) and int(match[1]) < drawing.clip.sizes["frame"]:
            self._answer(HTTPStatus.OK, drawing.frame(int(match[1])), "image/png")
        else:
            self._say(HTTPStatus.NOT_FOUND, f"{path}: is not there")

    def do_POST(self) -> None:
        """Save."""
        if not self._is_ours():
            return
        length = self.headers.get("Content-Length", "")
        if urlsplit(self.path).path != "/save":
            self._say(HTTPStatus.NOT_FOUND, f"{self.path}: is not there")
        elif not (length.isascii() and length.isdigit()):
            self._say(HTTPStatus.LENGTH_REQUIRED, "Content-Length: is missing")
        elif len(length) > 9 or int(length) > MAX_BODY:
            self._say(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"{length} bytes are too many: send {MAX_BODY} or less")
        else:
            body = self.rfile.read(int(length))
            self._try(lambda: self.server.drawing.save(body))

    def _is_ours(self) -> bool:
        """Refuse what another page sends: browsers say for which host a request is, and from which page it comes."""
        host = self.headers.get("Host", "")
        origin = self.headers.get("Origin")
        ours = host.partition(":")[0] in HOSTS and origin in (None, f"http://{host}")
        if not ours:
            self._say(HTTPStatus.FORBIDDEN, f"this page answers at {self.server.address} alone")
        return ours

    def _try(self, act: Callable[[], dict[str, Any]]) -> None:
        """Answer with what a function returns, or with why it cannot."""
        try:
            self._answer(HTTPStatus.OK, json.dumps(act(), allow_nan=False).encode(), "application/json")
        except EchoError as error:
            self._say(HTTPStatus.BAD_REQUEST, str(error))
        except OSError as error:
            self._say(HTTPStatus.INTERNAL_SERVER_ERROR, f"{error.filename}: {error.strerror}")

    def _say(self, status: HTTPStatus, error: str) -> None:
        self._answer(status, json.dumps({"error": error}).encode(), "application/json")

    def _answer(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": kind, "Content-Length": str(len(content)), **HEADERS}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Say nothing of requests."""
