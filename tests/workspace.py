"""A folder in which the workflow and the commands are run, as a user does it."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import cores

from echotruth.workflow.lease import VARIABLE

ROOT = Path(__file__).parents[1]
SECONDS = 900
"""Longest time that is waited for something to happen."""
COMMAND = [sys.executable, "-c", "from echotruth.cli import main; main()"]
"""The command `echotruth`, without its entry point."""


def contents(folder: Path) -> dict[str, str]:
    """Path in the store -> hash, of every file of a repository."""
    store = folder / f"{folder.name}.zarr"
    files = [path for path in store.rglob("*") if path.is_file() and path.name != ".snakemake_timestamp"]
    return {path.relative_to(store).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


def differing(folder: Path, other: Path) -> list[str]:
    """Paths of the files in which two repositories differ."""
    one, two = contents(folder), contents(other)
    assert one and two
    return [path for path in sorted({*one, *two}) if one.get(path) != two.get(path)]


class Workspace:
    """Folder with a configuration, in which processes are run that share the compiled functions of the tests.

    Parameters
    ----------
    folder : Path
        It is made if it is not there.
    config : str
        Text of the configuration `tiny`.
    """

    def __init__(self, folder: Path, config: str) -> None:
        self.folder, self.out = folder, folder / "out/tiny"
        folder.mkdir(exist_ok=True)
        cores.lend(folder / ".snakemake/numba")
        self.write(config)

    def write(self, config: str, name: str = "tiny") -> str:
        """Write a configuration; name of its file."""
        (self.folder / f"{name}.yaml").write_text(config)
        return f"{name}.yaml"

    def start(self, *command: str) -> subprocess.Popen[str]:
        """Start a process in a process group of its own."""
        own = {"PYTHONPATH": str(ROOT / "src"), "MPLBACKEND": "agg"}
        environment = {name: value for name, value in os.environ.items() if name != VARIABLE} | own
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        return subprocess.Popen(command, cwd=self.folder, env=environment, start_new_session=True, text=True, **pipes)

    def run(self, *command: str, status: int = 0) -> str:
        """Output of a process that must end with a status."""
        process = self.start(*command)
        output, _ = process.communicate()
        assert process.returncode == status, output
        return output

    def snakemake(self, *options: str, file: Path = ROOT / "Snakefile", status: int = 0) -> str:
        """Output of Snakemake alone."""
        return self.run(sys.executable, "-m", "snakemake", "--snakefile", str(file), *options, status=status)

    def echotruth(self, *arguments: str, status: int = 0) -> str:
        """Output of the command `echotruth`."""
        return self.run(*COMMAND, *arguments, status=status)

    def planned(self, config: str | None = None, *options: str) -> dict[str, int]:
        """Rule -> number of jobs that Snakemake would run for a configuration (default: that of the folder)."""
        file = "tiny.yaml" if config is None else self.write(config, "changed")
        return planned(self.snakemake("--configfile", file, "-n", "--cores", "2", *options))

    def has(self, pattern: str) -> bool:
        """Whether a file below `out/tiny` has a name of this pattern."""
        return any(self.out.glob(pattern))

    def kill_when(self, process: subprocess.Popen[str], condition: Callable[[], bool]) -> None:
        """Kill a process with all that it started as soon as a condition holds."""
        end = time.monotonic() + SECONDS
        while not condition():
            assert process.poll() is None and time.monotonic() < end, process.stdout.read()
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def planned(output: str) -> dict[str, int]:
    """Rule -> number of its jobs, from the table that Snakemake prints; without those that only collect."""
    found = re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE)
    return {rule: int(number) for rule, number in found if rule not in ("all", "hearts", "total")}
