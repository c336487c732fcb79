"""`echotruth status` tells what is made, what runs, what failed and why, of a run wherever it is."""

import json
import os
import shutil
import subprocess
import sys
import time

import pytest
import yaml
from job_files import finish, write_benchmark

from echotruth.cases import expand
from echotruth.config import Config, PhaseCorrelation, Tracking
from echotruth.repository import ledger
from echotruth.repository.case_file import case_path
from echotruth.repository.ledger import record_path
from echotruth.workflow import lease
from echotruth.workflow.jobs import rules
from echotruth.workflow.status import MAX_SHOWN, STATES, StatusError, status_before, status_of, text
from echotruth.workflow.summary import NO_HEART, unfinished
from echotruth.workflow.summary import finished as finished_text

CONFIG = Config(
    name="small", cases={"seed": [1, 2]}, tracking=Tracking(trackers={"one": PhaseCorrelation(window_px=16)})
)
CASES = [case.id for case in expand(CONFIG)]
FIRST, SECOND = CASES


@pytest.fixture
def folder(tmp_path):
    """A repository whose jobs are all done, by its records."""
    folder = tmp_path / CONFIG.name
    folder.mkdir()
    (folder / "config.yaml").write_text(yaml.safe_dump(CONFIG.model_dump(mode="json")))
    (folder / "cases.csv").write_text("case,seed\n" + "".join(f"{case},1\n" for case in CASES))
    (folder / "cases").mkdir()
    for case in expand(CONFIG):
        case_path(folder, case.id).write_text(case.config.model_dump_json())
    for rule in rules(CONFIG):
        finish(folder, rule, CONFIG, CASES)
    return folder


def counts(status, rule):
    return tuple(status["parts"][rule].values())


def record(folder, case, **entries):
    ledger.commit(record_path(folder, "mechanics", case), {"status": "complete"} | entries)


def test_heart_is_judged_by_bounds_of_its_own(folder):
    wide = expand(CONFIG)[1].config
    wide = wide.model_copy(update={"physiology": wide.physiology.model_copy(update={"twist_max_deg": 90.0})})
    case_path(folder, SECOND).write_text(wide.model_dump_json())
    for case in CASES:
        record(folder, case, bounded={"twist_max_deg": 50.0})
    assert list(status_of(folder)["reasons"]) == [FIRST]


def test_finished_repository_is_finished(folder):
    status = status_of(folder)
    assert status["state"] == "finished" and "is finished" in text(status)
    assert counts(status, "rf") == (8, 8, 0, 0, 0) and counts(status, "mechanics") == (2, 2, 0, 0, 0)
    assert counts(status, "tracking") == (24, 24, 0, 0, 0) and counts(status, "report") == (1, 1, 0, 0, 0)
    assert status["verdicts"] == {"complete": 2, "implausible": 0, "failed": 0} and not status["reasons"]


def test_what_was_never_begun_waits(tmp_path):
    status = status_before(CONFIG, CASES, tmp_path / "small")
    assert status["state"] == "never begun" and counts(status, "tracking") == (24, 0, 0, 0, 24)


@pytest.mark.parametrize("name", ["nothing", ""])
def test_other_folder_is_refused_with_a_sentence(tmp_path, name):
    with pytest.raises(StatusError, match="give the folder that a run made"):
        status_of(tmp_path / name)


@pytest.mark.parametrize("name, content", [("config.yaml", "views: ["), ("cases.csv", "heart\na\n")])
def test_damaged_files_are_told_in_a_sentence(folder, name, content):
    (folder / name).write_text(content)
    with pytest.raises(StatusError, match="cannot be read: run the configuration again"):
        status_of(folder)


def test_run_that_was_stopped_before_its_hearts_were_known_is_not_finished(folder):
    (folder / "cases.csv").unlink()
    assert "made so far: nothing" in unfinished(folder)
    assert status_of(folder)["state"] != "finished"


def test_what_has_no_record_waits_although_nobody_works_on_it(folder):
    (folder / f"ledger/tracking/{FIRST}/mid/512.json").unlink()
    status = status_of(folder)
    assert status["state"] == "stopped" and counts(status, "tracking") == (24, 23, 0, 0, 1)


def test_hearts_that_are_not_complete_are_named_with_the_reason(folder):
    record(folder, FIRST, status="failed", reason="frame 3 has no equilibrium")
    record(folder, SECOND, bounded={"twist_max_deg": 50.0})
    status = status_of(folder)
    assert status["verdicts"] == {"complete": 0, "implausible": 1, "failed": 1}
    assert status["reasons"][FIRST] == {"status": "failed", "reason": "frame 3 has no equilibrium"}
    assert f"{SECOND}: implausible: the largest twist (deg) is 50 and must be at most" in text(status)


def test_damaged_record_of_a_heart_is_a_reason(folder):
    record_path(folder, "mechanics", FIRST).write_text("{")
    record_path(folder, "mechanics", SECOND).unlink()
    status = status_of(folder)
    assert status["reasons"][FIRST]["reason"] == "its record cannot be read"
    assert "1 failed, 1 not known yet" in text(status)


def test_many_failures_are_counted(folder):
    status = status_of(folder)
    status["reasons"] = {f"heart{number}": {"status": "failed", "reason": "no equilibrium"} for number in range(300)}
    shown = text(status)
    assert shown.count("no equilibrium") == MAX_SHOWN and f"and {300 - MAX_SHOWN} more" in shown


PLAN = """\
Provided cores: 2
Job stats:
job                 count
----------------  -------
rf                      2
total                   4
"""


