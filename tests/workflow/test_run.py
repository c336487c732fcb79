"""The command `echotruth run` on the way to Snakemake, and what it says of how Snakemake ended."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import chdir
from pathlib import Path

import psutil
import pytest
from cli.command_line import run_cli

from echotruth.cli import parser
from echotruth.cli.snakemake import FOLDER, given, jobs_at_once, problem, split_targets
from echotruth.workflow.progress import Progress
from echotruth.workflow.run import execute, snakemake_command

PACKAGED = ["--workflow-profile", str(FOLDER / "slurm")]


def parsed(*options):
    """Arguments of a run, as the command line gives them."""
    arguments, arguments.options = parser().parse_known_args(["run", "tiny.yaml", *options])
    return arguments


def refused(capsys, *options):
    """What is said of options that the command does not take."""
    with pytest.raises(SystemExit) as left:
        parsed(*options)
    assert left.value.code == 2
    return capsys.readouterr().err


@pytest.mark.parametrize("options", [["--profile", "slurm"], ["--profile=slurm"]])
def test_profile_of_the_package_is_found_by_its_name(tmp_path, options):
    with chdir(tmp_path):
        assert given(parsed("--cores", "2", *options, "-p")) == (["--cores", "2", *PACKAGED, "-p"], [])


@pytest.mark.parametrize(
    "options", [["--jobs", "5", "--retries", "2"], ["--profile", "none"], ["--dry-run", "-k"], ["--batch", "all=1/2"]]
)
def test_other_options_stay_as_they_are(tmp_path, options):
    with chdir(tmp_path):
        assert given(parsed(*options)) == (options, [])


def test_folder_of_the_user_is_preferred_to_a_profile_of_its_name_and_can_stand_beside_one(tmp_path):
    with chdir(tmp_path):
        Path("mine").mkdir()
        assert given(parsed("--profile", "slurm", "--profile", "mine"))[0] == [*PACKAGED, "--profile", "mine"]
        Path("slurm").mkdir()
        assert given(parsed("--profile", "slurm"))[0] == ["--profile", "slurm"]


@pytest.mark.parametrize("options", [["--cores", "0"], ["-c", "-1"], ["--cores", "two"]])
def test_number_of_cores_with_which_nothing_would_ever_run_is_refused(capsys, options):
    assert "is not a whole number above 0" in refused(capsys, *options)


@pytest.mark.parametrize(
    ("options", "expected"),
    [(["--cores", "3"], 3), (["--cores=5"], 5), (["-c", "2"], 2), (["-j", "9"], 9), (["--profile", "slurm"], 200)],
)
def test_cores_are_those_that_the_options_or_the_profile_give(tmp_path, options, expected):
    with chdir(tmp_path):
        assert jobs_at_once(parsed(*options)) == expected
        assert jobs_at_once(parsed("--cores", "all")) == len(os.sched_getaffinity(0))


@pytest.mark.parametrize("option", ["--config", "-C", "--configfile"])
def test_configuration_is_not_changed_behind_its_file(option):
    assert problem(parsed(option, "seed=3")) == f"{option}: change the file of the configuration"


def test_configuration_or_misspelt_name_is_not_taken_for_a_profile(tmp_path, monkeypatch, capsys):
    (tmp_path / "mine").mkdir()
    (tmp_path / "config.yaml").write_text("jobs: 2\n")
    (tmp_path / "tiny.yaml").write_text("name: tiny\n")
    (tmp_path / "home/snakemake/cluster").mkdir(parents=True)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    with chdir(tmp_path):
        known = "mine", "slurm", "none", "config.yaml", "cluster"
        assert [problem(parsed("--profile", name)) for name in known if name != "slurm"] == [""] * 4
        swapped, misspelt = (refused(capsys, "--profile", name) for name in ("tiny.yaml", "slrm"))
    remedy = "(did you mean slurm?): give default or slurm, or a folder that holds a config.yaml"
    assert f"slrm is not a profile {remedy}" in misspelt
    assert "tiny.yaml is not a profile: give" in swapped and "slurm" in swapped


@pytest.mark.parametrize(("said", "options", "targets"), [
    ("--cores 2 repository", "--cores 2", "repository"),
    ("repository -n", "-n", "repository"),
    ("--rerun-triggers mtime report -p", "--rerun-triggers mtime -p", "report"),
    ("--forcerun repository", "--forcerun repository", ""),
    ("-R repository --cores 2 all", "-R repository --cores 2", "all"),
    ("out/tiny/tiny.zarr/hearts/heart/zarr.json -k", "-k", "out/tiny/tiny.zarr/hearts/heart/zarr.json"),
    ("-R rf -- a b", "-R rf", "a b"),
])  # fmt: skip
def test_what_is_to_be_made_is_told_from_options(said, options, targets):
    assert split_targets(said.split()) == (options.split(), targets.split())


@pytest.mark.parametrize(("executor", "remedy"), [("slurm", "[slurm]'"), ("lsf", "executor-plugin-lsf")])
def test_missing_package_of_the_executor_of_a_profile_is_named_with_its_remedy(tmp_path, monkeypatch, executor, remedy):
    monkeypatch.setattr("echotruth.cli.snakemake.find_spec", lambda name: None)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/config.yaml").write_text(f"executor: {executor}\n")
    with chdir(tmp_path):
        error = problem(parsed("--profile", "mine"))
        assert error.endswith(remedy) and "pip install" in error
        assert problem(parsed("--profile", "mine", "--estimate")) == ""
        assert problem(parsed()) == ""


@pytest.mark.parametrize("content", [b"jobs: [1", b"jobs: \xff"])
def test_profile_that_is_no_yaml_is_refused_with_its_file(tmp_path, content):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/config.yaml").write_bytes(content)
    with chdir(tmp_path), pytest.raises(ValueError, match=r"^mine/config.yaml: is no YAML .* correct it"):
        problem(parsed("--profile", "mine"))


def test_targets_come_after_all_options_since_snakemake_takes_them_for_configurations():
    command = snakemake_command("a.yaml", ["--cores", "2"], ["report"])
    assert command[-2:] == ["--", "report"] and command[command.index("--configfile") + 1] == "a.yaml"
    assert command[command.index("--configfile") + 2].startswith("--") and "--nolock" in command


def executed(tmp_path, code, rule="rf"):
    """Exit status of a program in place of Snakemake."""
    return execute([sys.executable, "-c", code], tmp_path, Progress({rule: 1}))


def test_output_is_kept_and_the_log_of_a_failed_job_is_shown(tmp_path, capfd):
    (tmp_path / "rf.log").write_text("\n".join(f"line {number}" for number in range(40)))
    said = f"Error in rule rf:\n    jobid: 1\n    log: {tmp_path / 'rf.log'} (check log file(s))\n"
    assert executed(tmp_path, f"print({said!r}); raise SystemExit(3)") == 3
    errors = capfd.readouterr().err
    assert "line 39" in errors and "line 10\n" not in errors and f"The last lines of {tmp_path / 'rf.log'}" in errors
    assert (tmp_path / "logs/snakemake.log").read_text().startswith("Error in rule rf:")


def test_without_a_failed_job_the_output_itself_is_shown(tmp_path, capfd):
    assert executed(tmp_path, "print('no such rule'); raise SystemExit(1)") == 1
    assert "no such rule" in capfd.readouterr().err
    assert executed(tmp_path, "print('done')") == 0 and "done" not in capfd.readouterr().err


def test_run_that_begins_beside_another_leaves_its_log_alone(tmp_path):
    another = (
        f"from pathlib import Path; from echotruth.workflow.run import execute; execute([], Path({str(tmp_path)!r}), 0)"
    )
    assert executed(tmp_path, f"print('first', flush=True); {another}") == 1
    said = (tmp_path / "logs/snakemake.log").read_text().splitlines()
    assert said[0] == "first" and said[-1].endswith(
        f"LockError: {tmp_path}: another run works on it: wait for it, or stop it"
    )
    assert executed(tmp_path, "print('next')") == 0
    assert (tmp_path / "logs/snakemake.log").read_text() == "next\n"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_signal_ends_snakemake_with_all_that_it_started(tmp_path, number):
    code = "import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(99)'])"
    before = set(psutil.Process().children(recursive=True))

    def started():
        # A browser of another test may start processes of its own meanwhile.
        others = {process for one in before if one.is_running() for process in one.children(recursive=True)}
        return set(psutil.Process().children(recursive=True)) - before - others

    def send():
        while len(started()) < 2:
            time.sleep(0.05)
        os.kill(os.getpid(), number)

    inherited = signal.signal(number, signal.SIG_DFL)  # nohup has it ignored
    threading.Thread(target=send, daemon=True).start()
    try:
        with pytest.raises(SystemExit) as ended:
            executed(tmp_path, f"{code}; time.sleep(99)")
    finally:
        signal.signal(number, inherited)
    assert ended.value.code == 128 + number and not started()


def mounted(folder: Path) -> None:
    """Mount a small file system that cannot be written, if this machine allows it."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "ro,size=1m", "tmpfs", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("file systems cannot be mounted here")


def test_folder_that_cannot_be_written_is_told_in_one_line(tmp_path):
    (tmp_path / "tiny.yaml").write_text("name: tiny")
    mounted(tmp_path / "read_only")
    try:
        status, output, errors = run_cli("run", tmp_path / "tiny.yaml", cwd=tmp_path / "read_only")
    finally:
        subprocess.run(["umount", str(tmp_path / "read_only")], check=True)
    assert status == 2 and not output and errors.count("\n") == 1 and "Read-only file system" in errors
