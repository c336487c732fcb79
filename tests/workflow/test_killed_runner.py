"""A run whose runner alone is killed, for real: the next run works alone, and makes the same bytes."""

import hashlib
import os
import subprocess
import sys
import time

import cores
import psutil
import pytest
from rigid_hearts import CONFIG

from echotruth.workflow.lease import VARIABLE

pytestmark = pytest.mark.slow

RUN = ("run", "tiny.yaml", "--cores", "2", "repository")
SECONDS = 900
"""Longest time of a run."""


def start(folder):
    """Start a run that leaves out the report."""
    (folder / "tiny.yaml").write_text(CONFIG)
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", *RUN]
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def content(folder):
    files = [path for path in (folder / "out/tiny").glob("*.zarr/**/*") if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def writers(folder):
    """Runs with a script of a stage at work in a folder, as the set of their names."""
    runs = set()
    for process in psutil.process_iter():
        try:
            if any("/scripts/" in part for part in process.cmdline()) and process.cwd() == str(folder):
                runs.add(process.environ().get(VARIABLE))
        except psutil.Error:
            continue
    return runs


def wait_for(condition):
    end = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)


def test_next_run_works_alone_and_makes_the_same_bytes(tmp_path):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    for folder in (whole, killed):
        cores.lend(folder / ".snakemake/numba")
    assert start(whole).wait(SECONDS) == 0
    run = start(killed)
    for stage in ("mechanics", "imaging"):
        wait_for(lambda stage=stage: any((killed / "out/tiny/logs").glob(f"{stage}/**/*.log")) and writers(killed))
        (old,) = writers(killed)
        run.kill()
        run.communicate()
        run = start(killed)
        wait_for(lambda old=old, run=run: writers(killed) - {old} or run.poll() is not None)
        assert old not in writers(killed)
    while run.poll() is None:
        assert len(writers(killed)) <= 1
        time.sleep(0.5)
    assert run.returncode == 0, run.stderr.read().decode()
    assert content(killed) == content(whole)
