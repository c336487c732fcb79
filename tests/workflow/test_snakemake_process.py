"""A run reports what failed, and ends all processes that it started."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from echotruth.workflow import lease
from echotruth.workflow.progress import Progress
from echotruth.workflow.snakemake_process import LOG_LINES, Snakemake, execute


def python(code):
    return [sys.executable, "-c", code]


def run(*codes, log, at_once=1):
    """Run programs that stand for Snakemakes, the first with this log and each other with one beside it."""
    logs = [log, *(log.with_stem(f"{log.stem}_{number}") for number in range(1, len(codes)))]
    runs = [Snakemake(python(code), path) for code, path in zip(codes, logs, strict=True)]
    return execute(runs, "demo", Progress({}), at_once=at_once)


def test_words_of_snakemake_are_in_the_log_and_not_on_the_terminal(tmp_path, capfd):
    log = tmp_path / "logs/snakemake.log"
    assert run("print('Building DAG of jobs...')", log=log) == 0
    assert "Building DAG" in log.read_text()
    assert capfd.readouterr() == ("", "")


def test_failed_job_is_reported_by_the_end_of_its_log_and_the_status(tmp_path, capfd):
    job = tmp_path / "mid.log"
    job.write_text("\n".join(f"line {number}" for number in range(100)))
    output = f"Error in rule rf:\n    jobid: 3\n    log: {job} (check log file(s) for error details)\n"
    assert run(f"print({output!r}); exit(1)", log=tmp_path / "snakemake.log") == 1
    message = capfd.readouterr().err
    assert f"The last lines of {job}" in message and "line 99" in message
    assert f"line {100 - LOG_LINES}\n" in message and f"line {99 - LOG_LINES}\n" not in message


def test_failure_before_any_job_is_reported_by_snakemakes_own_log(tmp_path, capfd):
    log = tmp_path / "snakemake.log"
    assert run("print('no such rule'); exit(2)", log=log) == 2
    message = capfd.readouterr().err
    assert str(log) in message and "no such rule" in message


def test_failed_jobs_of_one_snakemake_do_not_keep_the_next_from_running(tmp_path, capfd):
    log = tmp_path / "snakemake.log"
    assert run("exit(1)", "print('second')", log=log) == 1
    assert "second" in (tmp_path / "snakemake_1.log").read_text()
    assert run("exit(2)", "print('third')", log=tmp_path / "wrong.log") == 2
    assert not (tmp_path / "wrong_1.log").exists(), "an option that is wrong is wrong for all"


def test_snakemakes_run_one_after_another_or_side_by_side(tmp_path):
    """Each waits for the file of the other: alone, it ends without it."""
    code = "import sys, time; from pathlib import Path; Path({0!r}).touch(); end = time.monotonic() + {2}\n"
    code += "while not Path({1!r}).exists():\n    time.monotonic() < end or sys.exit(1)\n    time.sleep(0.05)"
    one, other = str(tmp_path / "one"), str(tmp_path / "other")
    assert run(code.format(one, other, 0.5), log=tmp_path / "alone.log") == 1
    (tmp_path / "one").unlink()
    pair = code.format(one, other, 60), code.format(other, one, 60)
    assert run(*pair, log=tmp_path / "pair.log", at_once=2) == 0


def is_running(number):
    """Whether a process has not ended; one that has may stay in the table until its new parent asks for its status."""
    return psutil.pid_exists(number) and psutil.Process(number).status() != psutil.STATUS_ZOMBIE


STUBBORN = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(1, flush=True); time.sleep(60)"
PARENT = f"""
import subprocess, sys, time
job = subprocess.Popen([sys.executable, "-c", {STUBBORN!r}])
print("pid", job.pid, flush=True)
time.sleep(60)
"""
RUN = """
import signal, sys
from pathlib import Path
from echotruth.workflow import snakemake_process
# A shell may start background processes with SIGINT ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
snakemake_process.TERMINATION_SECONDS = 0.5
run = snakemake_process.Snakemake([sys.executable, "-c", sys.argv[1]], Path(sys.argv[2]))
snakemake_process.execute([run], "demo", snakemake_process.Progress({}))
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP], ids=lambda number: number.name)
def test_signal_ends_all_jobs(tmp_path, number):
    log = tmp_path / "snakemake.log"
    run = subprocess.Popen([*python(RUN), PARENT, str(log)], stderr=subprocess.PIPE)
    end = time.monotonic() + 60
    while not (log.is_file() and log.read_text().count("\n") == 2):
        assert time.monotonic() < end
        time.sleep(0.05)
    job = int(log.read_text().split("pid ")[1].split()[0])
    os.kill(run.pid, number)
    run.communicate(timeout=30)
    assert run.returncode != 0
    assert not is_running(job)


