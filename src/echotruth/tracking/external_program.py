"""External trackers that are programs: they read one .npz file and write another."""

import os
import signal
import subprocess
from contextlib import suppress
from io import BytesIO
from math import prod
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import IO, Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as npy

from echotruth.tracking.failure import TrackerFailed

MAX_HEADER = 65_536
"""Size of the header of an array, bytes, far above what NumPy writes."""
MAX_NUMBER = 16
"""Size of a number of the longest real type, bytes."""
KEPT_STDERR = 4096
"""Size of the end of what a program says on stderr that is kept, bytes."""


def run(command: list[str], entries: dict[str, Any], timeout: float, shape: tuple[int, ...]) -> Any:
    """Run a program on a clip.

    Parameters
    ----------
    command : list of str
        The program and its arguments; {input} and {output} stand for the paths of the files.
    entries : dict
        Name -> array, number or text of the input file.
    timeout : float
        Longest time that it may take, s.
    shape : tuple of int
        Number of frames, of points, and of components of a displacement.

    Returns
    -------
    ndarray or tuple of two ndarray
        Displacement, (frame, point, component), and quality, (frame, point), if the program writes one.

    Raises
    ------
    TrackerFailed
        If it does not start, fails, takes too long, or writes no file with real numbers of these shapes.
    """
    with TemporaryDirectory(prefix="echotruth-") as folder:
        paths = {name: Path(folder, f"{name}.npz") for name in ("input", "output")}
        _write(paths["input"], entries)
        for name, path in paths.items():
            command = [word.replace(f"{{{name}}}", str(path)) for word in command]
        status, said = _ended(command, timeout)
        if status:
            reason = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            message = next((in_one_line(line) for line in reversed(said.split("\n")) if line.strip()), "")
            raise TrackerFailed(f"{reason}: {message or 'nothing on stderr'}")
        return _read(paths["output"], shape)


def in_one_line(text: str) -> str:
    """A message of an external tracker, shortened to fit into a line of a table."""
    line = " ".join(text.split())
    return line if len(line) <= 200 else f"{line[:200]} ..."


def check_real(what: str, kind: object, found: tuple[int, ...], shape: tuple[int, ...]) -> None:
    """Refuse an array that is none of real numbers of a shape.

    Parameters
    ----------
    what : str
        What the tracker did, as "returned a quality".
    kind : dtype, or object
        Type of its numbers, or what it is instead.
    found, shape : tuple of int
        Its shape, and the one that it must have.

    Raises
    ------
    TrackerFailed
        With the name of the type, or the shapes.
    """
    if not (isinstance(kind, np.dtype) and kind.kind in "fiub"):
        raise TrackerFailed(f"{what} of {kind}, not of real numbers of shape {shape}")
    if found != shape:
        raise TrackerFailed(f"{what} of shape {found}, not {shape}")


def _ended(command: list[str], timeout: float) -> tuple[int, str]:
    """Exit status of a command, and the end of its stderr; all processes that it has started are ended with it."""
    try:
        # To file descriptor 2, because standard output of the command line is for its results.
        streams: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": 2, "stderr": subprocess.PIPE}
        process = subprocess.Popen(command, **streams, bufsize=0, start_new_session=True)
    except OSError as error:
        raise TrackerFailed(f"did not start: {command[0]}: {error.strerror}") from error
    said = bytearray()
    reading = Thread(target=_keep_end, args=(process.stderr, said), daemon=True)
    reading.start()
    try:
        status = process.wait(timeout)
    except subprocess.TimeoutExpired as error:
        raise TrackerFailed(f"took longer than timeout_s = {timeout:g}") from error
    finally:
        with suppress(ProcessLookupError):  # if all of its group have ended
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        reading.join(1)  # longer only if a process that left the group holds stderr open
    return status, bytes(said).decode(errors="replace")


def _keep_end(stream: IO[bytes], kept: bytearray) -> None:
    """Read a stream to its end, and keep what came last: so it neither blocks who writes to it nor fills memory."""
    with stream:
        while part := stream.read(KEPT_STDERR):
            kept += part
            del kept[:-KEPT_STDERR]


def _write(path: Path, entries: dict[str, Any]) -> None:
    """Like `numpy.savez`, but entries may have any name (such as `file`), and Python objects are refused."""
    with ZipFile(path, "w") as archive:
        for name, value in entries.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                npy.write_array(file, np.asarray(value), allow_pickle=False)


def _read(path: Path, shape: tuple[int, ...]) -> Any:
    if not path.is_file():
        raise TrackerFailed("wrote no {output}, an .npz file with displacement and, if known, quality")
    try:
        with ZipFile(path) as archive:
            names = archive.namelist()
            if "displacement.npy" not in names:
                raise TrackerFailed("wrote an {output} without displacement")
            displacement = _array(archive, "displacement", shape)
            return (displacement, _array(archive, "quality", shape[:2])) if "quality.npy" in names else displacement
    except TrackerFailed:
        raise
    except Exception as error:  # zipfile and NumPy raise many kinds of a file that is damaged
        reason = in_one_line(str(error) or type(error).__name__)
        raise TrackerFailed(f"wrote an {{output}} that cannot be read as .npz ({reason})") from error


def _array(archive: ZipFile, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """An array of which no more is read than one of the shape can have, whatever its header or the archive says."""
    if archive.getinfo(f"{name}.npy").compress_type not in (ZIP_STORED, ZIP_DEFLATED):  # others unpack without limit
        raise ValueError(f"{name} is compressed otherwise than by deflate")
    with archive.open(f"{name}.npy") as entry:
        content = BytesIO(entry.read(MAX_HEADER + MAX_NUMBER * prod(shape)))
    is_first = npy.read_magic(content) == (1, 0)
    header = (npy.read_array_header_1_0 if is_first else npy.read_array_header_2_0)(content)
    check_real(f"wrote an {{output}} with a {name}", header[2], header[0], shape)
    content.seek(0)
    return npy.read_array(content, allow_pickle=False)
