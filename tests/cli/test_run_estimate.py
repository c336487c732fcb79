"""`echotruth run --estimate` runs nothing, and the absurd is refused before anything runs."""

from contextlib import chdir
from unittest.mock import patch

import pytest
from cli.command_line import run_cli

from echotruth.cases import expand
from echotruth.cli.estimation import estimated
from echotruth.config import Config

ABSURD = """
name: absurd
geometry: {preset: human}
rf: {focus_mm: 40, focal_zones: 1}
bmode: {field_of_view_mm: 45}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "absurd.yaml").write_text(ABSURD)
    (tmp_path / "small.yaml").write_text("name: small\ncases: {seed: [1, 2]}\n")
    return tmp_path


def test_estimate_runs_nothing_and_writes_nothing(folder):
    before = set(folder.rglob("*"))
    status, output, errors = run_cli("run", "small.yaml", "--estimate", "--cores", "4", cwd=folder)
    assert status == 0 and not errors
    for word in (
        "hearts: 2, views of each: 4",
        "mechanics",
        "tracking",
        "on 4 cores",
        "GB for the largest job",
        "files",
    ):
        assert word in output
    assert set(folder.rglob("*")) == before


@pytest.mark.parametrize("options", [[], ["--estimate"], ["--cores", "2"]])
def test_absurd_is_refused_in_one_sentence_that_names_the_key(folder, options):
    status, _, errors = run_cli("run", "absurd.yaml", *options, cwd=folder)
    assert status == 2 and "echotruth: bmode.field_of_view_mm = 45:" in errors
    assert not (folder / "out").exists()


def test_absurd_is_run_if_it_is_asked_for_all_the_same(folder):
    with patch("echotruth.cli.run.make_repository", return_value=0) as make:
        status, _, errors = run_cli("run", "absurd.yaml", "--yes", cwd=folder)
    assert status == 0 and make.called and "echotruth: bmode" not in errors


def test_check_tells_what_a_run_takes(folder):
    status, output, _ = run_cli("check", "small.yaml", cwd=folder)
    assert status == 0 and "valid; cases: 2," in output and "of CPU time" in output


def test_check_fails_where_a_run_would_be_refused(folder):
    status, output, errors = run_cli("check", "absurd.yaml", cwd=folder)
    assert status == 1 and "absurd.yaml: valid" in output and "echotruth: bmode.field_of_view_mm = 45:" in errors


@pytest.mark.parametrize("options, cores", [
    (["--cores", "3"], 3), (["--cores=5"], 5), (["-c", "2"], 2), (["-c7"], 7), (["-j", "9"], 9),
    (["--profile", "slurm"], 200), (["--profile", "slurm", "--jobs", "30"], 30),
])  # fmt: skip
def test_cores_are_those_that_the_options_give(tmp_path, options, cores):
    with chdir(tmp_path):
        found, _ = estimated(Config(), expand(Config()), options)
    assert found.cores == cores
