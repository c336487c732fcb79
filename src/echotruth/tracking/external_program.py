"""External trackers that are programs: they read one .npz file and write another."""

import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.lib import format as npy

from echotruth.tracking.failure import TrackerFailed

KEPT_STDERR = 4096
"""Size of the end of what a program says on stderr that is read, bytes."""


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
        Displacement and, if the program writes one, quality, as in the output file.

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
        status, said = _ended(command, timeout)
        if status:
            reason = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            message = next((in_one_line(line) for line in reversed(said.split("\n")) if line.strip()), "")
            raise TrackerFailed(f"{reason}: {message or 'nothing on stderr'}")
        return _read(paths["output"])


def in_one_line(text: str) -> str:
    """A message of an external tracker, shortened to fit into a line of a table."""
    line = " ".join(text.split())
    return line if len(line) <= 200 else f"{line[:200]} ..."


def _ended(command: list[str], timeout: float) -> tuple[int, str]:
    """Exit status of a command, and the end of its stderr; all processes that it has started are ended with it."""
    with TemporaryFile() as said:
        # To file descriptor 2, because standard output of the command line is for its results.
        streams: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": 2, "stderr": said}
        try:
            process = subprocess.Popen(command, **streams, start_new_session=True)
        except OSError as error:
            raise TrackerFailed(f"did not start: {command[0]}: {error.strerror}") from error
        try:
            status = process.wait(timeout)
        except subprocess.TimeoutExpired as error:
            raise TrackerFailed(f"took longer than timeout_s = {timeout:g}") from error
        finally:
            with suppress(ProcessLookupError):  # if all of its group have ended
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        said.seek(-min(said.seek(0, os.SEEK_END), KEPT_STDERR), os.SEEK_END)
        return status, said.read().decode(errors="replace")


def _write(path: Path, entries: dict[str, Any]) -> None:
    """Like `numpy.savez`, but entries may have any name (such as `file`), and Python objects are refused."""
    with ZipFile(path, "w") as archive:
        for name, value in entries.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                npy.write_array(file, np.asarray(value), allow_pickle=False)


def _read(path: Path) -> Any:
    if not path.is_file():
        raise TrackerFailed("wrote no {output}, an .npz file with displacement and, if known, quality")
    try:
        with np.load(path) as found:
            arrays = [found[name] for name in ("displacement", "quality") if name in found.files]
            lacks_displacement = "displacement" not in found.files
    except Exception as error:  # zipfile and NumPy raise many kinds of a file that is damaged
        reason = in_one_line(str(error) or type(error).__name__)
        raise TrackerFailed(f"wrote an {{output}} that cannot be read as .npz ({reason})") from error
    if lacks_displacement:
        raise TrackerFailed("wrote an {output} without displacement")
    return tuple(arrays) if len(arrays) > 1 else arrays[0]
