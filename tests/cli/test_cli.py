"""Output and one-line errors of the command line."""

import io
import subprocess
import sys

import pandas as pd
import pytest
import yaml
from cli.command_line import ROOT, run_cli
from finished_repository import configured, finish

import echotruth
from echotruth.cases import expand
from echotruth.cli.run import NO_HEART
from echotruth.config.loading import load
from echotruth.workflow.failure import CaseFailed


def run_process(*arguments, cwd=ROOT):
    """Status, output and errors of the command, run in a process of its own."""
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", *map(str, arguments)]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def is_refused(status, output, errors):
    """Whether a command failed with one line on stderr."""
    return status != 0 and not output and errors.count("\n") == 1 and "Traceback" not in errors


@pytest.mark.parametrize("command", ["cases", "run"])
def test_other_commands_check_before_they_start(tmp_path, command):
    (tmp_path / "bad.yaml").write_text("geometri: {}")
    assert is_refused(*run_cli(command, "bad.yaml", cwd=tmp_path))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name, content", [("nowhere.yaml", None), ("binary.yaml", b"\xff\xfe\x00"), ("folder", "")])
def test_what_is_not_a_text_file_is_refused_in_one_line(tmp_path, name, content):
    if content == "":
        (tmp_path / name).mkdir()
    elif content:
        (tmp_path / name).write_bytes(content)
    status, output, errors = run_cli("check", name, cwd=tmp_path)
    assert is_refused(status, output, errors) and name in errors, errors


@pytest.mark.parametrize(
    ("status", "last"),
    [
        (2, "echotruth: Snakemake does not take these options: see echotruth run --help"),
        (1, "echotruth: not finished: run the same command again to go on (echotruth status out/demo)"),
    ],
)
def test_end_of_snakemake_is_told_by_its_status(tmp_path, monkeypatch, status, last):
    monkeypatch.setattr("echotruth.workflow.run.execute", lambda *_: status)
    found, output, errors = run_cli("run", ROOT / "config/demo.yaml", "--coress", "2", cwd=tmp_path)
    assert (found, output) == (status, "") and errors.splitlines()[-1] == last


def test_run_that_makes_no_report_names_the_output_of_snakemake(tmp_path, monkeypatch):
    monkeypatch.setattr("echotruth.workflow.run.execute", lambda *_: 0)
    status, output, _ = run_cli("run", ROOT / "config/demo.yaml", "repository", cwd=tmp_path)
    assert (status, output) == (0, "No report yet; what Snakemake said is in out/demo/logs/snakemake.log\n")


def test_run_whose_hearts_all_fail_has_a_status_of_its_own(tmp_path, monkeypatch):
    def execute(*_):
        finish(tmp_path / "out/small", config, fail)
        (tmp_path / "out/small/report.html").touch()
        return 0

    def fail(job):
        raise CaseFailed("no equilibrium")

    config = configured(views=("mid",), cases={})
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(config.model_dump(mode="json")))
    monkeypatch.setattr("echotruth.workflow.run.execute", execute)
    status, output, _ = run_cli("run", "small.yaml", cwd=tmp_path)
    assert status == NO_HEART and "Hearts: 1 failed\n  heart: failed: no equilibrium\n" in output
    assert output.endswith("No heart is complete, so there are no images.\n")


ABSURD = "geometry: {preset: human}\nrf: {focus_mm: 40, focal_zones: 1}\nbmode: {field_of_view_mm: 45}\n"


def test_absurd_is_refused_and_run_if_it_is_asked_for_and_an_estimate_runs_nothing(tmp_path, monkeypatch):
    (tmp_path / "absurd.yaml").write_text(ABSURD)
    status, _, errors = run_cli("run", "absurd.yaml", cwd=tmp_path)
    assert status == 2 and "echotruth: bmode.field_of_view_mm = 45:" in errors and not (tmp_path / "out").exists()
    status, output, errors = run_cli("run", "absurd.yaml", "--estimate", "--cores", "4", cwd=tmp_path)
    assert status == 0 and not errors and "hearts: 1, cases: 1, views of each: 4" in output and "on 4 cores" in output
    assert run_cli("check", "absurd.yaml", cwd=tmp_path)[0] == 1 and list(tmp_path.iterdir()) == [
        tmp_path / "absurd.yaml"
    ]
    monkeypatch.setattr("echotruth.cli.run._make", lambda *_: 0)
    assert run_cli("run", "absurd.yaml", "--yes", cwd=tmp_path) == (0, "", "")


def test_version():
    assert run_cli("--version")[1].strip() == echotruth.__version__


@pytest.mark.parametrize("arguments", [("check", "config/demo.yaml"), ("check", "nowhere.yaml")])
def test_process_ends_with_the_same_words_and_status(arguments):
    assert run_process(*arguments) == run_cli(*arguments)


def test_cases_are_printed_as_a_table_of_their_own_parameters():
    status, output, errors = run_cli("cases", "config/sweep.yaml")
    assert (status, errors) == (0, "")
    printed, cases = pd.read_csv(io.StringIO(output)), expand(load(ROOT / "config/sweep.yaml"))
    assert list(printed["case"]) == [case.id for case in cases]
    for key in cases[0].parameters:
        assert list(printed[key]) == [case.parameters[key] for case in cases]
