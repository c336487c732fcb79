"""One run at a time writes a repository, whatever becomes of it."""

import os
import signal
import subprocess
import sys

import pytest

from echotruth.workflow import lock
from echotruth.workflow.lock import VARIABLE, LockError

HOLD = "import sys, time; from pathlib import Path; from echotruth.workflow import lock\n"
HOLD += "lock.hold(Path(sys.argv[1])); print(1, flush=True); time.sleep(600)"


@pytest.fixture
def holder(tmp_path, monkeypatch):
    """A process that holds the lock of a folder, and the folder."""
    monkeypatch.delenv(VARIABLE, raising=False)
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "a")], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"1\n"
    yield process, tmp_path / "a"
    process.kill()
    process.communicate()


def test_second_run_is_refused_in_a_sentence_until_the_first_is_killed(holder, monkeypatch):
    process, folder = holder
    assert lock.is_held(folder)
    with pytest.raises(LockError, match=r"another run works on it: wait for it, or stop it$"):
        lock.hold(folder)
    assert VARIABLE not in os.environ
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not lock.is_held(folder)
    monkeypatch.setattr(lock, "_held", [])
    monkeypatch.setenv(VARIABLE, "")  # is taken away after the test
    assert lock.hold(folder) and lock.is_held(folder)
    assert not lock.hold(folder), "it is that of this run"
    for file in lock._held:
        file.close()
    assert not lock.is_held(folder)


def test_job_of_a_run_needs_no_lock_and_is_none_that_runs_the_folder(holder, monkeypatch):
    _, folder = holder
    monkeypatch.setenv(VARIABLE, str(folder.absolute()))
    assert lock.hold(folder) is False


def test_other_folder_is_free(tmp_path):
    assert not lock.is_held(tmp_path) and not lock.is_held(tmp_path / "none") and not list(tmp_path.iterdir())