def started(job, case, view):
    now = time.strftime("%a %b %d %H:%M:%S %Y")
    return f"[{now}]\nlocalrule rf:\n    log: out/small/logs/rf/{case}/{view}.log\n    jobid: {job}\n"


def write_log(folder, content, name="snakemake.log"):
    (folder / "logs").mkdir(exist_ok=True)
    (folder / "logs" / name).write_text(PLAN + content)


def test_run_that_goes_on_tells_what_runs_and_how_long_it_will_take(folder):
    for view in CONFIG.views:
        (folder / f"ledger/rf/{FIRST}/{view}.json").unlink()
        write_benchmark(folder, f"rf/{SECOND}/{view}", 600)
    with lease.held(folder):
        write_log(folder, started(1, FIRST, "mid"))
        status = status_of(folder)
        assert status["state"] == "running" and f"process {os.getpid()}" in status["run"]
        assert counts(status, "rf") == (8, 4, 1, 0, 3) and status["activity"] == "rf (1 of 2)"
        assert status["seconds_left"] == pytest.approx(600, rel=0.15) and status["share"] < 0.02
        assert "about 10 min left" in text(status) or "min left" in text(status)
        write_log(folder, started(1, FIRST, "apex"), "snakemake_2.log")
        assert counts(status_of(folder), "rf") == (8, 4, 2, 0, 2), "of two Snakemakes"
    assert status_of(folder)["state"] == "stopped", "the lease was given back"


def test_log_of_an_earlier_run_does_not_count(folder):
    write_log(folder, started(1, FIRST, "mid"))
    os.utime(folder / "logs/snakemake.log", (0, 0))
    with lease.held(folder):
        status = status_of(folder)
    assert status["activity"] == "planning" and status["seconds_left"] is None


def test_run_on_another_machine_is_known_by_its_heartbeat(folder):
    holder = lease.Holder("run", "node7", "another machine", 42, 0.0, time.strftime("%Y-%m-%d %H:%M:%S"))
    (folder / lease.NAME).mkdir(exist_ok=True)
    path = folder / lease.NAME / "9.json"
    path.write_text(json.dumps(holder.__dict__))
    status = status_of(folder)
    assert status["state"] == "running" and "node7" in text(status)
    os.utime(path, (time.time() - 600, time.time() - 600))
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    assert status_of(folder)["state"] == "killed"


HOLD = "import sys, time; from pathlib import Path; from echotruth.workflow import lease\n"
HOLD += "lease.acquire(Path(sys.argv[1]), 'run', False); print(1, flush=True); time.sleep(60)"


def test_killed_run_is_called_so(folder):
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    run = subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE)
    assert run.stdout is not None and run.stdout.readline()
    assert status_of(folder)["state"] == "running"
    run.kill()
    run.communicate()
    status = status_of(folder)
    assert status["state"] == "killed" and f"process {run.pid}" in text(status)


def test_run_that_was_killed_while_it_planned_is_called_so(tmp_path):
    with lease.held(tmp_path / "new"):
        assert "running" in text(status_of(tmp_path / "new")) and status_of(tmp_path / "new")["activity"] == "planning"
    assert status_of(tmp_path / "new")["state"] == "stopped"


def test_jobs_that_ended_with_an_error_are_counted_and_their_logs_named(folder):
    shutil.rmtree(folder / "ledger/rf" / FIRST)
    log = f"out/small/logs/rf/{FIRST}/mid.log"
    failed = f"Error in rule rf:\n    message: None\n    jobid: 1\n    log: {log} (check log file(s))\n"
    with lease.held(folder):
        write_log(folder, started(1, FIRST, "mid") + failed)
    status = status_of(folder)
    assert status["state"] == "stopped" and counts(status, "rf") == (8, 4, 0, 1, 3)
    assert log in text(status) and status["failed_logs"] == [log]


def run_status(*arguments) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "echotruth", "status", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


def test_exit_status_and_json_are_for_scripts(folder):
    done = run_status(folder, "--json", "--watch")
    assert done.returncode == 0
    found = json.loads(done.stdout)
    assert found["state"] == "finished" and found["parts"]["rf"]["done"] == 8 and found["hearts"] == 2
    (folder / "ledger/repository.json").unlink()
    assert run_status(folder).returncode == 1
    done = run_status(folder.parent / "nothing")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and not done.stdout


def test_every_state_has_its_words(folder):
    for state in STATES:
        assert text(status_of(folder) | {"state": state}).startswith(f"{folder}: ")


def test_run_ends_with_hearts_reasons_time_and_places(folder):
    start = time.time()
    write_benchmark(folder, f"rf/{FIRST}/mid", 200, "NA")
    write_benchmark(folder, f"mechanics/{FIRST}", 100, 280)
    os.utime(write_benchmark(folder, f"rf/{SECOND}/mid", 9000), (start - 60, start - 60))
    record(folder, SECOND, bounded={"twist_max_deg": 50.0})
    said, exit_status = finished_text(folder, start, True)
    assert exit_status == 0
    for word in (
        "1 complete, 1 implausible",
        "(physiology.twist_max_deg)",
        "(8 min of CPU time)",
        "small.zarr",
        "report.html",
    ):
        assert word in said
    record(folder, FIRST, bounded={"twist_max_deg": 50.0})
    said, exit_status = finished_text(folder, start, True)
    assert "No heart is complete" in said and exit_status == NO_HEART
    assert finished_text(folder, start, False)[1] == 0, "implausible hearts are imaged too"
    shutil.rmtree(folder / "ledger/bmode" / FIRST)
    assert "bmode 12/24" in unfinished(folder) and f"echotruth status {folder}" in unfinished(folder)
