"""`echotruth status` tells what is made, what runs, what failed and why, of a run wherever it is."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from finished_repository import configured, finish

from echotruth.cases import expand
from echotruth.repository import ledger
from echotruth.repository.ledger import record_path
from echotruth.workflow import lease
from echotruth.workflow.progress import write_expected
from echotruth.workflow.status import Status, StatusError, status_before, status_of
from echotruth.workflow.status_text import MAX_REASONS, text
from echotruth.workflow.summary import NO_HEART, Spent, unfinished
from echotruth.workflow.summary import finished as finished_text

CONFIG = configured(seeds=(1, 2))
FIRST, SECOND = (case.id for case in expand(CONFIG))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A repository whose jobs are all done, with a report."""
    folder = finish(tmp_path_factory.mktemp("status") / CONFIG.name, CONFIG)
    (folder / "report.html").write_text("")
    return folder


@pytest.fixture
def folder(made, tmp_path):
    """A copy of it."""
    return Path(shutil.copytree(made, tmp_path / CONFIG.name))


def counts(status: Status, part: str) -> tuple[int, ...]:
    found = status.parts[part]
    return found.jobs, found.done, found.running, found.failed, found.waiting


def record(folder: Path, stage: str, case: str, **entries) -> None:
    ledger.commit(record_path(folder, stage, case), ledger.read(record_path(folder, stage, case)) | entries)


def test_finished_repository_is_finished(folder):
    status = status_of(folder)
    assert status.state == "finished" and "is finished" in text(status)
    assert counts(status, "images") == (4, 4, 0, 0, 0) and counts(status, "mechanics") == (2, 2, 0, 0, 0)
    assert status.verdicts == {"complete": 2, "implausible": 0, "failed": 0} and not status.reasons


def test_repository_whose_last_record_is_damaged_is_not_finished(folder):
    path = folder / "ledger/repository.json"
    path.write_text(path.read_text().replace(": 2", ": 3", 1))
    assert status_of(folder).state != "finished"


def test_what_was_never_begun_waits(tmp_path):
    status = status_before(CONFIG, [FIRST, SECOND], tmp_path / "small")
    assert status.state == "never begun" and counts(status, "tracking") == (4, 0, 0, 0, 4)


@pytest.mark.parametrize("name", ["nothing", ""])
def test_other_folder_is_refused_with_a_sentence(tmp_path, name):
    with pytest.raises(StatusError, match="give the folder that a run made"):
        status_of(tmp_path / name)


def test_what_has_no_record_waits_although_nobody_works_on_it(folder):
    shutil.rmtree(folder / "ledger/evaluation" / FIRST)
    status = status_of(folder)
    assert status.state == "stopped" and counts(status, "tracking") == (4, 2, 0, 0, 2)


def test_hearts_that_are_not_complete_are_named_with_the_reason(folder):
    record(folder, "mechanics", FIRST, status="failed", reason="frame 3 has no equilibrium")
    record(folder, "physiology", FIRST, status="skipped", reason="frame 3 has no equilibrium")
    record(folder, "physiology", SECOND, status="implausible", reason="it twists by 50 deg")
    status = status_of(folder)
    assert status.verdicts == {"complete": 0, "implausible": 1, "failed": 1}
    assert status.reasons[FIRST] == ("failed", "frame 3 has no equilibrium")
    assert f"{SECOND}: implausible: it twists by 50 deg" in text(status)


def test_many_failures_are_counted():
    reasons = {f"heart{number}": ("failed", "no equilibrium") for number in range(300)}
    shown = text(Status(Path("out/many"), "finished", {}, 300, {"failed": 300}, reasons))
    assert shown.count("no equilibrium") == MAX_REASONS and f"and {300 - MAX_REASONS} more" in shown


PLAN = """\
Provided cores: 2
Job stats:
job                 count
----------------  -------
imaging                 2
tracking                2
total                   4
"""


def started(job: int, case: str, view: str) -> str:
    now = time.strftime("%a %b %d %H:%M:%S %Y")
    return f"[{now}]\nlocalrule imaging:\n    log: out/small/logs/imaging/{case}/{view}.log\n    jobid: {job}\n"


def write_log(folder: Path, content: str) -> None:
    (folder / "logs").mkdir(exist_ok=True)
    (folder / "logs/snakemake.log").write_text(PLAN + content)
    write_expected(folder / "logs", {"imaging": 600.0, "tracking": 0.0})


