"""External trackers that are programs: they read one .npz file and write another."""

import os
import signal
import subprocess
import zlib
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from numpy.lib.format import write_array

from echotruth.tracking.failure import TrackerFailed

UNREADABLE = (OSError, ValueError, TypeError, AttributeError, EOFError, NotImplementedError, BadZipFile, zlib.error)
"""What NumPy raises of a file that is damaged, or no .npz file."""


def run(command: list[str], entries: dict[str, Any], timeout: float) -> Any:
    """Run a program on a clip.

    Parameters
    ----------
    command : list of str
        The program and its arguments; {input} and {output} stand for the paths of the files.
    entries : dict
        Name -> array, number or text of the input file.
    timeout : float
        Longest time that it may take, s.

    Returns
    -------
    ndarray or tuple of two ndarray
        Displacement, and quality if the program writes one, as in the output file.

    Raises
    ------
    TrackerFailed
        If it does not start, fails, takes too long, or writes no file that can be read.
    """
    with TemporaryDirectory(prefix="echotruth-") as folder:
        paths = {name: Path(folder, f"{name}.npz") for name in ("input", "output")}
        _write(paths["input"], entries)
        for name, path in paths.items():
            command = [word.replace(f"{{{name}}}", str(path)) for word in command]
        stderr = Path(folder, "stderr")
        status = _exit_status(command, stderr, timeout)
        if status:
            reason = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            lines = stderr.read_text(encoding="utf-8", errors="replace").split("\n")
            message = next((in_one_line(line) for line in reversed(lines) if line.strip()), "nothing on stderr")
            raise TrackerFailed(f"{reason}: {message}")
        return _read(paths["output"])


def in_one_line(text: str) -> str:
    """A message of an external tracker, shortened to fit into a line of a table."""
    line = " ".join(text.split())
    return line if len(line) <= 200 else f"{line[:200]} ..."


def _exit_status(command: list[str], stderr: Path, timeout: float) -> int:
    """Run a command, with stderr into a file; all processes that it has started are ended with it."""
    try:
        with stderr.open("wb") as file:
            # To file descriptor 2, because standard output of the command line is for its results.
            streams: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": 2, "stderr": file}
            process = subprocess.Popen(command, **streams, start_new_session=True)
    except OSError as error:
        raise TrackerFailed(f"did not start: {command[0]}: {error.strerror}") from error
    try:
        return process.wait(timeout)
    except subprocess.TimeoutExpired as error:
        raise TrackerFailed(f"took longer than timeout_s = {timeout:g}") from error
    finally:
        with suppress(ProcessLookupError):  # if all of its group have ended
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _write(path: Path, entries: dict[str, Any]) -> None:
    """Like `numpy.savez`, but entries may have any name (such as `file`), and Python objects are refused."""
    with ZipFile(path, "w") as archive:
        for name, value in entries.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                write_array(file, np.asarray(value), allow_pickle=False)


def _read(path: Path) -> Any:
    if not path.is_file():
        raise TrackerFailed("wrote no {output}, an .npz file with displacement and, if known, quality")
    try:
        with np.load(path, allow_pickle=False) as file:
            displacement = file["displacement"]
            return (displacement, file["quality"]) if "quality" in file else displacement
    except KeyError as error:
        raise TrackerFailed("wrote an {output} without displacement") from error
    except UNREADABLE as error:
        raise TrackerFailed(f"wrote an {{output}} that cannot be read as .npz ({in_one_line(str(error))})") from error
