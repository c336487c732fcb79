"""One run at a time holds the lease of a repository, and nothing of a run outlives its lease."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import asdict, replace

import psutil
import pytest

from echotruth.workflow import lease
from echotruth.workflow.lease import Holder, LeaseError

pytestmark = pytest.mark.slow


def python(code, *arguments, **variables):
    """Process that runs some code, with a pipe from its output."""
    command = [sys.executable, "-c", f"import sys, time\nfrom pathlib import Path\n{code}", *map(str, arguments)]
    environment = {name: value for name, value in os.environ.items() if name != lease.VARIABLE} | variables
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def is_running(pid):
    return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE


def put(folder, holder, age=0.0):
    """Write the lease of a holder with a heartbeat of some age, s."""
    path = folder / lease.NAME / "1.json"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(asdict(holder)))
    os.utime(path, (time.time() - age, time.time() - age))
    return path


def elsewhere(run="other"):
    """Holder on another machine, where this machine's numbers of processes mean nothing."""
    return replace(Holder.here(run), host="node7", machine="node7 boot", pid=1)


def dead(run="other"):
    """Holder on this machine that has ended."""
    process = python("time.sleep(60)")
    holder = replace(Holder.here(run), pid=process.pid, started=lease._start_time(process.pid))
    process.kill()
    process.communicate()
    return holder


@pytest.fixture(autouse=True)
def fast(monkeypatch):
    """Intervals of a test, and no run that this process belongs to."""
    monkeypatch.setattr(lease, "HEARTBEAT_SECONDS", 0.1)
    monkeypatch.setattr(lease, "POLL_SECONDS", 0.05)
    monkeypatch.setattr(lease, "_followed", [])
    monkeypatch.delenv(lease.VARIABLE, raising=False)


HOLD = """
from echotruth.workflow import lease
with lease.held(Path(sys.argv[1])):
    print("held", time.time(), flush=True)
    time.sleep(float(sys.argv[2]))
    print("left", time.time(), flush=True)
"""


def test_second_run_waits_with_a_sentence_until_the_first_has_ended(tmp_path):
    first = python(HOLD, tmp_path, 2)
    assert first.stdout.readline().startswith("held")
    second = python(HOLD, tmp_path, 0)
    left = float(first.communicate(timeout=60)[0].split()[1])
    output, errors = second.communicate(timeout=60)
    assert float(output.split()[1]) >= left
    assert "in use by another run" in errors and str(first.pid) in errors and errors.count("\n") == 1


def test_lease_of_a_killed_process_is_taken_over_with_a_sentence(tmp_path):
    first = python(HOLD, tmp_path, 60)
    assert first.stdout.readline()
    first.send_signal(signal.SIGKILL)
    first.communicate()
    start = time.monotonic()
    output, errors = python(HOLD, tmp_path, 0).communicate(timeout=60)
    assert "held" in output and "continuing in its place" in errors and errors.count("\n") == 1
    assert time.monotonic() - start < lease.STALE_SECONDS / 2


def test_number_of_a_process_that_was_used_again_does_not_hold_a_lease(tmp_path):
    put(tmp_path, replace(Holder.here("other"), started=1.0))
    lease.acquire(tmp_path, "mine", wait=False).release()


def test_given_back_lease_is_taken_without_a_word(tmp_path, capsys):
    for run in "abc":
        lease.acquire(tmp_path, run, wait=False).release()
    assert capsys.readouterr().err == ""
    assert [path.name for path in (tmp_path / lease.NAME).iterdir()] == ["3.json"]


@pytest.mark.parametrize("age, is_taken", [(30, False), (3600, True)])
def test_lease_of_another_machine_is_taken_over_by_the_age_of_its_heartbeat(tmp_path, age, is_taken):
    put(tmp_path, elsewhere(), age)
    if is_taken:
        lease.acquire(tmp_path, "mine", wait=False).release()
    else:
        with pytest.raises(LeaseError, match="node7"):
            lease.acquire(tmp_path, "mine", wait=False)


def test_heartbeat_after_a_stall_of_the_file_system_keeps_the_lease(tmp_path, monkeypatch):
    path = put(tmp_path, elsewhere(), 3600)
    monkeypatch.setattr(lease.time, "sleep", lambda _: os.utime(path))
    with pytest.raises(LeaseError):
        lease.acquire(tmp_path, "mine", wait=False)


def test_clock_of_this_machine_does_not_matter(tmp_path, monkeypatch):
    put(tmp_path, elsewhere())
    now = time.time()
    monkeypatch.setattr(lease.time, "time", lambda: now + 3600)
    with pytest.raises(LeaseError):
        lease.acquire(tmp_path, "mine", wait=False)


@pytest.mark.parametrize("content", ["", "{", '{"run": "other"}'])
def test_unfinished_lease_counts_until_it_is_old(tmp_path, content):
    path = put(tmp_path, elsewhere())
    path.write_text(content)
    with pytest.raises(LeaseError):
        lease.acquire(tmp_path, "mine", wait=False)
    os.utime(path, (0, 0))
    lease.acquire(tmp_path, "mine", wait=False).release()


RACE = """
from echotruth.workflow import lease
folder, start = Path(sys.argv[1]), float(sys.argv[2])
time.sleep(max(0, start - time.time()))
try:
    lease.acquire(folder, sys.argv[3], wait=False)
    print("won", flush=True)
    sys.stdin.read()
except lease.LeaseError:
    print("lost", flush=True)
"""


