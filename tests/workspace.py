"""A folder in which the workflow and the commands are run, as a user does it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import yaml
from finished_repository import finish, solved

import echotruth as et
from echotruth.workflow.lock import VARIABLE

ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-c", "from echotruth.cli import main; main()"]
"""The command `echotruth`, without its entry point."""
CONFIG = """
name: tiny
geometry: {circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}
loop: {frames: 3}
motion: {kind: rigid}
views: {mid: {position: 0.5}}
phantom: {density_per_mm3: 50}
probe: {elements: 16}
rf: {lines: 32, focal_zones: 1}
bmode: {size_px: 64, downsampling: [1]}
tracking: {trackers: {dis: {method: dis}}}
"""
"""A run that takes seconds: one heart, which moves as a rigid body, in one view."""


def alone(folder: Path) -> Path:
    """Folder of the repository that its jobs make in this process, one after the other."""
    return finish(folder / "tiny", et.configure(yaml.safe_load(CONFIG)), solved)


class Workspace:
    """Folder with the configuration `tiny`."""

    def __init__(self, folder: Path, config: str = CONFIG) -> None:
        self.folder, self.out = folder, folder / "out/tiny"
        folder.mkdir(exist_ok=True)
        (folder / "tiny.yaml").write_text(config)

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

    def snakemake(self, *options: str, status: int = 0) -> str:
        """Output of Snakemake alone, on two cores."""
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile"), "--cores", "2"]
        return self.run(*command, "--configfile", "tiny.yaml", *options, status=status)

    def echotruth(self, *arguments: str, status: int = 0) -> str:
        """Output of the command `echotruth`."""
        return self.run(*COMMAND, *arguments, status=status)

    def planned(self) -> dict[str, int]:
        """Rule -> number of jobs that Snakemake would run."""
        found = re.findall(r"^(\w+) +(\d+)$", self.snakemake("-n"), re.MULTILINE)
        return {rule: int(number) for rule, number in found if rule not in ("all", "total")}
