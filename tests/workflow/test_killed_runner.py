"""A run whose runner alone is killed, for real: the next run works alone, and makes the same bytes."""

import time

import psutil
import pytest
from rigid_hearts import CONFIG
from workspace import COMMAND, SECONDS, Workspace, differing

from echotruth.workflow.lease import VARIABLE

pytestmark = pytest.mark.slow

RUN = ("run", "tiny.yaml", "--cores", "2", "repository")


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
    whole, killed = Workspace(tmp_path / "whole", CONFIG), Workspace(tmp_path / "killed", CONFIG)
    whole.echotruth(*RUN)
    run = killed.start(*COMMAND, *RUN)
    for stage in ("mechanics", "rf"):
        wait_for(lambda stage=stage: any(killed.out.glob(f"logs/{stage}/**/*.log")) and writers(killed.folder))
        (old,) = writers(killed.folder)
        run.kill()
        run.communicate()
        run = killed.start(*COMMAND, *RUN)
        wait_for(lambda old=old, run=run: writers(killed.folder) - {old} or run.poll() is not None)
        assert old not in writers(killed.folder)
    while run.poll() is None:
        assert len(writers(killed.folder)) <= 1
        time.sleep(0.5)
    assert run.returncode == 0, run.communicate()[0]
    assert differing(killed.out, whole.out) == []
