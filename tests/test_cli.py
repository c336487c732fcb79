"""The command says what it does, and what is wrong, in one line."""

import io
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

import pandas as pd
import pytest

import echotruth
from echotruth.cases import expand
from echotruth.cli import main
from echotruth.config.loading import load

ROOT = Path(__file__).parents[1]


def echotruth_(*arguments, cwd=ROOT):
    """Status, output and errors of the command, without the start of a process."""
    said, complaint, status = io.StringIO(), io.StringIO(), 0
    with chdir(cwd), redirect_stdout(said), redirect_stderr(complaint):
        try:
            with patch("sys.argv", ["echotruth", *map(str, arguments)]):
                main()
        except SystemExit as left:
            status = left.code
            if isinstance(status, str):  # as the interpreter does it
                print(status, file=sys.stderr)
                status = 1
    return status or 0, said.getvalue(), complaint.getvalue()


def as_process(*arguments):
    """The same of a process of its own."""
    command = [sys.executable, "-c", "from echotruth.cli import main; main()", *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def refused(status, said, complaint):
    """A failure told in one line of stderr."""
    return status != 0 and not said and complaint.count("\n") == 1 and "Traceback" not in complaint


@pytest.mark.parametrize("name, cases", [("demo", 1), ("sweep", 108), ("human", 1)])
def test_check_accepts_a_shipped_configuration(name, cases):
    status, said, complaint = echotruth_("check", f"config/{name}.yaml")
    assert (status, complaint) == (0, "")
    assert f"fine, {cases} case" in said


BAD = {
    "fibres: {endo_deg: 95}": "fibres.endo_deg = 95",
    "geometri: {}": "did you mean geometry?",
    "a: [": "line 1",
    "cases: {loop.frames: [10, 20]}": "loop.frames cannot be swept",
    "cases: {fibres.endo_deg: [60, 95]}": "endo_deg = 95",
    "cases: {seed: [1, 1]}": "list each value once",
    "loop: {file: nowhere.csv}": "nowhere.csv",
    "seed: 1\nseed: 2": "stands twice",
    "3": "mapping",
}


@pytest.mark.parametrize("text", BAD, ids=lambda text: text.replace(" ", ""))
def test_bad_configuration_is_refused_in_one_line(tmp_path, text):
    (tmp_path / "bad.yaml").write_text(text)
    status, said, complaint = echotruth_("check", "bad.yaml", cwd=tmp_path)
    assert refused(status, said, complaint), complaint
    assert "bad.yaml" in complaint and BAD[text] in complaint


@pytest.mark.parametrize("command", ["cases", "run"])
def test_other_commands_check_before_they_start(tmp_path, command):
    (tmp_path / "bad.yaml").write_text("geometri: {}")
    assert refused(*echotruth_(command, "bad.yaml", cwd=tmp_path))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name, content", [("nowhere.yaml", None), ("binary.yaml", b"\xff\xfe\x00"), ("folder", "")])
def test_what_is_not_a_text_file_is_refused_in_one_line(tmp_path, name, content):
    if content == "":
        (tmp_path / name).mkdir()
    elif content:
        (tmp_path / name).write_bytes(content)
    status, said, complaint = echotruth_("check", name, cwd=tmp_path)
    assert refused(status, said, complaint) and name in complaint, complaint


def test_unknown_option_is_refused_in_one_line():
    assert refused(*echotruth_("check", "config/demo.yaml", "--cores", "2"))


def test_evaluation_of_no_repository_is_refused_in_one_line(tmp_path):
    status, said, complaint = echotruth_("evaluate", "out/demo", "--tracker", "mypackage:track", cwd=tmp_path)
    assert refused(status, said, complaint) and "out/demo is not a repository" in complaint
    assert not list(tmp_path.iterdir())


def test_run_outside_a_checkout_is_refused_in_one_line(tmp_path):
    status, said, complaint = echotruth_("run", ROOT / "config/demo.yaml", cwd=tmp_path)
    assert refused(status, said, complaint) and "no Snakefile here" in complaint
    assert not list(tmp_path.iterdir())


def test_help_names_every_command():
    status, said, _ = echotruth_("--help")
    assert status == 0
    assert all(command in said for command in ("check", "cases", "run", "validate", "export", "evaluate"))


def test_version():
    assert echotruth_("--version")[1].strip() == echotruth.__version__


@pytest.mark.parametrize("arguments", [("check", "config/demo.yaml"), ("check", "nowhere.yaml")])
def test_process_ends_with_the_same_words_and_status(arguments):
    assert as_process(*arguments) == echotruth_(*arguments)


def test_cases_are_printed_as_a_table_of_their_own_parameters():
    status, said, complaint = echotruth_("cases", "config/sweep.yaml")
    assert (status, complaint) == (0, "")
    printed, cases = pd.read_csv(io.StringIO(said)), expand(load(ROOT / "config/sweep.yaml"))
    assert list(printed["case"]) == [case.id for case in cases]
    for key in cases[0].parameters:
        assert list(printed[key]) == [case.parameters[key] for case in cases]