@pytest.mark.parametrize("first", ["none", "dead", "given back"])
def test_exactly_one_of_eight_processes_takes_a_lease(tmp_path, first):
    if first != "none":
        put(tmp_path, replace(dead(), released=first == "given back"))
    command = [sys.executable, "-c", f"import sys, time\nfrom pathlib import Path\n{RACE}", str(tmp_path)]
    start = time.time() + 2
    racers = [
        subprocess.Popen([*command, str(start), str(n)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for n in range(8)
    ]
    words = [racer.stdout.readline().strip() for racer in racers]
    for racer in racers:
        racer.communicate(timeout=60)
    assert sorted(words) == ["lost"] * 7 + ["won"]


def test_heartbeat_is_renewed_and_ends_with_the_lease(tmp_path):
    held = lease.acquire(tmp_path, "mine", wait=False)
    os.utime(held.path, (0, 0))
    wait_for(lambda: held.path.stat().st_mtime > 0)
    held.release()
    os.utime(held.path, (0, 0))
    time.sleep(0.3)
    assert held.path.stat().st_mtime == 0


def test_holder_ends_when_its_lease_is_taken(tmp_path):
    reasons = []
    held = lease.acquire(tmp_path, "mine", wait=False, end=reasons.append)
    held.path.unlink()
    wait_for(lambda: reasons)
    assert "taken by another run" in reasons[0]
    held.release()
    assert not held.path.exists()


def test_late_taker_of_a_number_that_has_come_and_gone_gives_it_up(tmp_path):
    put(tmp_path, elsewhere()).rename(tmp_path / lease.NAME / "5.json")
    assert lease._claim(tmp_path, 4, Holder.here("late")) is None
    assert [path.name for path in (tmp_path / lease.NAME).iterdir()] == ["5.json"]


JOB = """
from echotruth.workflow import lease
lease.HEARTBEAT_SECONDS = lease.POLL_SECONDS = 0.1
try:
    lease.follow(Path(sys.argv[1]))
except lease.LeaseError as error:
    sys.exit(str(error))
print("working", flush=True)
time.sleep(60)
"""


def change(path, **entries):
    path.with_suffix(".draft").write_text(json.dumps(json.loads(path.read_text()) | entries))
    path.with_suffix(".draft").replace(path)


@pytest.mark.parametrize("event", ["given back", "taken", "no heartbeat"])
def test_job_on_another_machine_ends_with_its_run(tmp_path, event):
    path = put(tmp_path, elsewhere("run"))
    job = python(JOB, tmp_path, **{lease.VARIABLE: "run"})
    assert job.stdout.readline() == "working\n"
    for _ in range(10 * (event != "no heartbeat")):  # it works as long as there are heartbeats
        os.utime(path)
        time.sleep(0.1)
        assert job.poll() is None
    if event == "given back":
        change(path, released=True)
    if event == "taken":
        path.unlink()
    _, errors = job.communicate(timeout=30)
    assert job.returncode == 1 and errors.count("\n") == 1 and errors.startswith("echotruth: ")


def test_job_ends_when_the_process_of_its_run_is_killed(tmp_path):
    holder = python(HOLD, tmp_path, 60)
    assert holder.stdout.readline()
    run = json.loads((tmp_path / lease.NAME / "1.json").read_text())["run"]
    job = python(JOB, tmp_path, **{lease.VARIABLE: run})
    assert job.stdout.readline() == "working\n"
    holder.kill()
    holder.communicate()
    assert "has ended" in job.communicate(timeout=30)[1]


def test_job_of_an_earlier_run_does_not_start(tmp_path):
    put(tmp_path, elsewhere("new"))
    job = python(JOB, tmp_path, **{lease.VARIABLE: "old"})
    output, errors = job.communicate(timeout=60)
    assert job.returncode == 1 and output == "" and "has ended" in errors and "Traceback" not in errors


def test_job_by_hand_needs_a_folder_in_which_nobody_writes(tmp_path):
    lease.follow(tmp_path)  # never had a lease
    held = lease.acquire(tmp_path, "mine", wait=False)
    with pytest.raises(LeaseError, match="in use"):
        lease.follow(tmp_path)
    held.release()
    lease.follow(tmp_path)


def test_taking_over_kills_what_is_left_of_the_earlier_run(tmp_path):
    put(tmp_path, dead("old"))
    stubborn = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(1, flush=True); time.sleep(60)"
    left, other = (python(stubborn, **{lease.VARIABLE: run}) for run in ("old", "another"))
    assert left.stdout.readline() and other.stdout.readline()
    held = lease.acquire(tmp_path, "new", wait=False)
    assert not is_running(left.pid) and is_running(other.pid)
    held.release()
    other.kill()
    other.communicate()
    left.communicate()


SNAKEMAKE = """
from echotruth.workflow import lease
lease.join(Path(sys.argv[1]))
lease.hold(Path(sys.argv[1]))
print("holds", flush=True)
time.sleep(float(sys.argv[2]))
"""


def test_snakemake_started_by_hand_holds_the_lease_itself_and_does_not_wait(tmp_path):
    first = python(SNAKEMAKE, tmp_path, 3)
    assert first.stdout.readline()
    second = python(SNAKEMAKE, tmp_path, 0)
    assert "LeaseError" in second.communicate(timeout=60)[1] and second.returncode
    assert first.poll() is None
    first.communicate(timeout=60)
    assert json.loads((tmp_path / lease.NAME / "1.json").read_text())["released"]


def test_snakemake_of_a_runner_shares_its_lease(tmp_path):
    held = lease.acquire(tmp_path, "mine", wait=False)
    snakemake = python(SNAKEMAKE, tmp_path, 0, **{lease.VARIABLE: "mine"})
    assert snakemake.communicate(timeout=60)[0] == "holds\n"
    assert held.path.exists() and not json.loads(held.path.read_text())["released"]
    held.release()