def test_run_that_goes_on_tells_what_runs_and_how_long_it_will_take(folder):
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    shutil.rmtree(folder / "ledger/evaluation" / FIRST)
    with lease.held(folder):
        write_log(folder, started(1, FIRST, "mid") + started(2, FIRST, "long_axis"))
        # The second waits in the queue of a cluster: it has no log yet.
        log = folder / "logs/imaging" / FIRST / "mid.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text("")
        status = status_of(folder)
    assert status.state == "running" and f"process {os.getpid()}" in status.holder
    assert counts(status, "images") == (4, 2, 1, 0, 1)
    assert status.seconds_left == pytest.approx(600, abs=20) and status.share == pytest.approx(0, abs=0.02)
    assert "about 10 min left" in text(status)
    assert status_of(folder).state == "stopped", "the lease was given back"


def test_run_on_another_machine_is_known_by_its_heartbeat(folder):
    holder = lease.Holder("run", "node7", "another machine", 42, 0.0, time.strftime("%Y-%m-%d %H:%M:%S"))
    (folder / lease.NAME).mkdir(exist_ok=True)
    path = folder / lease.NAME / "9.json"
    path.write_text(json.dumps(holder.__dict__))
    status = status_of(folder)
    assert status.state == "running" and "node7" in text(status)
    os.utime(path, (time.time() - 600, time.time() - 600))
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    assert status_of(folder).state == "killed"


HOLD = "import sys, time; from pathlib import Path; from echotruth.workflow import lease\n"
HOLD += "lease.acquire(Path(sys.argv[1]), 'run', False); print(1, flush=True); time.sleep(60)"


def test_killed_run_is_called_so(folder):
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    run = subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE)
    assert run.stdout is not None and run.stdout.readline()
    assert status_of(folder).state == "running"
    run.kill()
    run.communicate()
    status = status_of(folder)
    assert status.state == "killed" and f"process {run.pid}" in text(status)


def test_jobs_that_ended_with_an_error_are_counted_and_their_logs_named(folder):
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    log = f"out/small/logs/imaging/{FIRST}/mid.log"
    failed = f"Error in rule imaging:\n    message: None\n    jobid: 1\n    log: {log} (check log file(s))\n"
    with lease.held(folder):
        write_log(folder, started(1, FIRST, "mid") + failed)
    status = status_of(folder)
    assert status.state == "stopped" and counts(status, "images") == (4, 2, 0, 1, 1)
    assert log in text(status)


def run_status(*arguments) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "echotruth", "status", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


def test_exit_status_and_json_are_for_scripts(folder):
    done = run_status(folder, "--json", "--watch")
    assert done.returncode == 0
    found = json.loads(done.stdout)
    assert found["state"] == "finished" and found["parts"]["images"]["done"] == 4 and found["hearts"] == 2
    (folder / "ledger/repository.json").unlink()
    assert run_status(folder).returncode == 1
    done = run_status(folder.parent / "nothing")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and not done.stdout


BURN = "import time\nwhile time.process_time() < 1: pass"


def test_run_ends_with_hearts_reasons_time_and_places(folder):
    spent = Spent()
    subprocess.run([sys.executable, "-c", BURN], check=True)
    assert spent.cpu_seconds(folder) == pytest.approx(1, abs=0.7)
    record(
        folder,
        "physiology",
        SECOND,
        status="implausible",
        reason="it twists by 50 deg",
        cpu_seconds=500.0,
        start_seconds=0,
    )
    assert spent.cpu_seconds(folder) >= 500, "jobs that ran elsewhere count by their records"
    said, exit_status = finished_text(folder, spent, True)
    assert exit_status == 0
    for word in ("1 complete, 1 implausible", "it twists by 50 deg", "8 min of CPU time", "small.zarr", "report.html"):
        assert word in said
    record(folder, "physiology", FIRST, status="implausible", reason="it twists by 50 deg")
    said, exit_status = finished_text(folder, spent, True)
    assert "No heart is complete" in said and exit_status == NO_HEART
    assert finished_text(folder, spent, False)[1] == 0, "implausible hearts are imaged too"
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    assert "images 2/4" in unfinished(folder) and f"echotruth status {folder}" in unfinished(folder)
