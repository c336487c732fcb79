"""Damage a finished repository at random places, heal it, and compare every byte with what was there before.

    python benchmarks/damage.py --folder /tmp/damage

makes a small repository of two hearts with prescribed motion in the folder, or takes the one that is there. Then, in
rounds, it flips bits, truncates, empties and deletes files of the hierarchy. In each round the check must name the
damaged files and no others, the jobs that write them and those that follow them are run and no others, and all bytes
are those of before. The first rounds have one fault each. At the end nothing is left to be done. Writes
results/damage.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import numpy as np

from echotruth.repository.check import check
from echotruth.repository.healing import heal

CONFIG = """\
name: tiny
geometry: {circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}
loop: {frames: 6}
motion: {kind: affine}
views:
  mid: {position: 0.5}
  long_axis: {plane: long_axis}
phantom: {density_per_mm3: 100}
probe: {elements: 16}
rf: {lines: 48, keep: [lines, channels]}
bmode: {size_px: 64, downsampling: [1, 2]}
tracking:
  trackers:
    as_published: {window_px: 16}
cases:
  seed: [1, 2]
"""
RESULTS = Path(__file__).parent / "results/damage.json"
FOLLOWING = {
    "mechanics": ("phantom", "rf", "truth", "bmode", "tracking"),
    "phantom": ("rf", "bmode", "tracking"),
    "rf": ("bmode", "tracking"),
    "truth": ("tracking",),
    "bmode": ("tracking",),
    "tracking": (),
}
"""Stage -> those that follow it, of the same heart, view and image size as far as both have them."""
LARGEST = "64"
"""Image size from whose clip the others are made."""

Harm = Callable[[Path, np.random.Generator], None]


def write(path: Path, content: bytes) -> None:
    """Replace a file: others may be further names of the same data."""
    path.unlink()
    path.write_bytes(content)


def flip(path: Path, random: np.random.Generator) -> None:
    """Flip one bit."""
    content = bytearray(path.read_bytes())
    bit = int(random.integers(8 * len(content)))
    content[bit // 8] ^= 1 << bit % 8
    write(path, bytes(content))


def truncate(path: Path, random: np.random.Generator) -> None:
    """Cut a file at a random place."""
    content = path.read_bytes()
    write(path, content[: int(random.integers(1, len(content)))])


def empty(path: Path, random: np.random.Generator) -> None:
    """Leave a file of length 0."""
    write(path, b"")


def delete(path: Path, random: np.random.Generator) -> None:
    """Delete a file."""
    path.unlink()


class Repository:
    """The small repository, with the state to which healing must return it.

    Parameters
    ----------
    workspace : Path
        Folder in which the workflow is run.
    cores : int
    """

    def __init__(self, workspace: Path, cores: int) -> None:
        workspace.mkdir(parents=True, exist_ok=True)
        os.chdir(workspace)
        self.cores, self.folder = str(cores), Path("out/tiny")
        Path("tiny.yaml").write_text(CONFIG)
        if self.folder.is_dir():
            heal(check(self.folder))
        self.echotruth("run", "tiny.yaml", "--cores", self.cores)
        self.hashes = self.content()
        self.owners = {
            f"tiny.zarr/{name}": path.relative_to(self.folder).as_posix()
            for path in (self.folder / "ledger").rglob("*.json")
            for name in json.loads(path.read_text()).get("sha256", {})
        }

    def echotruth(self, *arguments: str) -> str:
        """Output of a command that must succeed."""
        command = [sys.executable, "-c", "from echotruth.cli import main; main()", *arguments]
        result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        assert result.returncode == 0, result.stdout
        return result.stdout

    def content(self) -> dict[str, str]:
        """Path of every file of the hierarchy -> hash."""
        files = [path for path in (self.folder / "tiny.zarr").rglob("*") if path.is_file()]
        return {path.relative_to(self.folder).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}

    def records(self) -> dict[tuple[str, ...], int]:
        """Stage, case, view and size of every record of a job -> time of its last change."""
        ledger = self.folder / "ledger"
        return {
            path.relative_to(ledger).with_suffix("").parts: path.stat().st_mtime_ns for path in ledger.rglob("*/*.json")
        }

    def run(self) -> set[tuple[str, ...]]:
        """Make what was dropped; give the jobs that were run."""
        before = self.records()
        self.echotruth("run", "tiny.yaml", "--cores", self.cores)
        return {job for job, time_ in self.records().items() if before.get(job) != time_}

    def concerned(self, names: list[str]) -> set[tuple[str, ...]]:
        """Jobs that make files of the hierarchy again, and those that follow them."""
        owners = [Path(self.owners[name]).relative_to("ledger").with_suffix("").parts for name in names]
        damaged = {owner for owner in owners if len(owner) > 1}  # the structure belongs to no job
        # Scatterers are deleted when the echoes are made.
        damaged |= {("phantom", *place) for stage, *place in damaged if stage == "rf"}
        return damaged | {job for job in self.records() if any(_follows(job, first) for first in damaged)}


def _follows(job: tuple[str, ...], first: tuple[str, ...]) -> bool:
    """Whether a job is run because another one was."""
    (stage, *place), (before, *other) = job, first
    if before == "bmode" and other[2] == LARGEST:
        return place[:2] == other[:2] and stage in ("bmode", "tracking")
    return stage in FOLLOWING[before] and all(ours == theirs for ours, theirs in zip(place, other, strict=False))


def damage(repository: Repository, harm: Harm, count: int, random: np.random.Generator) -> dict[str, float]:
    """One round; gives what was found and how long it took, s."""
    files = random.choice(sorted(repository.hashes), count, replace=False)
    for name in files:
        harm(repository.folder / name, random)
    start = time.perf_counter()
    report = check(repository.folder)
    checked = time.perf_counter()
    found = {fault.path for fault in report.faults}
    assert found == set(files), sorted(found ^ set(files))
    concerned = repository.concerned(list(files))
    heal(report)
    ran = repository.run()
    assert ran == concerned, sorted(ran ^ concerned)
    healed = time.perf_counter()
    assert repository.content() == repository.hashes
    return {"faults": count, "jobs": len(ran), "check_seconds": checked - start, "run_seconds": healed - checked}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, required=True, help="folder in which the repository is made")
    parser.add_argument("--flips", type=int, default=1000, help="flipped bits")
    parser.add_argument("--others", type=int, default=100, help="files truncated, emptied and deleted, each")
    parser.add_argument("--per-round", type=int, default=100, help="faults of a round")
    parser.add_argument("--single", type=int, default=20, help="rounds of one fault")
    parser.add_argument("--cores", type=int, default=2)
    arguments = parser.parse_args()
    repository, random, rounds = Repository(arguments.folder, arguments.cores), np.random.default_rng(15), []
    plan = [(flip, arguments.flips), *((harm, arguments.others) for harm in (truncate, empty, delete))]
    singles = [(harm, 1) for harm in (flip, truncate, empty, delete) for _ in range(arguments.single // 4)]
    batches = [
        (harm, min(arguments.per_round, total - done))
        for harm, total in plan
        for done in range(0, total, arguments.per_round)
    ]
    for harm, count in (*singles, *batches):
        rounds.append({"harm": harm.__name__, **damage(repository, harm, count, random)})
        print(rounds[-1], flush=True)
        RESULTS.write_text(json.dumps({"files": len(repository.hashes), "rounds": rounds}, indent=1) + "\n")
    assert "Nothing to be done" in repository.echotruth("run", "tiny.yaml", "-n", "--cores", "1")


if __name__ == "__main__":
    main()
