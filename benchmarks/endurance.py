"""Sweeps that run unattended: killed at random moments, or on other numbers of cores, they give the same bytes.

    python benchmarks/endurance.py kills --folder /tmp/kills --kills 20
    python benchmarks/endurance.py hearts --folder /tmp/hearts --hearts 100

`kills` makes a repository of small beating hearts in one go. Then it makes it again and again, and kills with SIGKILL,
at random moments and in turn, all processes of the run, its runner alone, its Snakemake alone, or one job. After each
kill the run is started again. `hearts` makes a hundred hearts on two cores and on one. Both compare all files of the
hierarchy, and add to results/endurance.json.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import numpy as np
import psutil

CONFIG = """\
name: small
geometry: {{circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}}
loop: {{frames: 8}}
views: {{mid: {{position: 0.5}}}}
phantom: {{density_per_mm3: 100}}
probe: {{elements: 16}}
rf: {{lines: 48}}
bmode: {{size_px: 64, downsampling: [1]}}
tracking: {{trackers: {{as_published: {{window_px: 16}}}}}}
physiology: {{exclude_implausible: false}}
cases: {{mechanics.material.stiffness_kPa: {stiffnesses}}}
"""
RESULTS = Path(__file__).parent / "results/endurance.json"
SHORTEST, LONGEST = 2.0, 25.0
"""Time until a kill, s."""
RESTARTS = 200
"""Largest number of starts of a repository that is killed."""


def configure(folder: Path, hearts: int) -> Path:
    """Write the configuration of a number of hearts to a new folder, which shares the cache of compiled functions."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    stiffnesses = [round(float(value), 4) for value in np.linspace(0.8, 1.6, hearts)]
    (folder / "small.yaml").write_text(CONFIG.format(stiffnesses=stiffnesses))
    cache = folder.parent / "numba"
    cache.mkdir(exist_ok=True)
    (folder / ".snakemake").mkdir()
    (folder / ".snakemake/numba").symlink_to(cache)
    return folder


def start(folder: Path, cores: int) -> subprocess.Popen[bytes]:
    """Start a run in a folder."""
    command = [
        sys.executable,
        "-c",
        "from echotruth.cli import main; main()",
        "run",
        "small.yaml",
        "--cores",
        str(cores),
    ]
    with (folder / "output.txt").open("ab") as output:
        return subprocess.Popen(command, cwd=folder, stdout=output, stderr=output, start_new_session=True)


def finish(folder: Path, cores: int) -> float:
    """Run to the end; give the time, s."""
    begin = time.monotonic()
    if start(folder, cores).wait():
        raise RuntimeError(f"{folder}: the run failed: see {folder / 'output.txt'}")
    return time.monotonic() - begin


def content(folder: Path) -> dict[str, str]:
    """Path of every file of the hierarchy -> hash."""
    root = folder / "out/small/small.zarr"
    files = [path for path in root.rglob("*") if path.is_file()]
    return {path.relative_to(root).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


def records(folder: Path) -> set[str]:
    """Records of jobs in the ledger."""
    ledger = folder / "out/small/ledger"
    return {path.relative_to(ledger).as_posix() for path in ledger.glob("*/**/*.json")}


def processes(run: subprocess.Popen[bytes]) -> list[psutil.Process]:
    """Processes of a run that live, the runner first."""
    try:
        runner = psutil.Process(run.pid)
        return [runner, *runner.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def named(word: str) -> Callable[[list[psutil.Process]], list[psutil.Process]]:
    """Choose the first process of a run whose command line has a word."""

    def choose(tree: list[psutil.Process]) -> list[psutil.Process]:
        found = []
        for process in tree[1:]:
            try:
                if any(word in part for part in process.cmdline()):
                    found.append(process)
            except psutil.Error:
                continue
        return found[:1]

    return choose


VICTIMS = {
    "tree": lambda tree: tree,
    "runner": lambda tree: tree[:1],
    "snakemake": named("Snakefile"),
    "job": named("/scripts/"),
}


def kill(run: subprocess.Popen[bytes], victim: str) -> bool:
    """Kill a part of a run; false if there was none."""
    chosen = VICTIMS[victim](processes(run))
    for process in chosen:
        try:
            process.kill()
        except psutil.NoSuchProcess:
            continue
    return bool(chosen)


def kills(folder: Path, number: int, hearts: int) -> dict:
    """Kill runs until a number of kills is reached and the repository is made; do so with as many as it takes."""
    random = np.random.default_rng(2026)
    finish(whole := configure(folder / "whole", hearts), 2)
    expected, done, lost, rounds = content(whole), {name: 0 for name in VICTIMS}, [], 0
    while sum(done.values()) < number:
        rounds += 1
        killed = configure(folder / f"killed_{rounds}", hearts)
        for _ in range(RESTARTS):
            victim = list(VICTIMS)[sum(done.values()) % len(VICTIMS)]
            run, moment = start(killed, 2), float(random.uniform(SHORTEST, LONGEST))
            before = records(killed)
            try:
                run.wait(moment)
            except subprocess.TimeoutExpired:
                before = records(killed)
                if sum(done.values()) < number and kill(run, victim):
                    done[victim] += 1
                    print(f"{sum(done.values())}: {victim} after {moment:.0f} s, {len(before)} records", flush=True)
            status = run.wait()
            lost.append(len(before - records(killed)) if status else 0)
            if status == 0:
                break
        if content(killed) != expected:
            raise RuntimeError(f"{killed}: other bytes than {whole}")
    return {"kills": done, "repositories": rounds, "files": len(expected), "most_records_lost": max(lost)}


def unattended(folder: Path, hearts: int) -> dict:
    """Make many hearts on two cores and on one."""
    folders = {cores: configure(folder / f"cores_{cores}", hearts) for cores in (2, 1)}
    seconds = {cores: round(finish(folders[cores], cores)) for cores in folders}
    first, second = (content(path) for path in folders.values())
    if first != second:
        raise RuntimeError(f"{folder}: the bytes depend on the number of cores")
    return {"hearts": hearts, "files": len(first), "seconds": seconds, "same_bytes": first == second}


def main() -> None:
    """Run one of the two."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("kills", "hearts"))
    parser.add_argument("--folder", type=Path, required=True, help="new folder on a local disk")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--hearts", type=int, help="default: 4 for kills, otherwise 100")
    arguments = parser.parse_args()
    os.environ["MPLBACKEND"] = "agg"
    if arguments.what == "kills":
        row = kills(arguments.folder, arguments.kills, arguments.hearts or 4)
    else:
        row = unattended(arguments.folder, arguments.hearts or 100)
    print(json.dumps(row))
    rows = json.loads(RESULTS.read_text()) if RESULTS.is_file() else {}
    RESULTS.write_text(json.dumps(rows | {arguments.what: row}, indent=1) + "\n")


if __name__ == "__main__":
    main()
