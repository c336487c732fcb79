"""The command `echotruth run` on the way to Snakemake: profiles, folders that cannot be written, names side by side."""

import shutil
import subprocess
import sys
from contextlib import chdir
from pathlib import Path

import pytest

from echotruth.cli.snakemake import FOLDER, PROFILES, executor_error, option_errors, split_targets, with_profiles

PACKAGED = ["--workflow-profile", str(FOLDER / "slurm")]


@pytest.mark.parametrize("options", [["--profile", "slurm"], ["--profile=slurm"], ["--workflow-profile", "slurm"]])
def test_profile_of_the_package_is_found_by_its_name(tmp_path, options):
    with chdir(tmp_path):
        assert with_profiles(["--cores", "2", *options, "-p"]) == ["--cores", "2", *PACKAGED, "-p"]


@pytest.mark.parametrize("options", [["slurm"], ["--config", "slurm"], ["--profile", "mine"], ["--profile"], ["-n"]])
def test_other_options_stay_as_they_are(tmp_path, options):
    with chdir(tmp_path):
        assert with_profiles(options) == options


def test_folder_of_the_user_is_preferred_to_a_profile_of_its_name(tmp_path):
    (tmp_path / "slurm").mkdir()
    with chdir(tmp_path):
        assert with_profiles(["--profile", "slurm"]) == ["--profile", "slurm"]


@pytest.mark.parametrize("options", [["--cores", "0"], ["--cores=0"], ["-j", "0"], ["-c", "-1"], ["--cores", "two"]])
def test_number_of_cores_with_which_nothing_would_ever_run_is_refused(options):
    (error,) = option_errors(options)
    assert error.startswith(options[0].split("=")[0]) and "give a whole number above 0" in error


@pytest.mark.parametrize("options", [["--cores", "2"], ["-c", "all"], ["--jobs=unlimited"], ["-j"], ["--cores", "-n"]])
def test_numbers_of_cores_that_snakemake_takes_are_no_errors(options):
    assert option_errors(options) == []


@pytest.mark.parametrize("option", ["--config", "-C", "--configfile"])
def test_configuration_is_not_changed_behind_its_file(option):
    assert option_errors([option, "seed=3"]) == [f"{option}: change the file of the configuration"]


def test_configuration_is_not_taken_for_a_profile(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "config.yaml").write_text("jobs: 2\n")
    (tmp_path / "tiny.yaml").write_text("name: tiny\n")
    with chdir(tmp_path):
        assert all(option_errors(["--profile", name]) == [] for name in ("mine", "slurm", "none", "config.yaml"))
        (swapped,) = option_errors(["--profile", "tiny.yaml"])
    assert swapped.startswith("--profile tiny.yaml: is not a profile: give") and "slurm" in swapped
    assert swapped.endswith("the file of the configuration comes before the options")
    assert is_refused(run(tmp_path, "--profile", "tiny.yaml")) and not (tmp_path / "out").exists()


def test_profile_that_is_not_there_is_told_by_snakemake(tmp_path):
    done = run(tmp_path, "--profile", "nowhere")
    assert done.returncode and "nowhere" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize(("given", "options", "targets"), [
    ("--cores 2 repository", "--cores 2", "repository"),
    ("repository -n", "-n", "repository"),
    ("--rerun-triggers mtime report -p", "--rerun-triggers mtime -p", "report"),
    ("--forcerun repository", "--forcerun repository", ""),
    ("-R repository --cores 2 all", "-R repository --cores 2", "all"),
    ("out/tiny/ledger/rf/heart/mid.json -k", "-k", "out/tiny/ledger/rf/heart/mid.json"),
    ("-R rf -- a b", "-R rf", "a b"),
])  # fmt: skip
def test_what_is_to_be_made_is_told_from_options(given, options, targets):
    assert split_targets(given.split()) == (options.split(), targets.split())


@pytest.mark.parametrize(("executor", "remedy"), [("slurm", "'echotruth[slurm]'"), ("lsf", "executor-plugin-lsf")])
def test_missing_package_of_an_executor_is_named_with_its_remedy(monkeypatch, executor, remedy):
    monkeypatch.setattr("echotruth.cli.snakemake.find_spec", lambda name: None)
    assert executor_error(executor).endswith(remedy) and "pip install" in executor_error(executor)
    assert executor_error("local") is executor_error(None) is None


def run(folder, *options):
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", "run", "tiny.yaml", *options]
    (folder / "tiny.yaml").exists() or (folder / "tiny.yaml").write_text("name: tiny")
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)


def is_refused(done):
    """Whether a run ended with one line on stderr."""
    one_line = done.stderr.count("\n") == 1 and done.stderr.startswith("echotruth: ")
    return done.returncode != 0 and not done.stdout and one_line


def test_file_in_the_place_of_the_folder_is_told_in_one_line(tmp_path):
    (tmp_path / "out").write_text("")
    done = run(tmp_path)
    assert is_refused(done) and "out/tiny" in done.stderr, done.stderr


def mounted(folder, options):
    """Mount a small file system in memory, if this machine allows it."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("file systems cannot be mounted here")


@pytest.fixture
def read_only(tmp_path):
    folder = tmp_path / "read_only"
    mounted(folder, "size=1m")
    (folder / "tiny.yaml").write_text("name: tiny")
    subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_folder_that_cannot_be_written_is_told_in_one_line(read_only):
    done = run(read_only, "--yes")  # there is no space for a repository either
    assert is_refused(done) and "Read-only file system" in done.stderr, done.stderr


@pytest.fixture
def full(tmp_path):
    folder = tmp_path / "full"
    mounted(folder, "size=64k")
    (folder / "tiny.yaml").write_text("name: tiny")
    with (folder / "rest").open("wb", buffering=0) as file:
        while True:
            try:
                file.write(bytes(4096))
            except OSError:
                break
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_full_disk_is_told_in_one_line(full):
    done = run(full)
    assert is_refused(done) and "has less than 1 MB free" in done.stderr, done.stderr
    done = run(full, "--yes")
    assert is_refused(done) and "No space left on device" in done.stderr, done.stderr


def test_help_of_run_names_profiles_and_options_of_snakemake():
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", "run", "--help"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert all(word in text for word in (*PROFILES, "--profile", "--cores", "--hearts-per-block", "-n"))


def test_dry_run_leaves_no_repository(tmp_path):
    (tmp_path / "tiny.yaml").write_text((Path(__file__).parents[2] / "config/demo.yaml").read_text())
    assert run(tmp_path, "-n").returncode == 0
    assert not (tmp_path / "out").exists()
