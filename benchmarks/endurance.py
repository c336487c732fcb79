"""Sweeps that run unattended, are killed, or run on other cores or a cluster give the same bytes, in a bucket too.

    python benchmarks/endurance.py kills --folder /tmp/kills --kills 20
    python benchmarks/endurance.py hearts --folder /tmp/hearts --hearts 100

`kills` makes a repository of small beating hearts in one go. Then it makes it again and again, and kills with SIGKILL,
at random moments and in turn, all processes of the run, its runner alone, its Snakemake alone, or one job. After each
kill the run is started again. `hearts` makes a hundred hearts on two cores, on one, on a SLURM of this machine
(tests/cluster/slurm.sh), and on two cores with a bucket of an S3 server on this machine. Both compare all files of the
hierarchy, of the bucket its objects, and add to results/endurance.json.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
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
CLUSTER = Path(__file__).parents[1] / "tests/cluster/slurm.sh"
TWO_CORES = ("--cores", "2")
SLURM = ("--profile", "slurm", "--group-components", "heart=10", "view=10")
"""Ten hearts, or views, to a job of the cluster, as docs/cluster.md advises for small ones."""
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


def start(folder: Path, *options: str, prefix: Sequence[str] = ()) -> subprocess.Popen[bytes]:
    """Start a run in a folder with options of `echotruth run`; the prefix is a command that runs a command."""
    command = [*prefix, sys.executable, "-c", "from echotruth.cli import main; main()", "run", "small.yaml", *options]
    with (folder / "output.txt").open("ab") as output:
        return subprocess.Popen(command, cwd=folder, stdout=output, stderr=output, start_new_session=True)


def finish(folder: Path, *options: str, prefix: Sequence[str] = ()) -> float:
    """Run to the end; give the time, s."""
    begin = time.monotonic()
    if start(folder, *options, prefix=prefix).wait():
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
    finish(whole := configure(folder / "whole", hearts), *TWO_CORES)
    expected, done, lost, rounds = content(whole), {name: 0 for name in VICTIMS}, [], 0
    while sum(done.values()) < number:
        rounds += 1
        killed = configure(folder / f"killed_{rounds}", hearts)
        for _ in range(RESTARTS):
            victim = list(VICTIMS)[sum(done.values()) % len(VICTIMS)]
            run, moment = start(killed, *TWO_CORES), float(random.uniform(SHORTEST, LONGEST))
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


@contextmanager
def bucket() -> Iterator[Callable[[], dict[str, str]]]:
    """An S3 server on this machine; what is given reads the hierarchy in it: path of every file -> hash."""
    import boto3
    from moto.server import ThreadedMotoServer

    os.environ |= {"AWS_ACCESS_KEY_ID": "some", "AWS_SECRET_ACCESS_KEY": "secret", "AWS_REGION": "us-east-1"}
    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # it would print a line for every object
    server = ThreadedMotoServer("127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    os.environ["AWS_ENDPOINT_URL"] = f"http://{host}:{port}"
    client = boto3.client("s3", region_name="us-east-1")
    client.create_bucket(Bucket="bucket")
    prefix = "hearts/small.zarr/"

    def objects() -> dict[str, str]:
        pages = client.get_paginator("list_objects_v2").paginate(Bucket="bucket", Prefix=prefix)
        keys = [entry["Key"] for page in pages for entry in page.get("Contents", [])]
        bodies = ((key, client.get_object(Bucket="bucket", Key=key)["Body"].read()) for key in keys)
        return {key.removeprefix(prefix): sha256(body).hexdigest() for key, body in bodies}

    try:
        yield objects
    finally:
        server.stop()


def unattended(folder: Path, hearts: int) -> Iterator[dict]:
    """Make many hearts in four ways; after each, what has been found."""
    seconds: dict[str, int] = {}
    expected: dict[str, str] = {}

    def compared(way: str, found: dict[str, str]) -> dict:
        if found != (expected or found):
            raise RuntimeError(f"{folder / way}: other bytes than {folder / 'two_cores'}")
        expected.update(found)
        return {"hearts": hearts, "files": len(expected), "seconds": dict(seconds), "same_bytes": True}

    def made(way: str, *options: str, prefix: Sequence[str] = ()) -> dict[str, str]:
        seconds[way] = round(finish(configure(folder / way, hearts), *options, prefix=prefix))
        return content(folder / way)

    yield compared("two_cores", made("two_cores", *TWO_CORES))
    yield compared("one_core", made("one_core", "--cores", "1"))
    yield compared("slurm", made("slurm", *SLURM, prefix=[str(CLUSTER)]))
    with bucket() as objects:
        made("s3", *TWO_CORES, "--upload", "s3://bucket/hearts")
        yield compared("s3", objects())


def save(what: str, row: dict) -> None:
    """Add a row to the results."""
    print(json.dumps(row), flush=True)
    rows = json.loads(RESULTS.read_text()) if RESULTS.is_file() else {}
    RESULTS.write_text(json.dumps(rows | {what: row}, indent=1) + "\n")


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
        save("kills", kills(arguments.folder, arguments.kills, arguments.hearts or 4))
    else:
        for row in unattended(arguments.folder, arguments.hearts or 100):
            save("hearts", row)


if __name__ == "__main__":
    main()