WRITER = """
import os, sys, time
from pathlib import Path
from echotruth.workflow import lease
lease.follow(Path(sys.argv[1]))
with open(sys.argv[2], "a", buffering=1) as file:
    for _ in range(int(sys.argv[3])):
        file.write(f"{os.getpid()}\\n")
        time.sleep(0.02)
"""
FAKE_SNAKEMAKE = f"""
import subprocess, sys
from pathlib import Path
from echotruth.workflow import lease
lease.join(Path(sys.argv[1]))
job = [sys.executable, "-c", {WRITER!r}, *sys.argv[1:]]
# As in a rule: the parent of a job is a shell.
subprocess.run(["bash", "-c", 'set -eu; {{ true; "$@"; true; }}', "job", *job], check=True)
"""
RUNNER = """
import os, sys
from pathlib import Path
from echotruth.workflow import lease, snakemake_process
folder = Path(sys.argv[2])
with lease.held(folder) as run:
    environment = os.environ | {lease.VARIABLE: run}
    command = [sys.executable, "-c", sys.argv[1], *sys.argv[2:]]
    run = snakemake_process.Snakemake(command, folder / "snakemake.log")
    sys.exit(snakemake_process.execute([run], "demo", snakemake_process.Progress({}), environment))
"""


def written(file):
    return file.read_text().split() if file.exists() else []


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def members(folder):
    """Numbers of the other processes that have a folder among their arguments."""
    named = [process for process in psutil.process_iter() if str(folder) in _arguments(process)]
    return {process.pid for process in named if process.pid != os.getpid()}


def _arguments(process):
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def run_writer(folder, file, lines):
    return subprocess.Popen(
        [*python(RUNNER), FAKE_SNAKEMAKE, str(folder), str(file), str(lines)], stderr=subprocess.PIPE
    )


@pytest.mark.slow
def test_nothing_outlives_a_runner_that_was_killed_alone(tmp_path):
    file = tmp_path / "written"
    run = run_writer(tmp_path, file, 3000)
    wait_for(lambda: written(file))
    run.kill()
    run.communicate()
    assert members(tmp_path)
    wait_for(lambda: not any(map(is_running, members(tmp_path))), 20)


@pytest.mark.slow
def test_run_started_at_once_after_its_runner_was_killed_alone_is_the_only_writer(tmp_path):
    file = tmp_path / "written"
    first = run_writer(tmp_path, file, 3000)
    wait_for(lambda: written(file))
    first.kill()
    second = run_writer(tmp_path, file, 50)
    _, errors = second.communicate(timeout=60)
    first.communicate()
    assert second.returncode == 0, errors
    assert b"continuing in its place" in errors
    writers = written(file)
    later = writers.index(writers[-1])  # all lines of the second come after all of the first
    assert len(set(writers[:later])) == 1 and set(writers[later:]) == {writers[-1]} and len(writers) - later == 50


@pytest.mark.slow
def test_nothing_outlives_a_snakemake_that_was_killed_alone(tmp_path):
    file = tmp_path / "written"
    run = run_writer(tmp_path, file, 3000)
    wait_for(lambda: written(file))
    (snakemake,) = psutil.Process(run.pid).children()
    snakemake.kill()
    run.communicate(timeout=60)
    assert run.returncode != 0
    assert not any(map(is_running, members(tmp_path)))
    assert '"released": true' in next((tmp_path / lease.NAME).glob("*.json")).read_text()
