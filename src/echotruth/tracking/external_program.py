"""A tracker that is a program: it reads one .npz file and writes another."""

from __future__ import annotations

import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from numpy.lib.format import write_array

from echotruth.tracking.failure import TrackerFailed

STDERR = 2
"""Where a program's output goes: that of a command is its own."""


def run(command: list[str], entries: dict[str, Any], timeout: float) -> Any:
    """Run a program on a clip.

    Parameters
    ----------
    command : list of str
        The program and its arguments; {input} and {output} stand for the paths of the files.
    entries : dict
        Arrays, numbers and texts of the file it reads, by their names.
    timeout : float
        How long it may take, s.

    Returns
    -------
    ndarray or tuple of two ndarray
        Displacement, and quality where the program writes one, as they stand in its file.

    Raises
    ------
    TrackerFailed
        If it does not start, end well or in time, or writes no file that can be read.
    """
    with TemporaryDirectory(prefix="echotruth-") as folder:
        paths = {name: Path(folder, f"{name}.npz") for name in ("input", "output")}
        _write(paths["input"], entries)
        for name, path in paths.items():
            command = [part.replace(f"{{{name}}}", str(path)) for part in command]
        said = Path(folder, "said")
        status = _ended(command, said, timeout)
        if status:
            how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            raise TrackerFailed(f"{how}: {_last_line(said)}")
        return _read(paths["output"])


def in_one_line(text: str) -> str:
    """What a guest says, short enough for a line of a table."""
    words = " ".join(text.split())
    return words if len(words) <= 200 else f"{words[:200]} ..."


def _ended(command: list[str], said: Path, timeout: float) -> int:
    """Exit status of a program; its complaints go into a file, and whatever it has started ends with it."""
    try:
        with said.open("wb") as complaints:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=STDERR, stderr=complaints, start_new_session=True
            )
    except OSError as error:
        raise TrackerFailed(f"did not start: {command[0]}: {error.strerror}") from error
    try:
        return process.wait(timeout)
    except subprocess.TimeoutExpired as error:
        raise TrackerFailed(f"took longer than timeout_s = {timeout:g}") from error
    finally:
        _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):  # where all of its group have ended
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _last_line(said: Path) -> str:
    lines = said.read_text(encoding="utf-8", errors="replace").split("\n")
    return next((in_one_line(line) for line in reversed(lines) if line.strip()), "it said nothing on stderr")


def _write(path: Path, entries: dict[str, Any]) -> None:
    """What `numpy.savez` does, whatever the names of the entries, and without objects of Python."""
    with ZipFile(path, "w") as file:
        for name, value in entries.items():
            with file.open(f"{name}.npy", "w", force_zip64=True) as entry:
                write_array(entry, np.asarray(value), allow_pickle=False)


def _read(path: Path) -> Any:
    if not path.is_file():
        raise TrackerFailed("wrote no {output}, an .npz that holds displacement and quality")
    try:
        with np.load(path, allow_pickle=False) as file:
            answer = {name: file[name] for name in ("displacement", "quality") if name in file}
    except (OSError, ValueError, TypeError, AttributeError, EOFError, BadZipFile) as error:
        raise TrackerFailed(f"wrote an {{output}} that cannot be read as .npz ({in_one_line(str(error))})") from error
    if "displacement" not in answer:
        raise TrackerFailed("wrote an {output} that does not hold displacement")
    return (answer["displacement"], answer["quality"]) if "quality" in answer else answer["displacement"]
