"""Snakemake itself: it makes the bytes that the jobs make in this process, and finds again what stands already."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
from finished_repository import content
from workspace import COMMAND, CONFIG, ROOT, Workspace, alone

from echotruth.workflow.lock import VARIABLE

SCRIPTS = sorted((ROOT / "workflow/scripts").glob("[!_]*.py"))
RULES = {"mechanics", "phantom", "rf", "truth", "bmode", "points", "tracking", "inference", "repository", "report"}
ASKED = sorted(RULES - {"inference"})


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Workspace:
    """A folder in which `echotruth run` made the repository and its report, once killed with all its jobs."""
    workspace = Workspace(tmp_path_factory.mktemp("made") / "it's $mine")
    run = workspace.start(*COMMAND, "run", "tiny.yaml", "--cores", "2")
    while not any((workspace.out / "tiny.zarr").glob("clips/*/mid/phantom/zarr.json")):
        assert run.poll() is None, run.communicate()[0]
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()
    time.sleep(0.5)
    workspace.told = workspace.echotruth("run", "tiny.yaml", "--cores", "2")
    return workspace


@pytest.mark.slow
def test_run_that_is_killed_and_run_again_on_two_cores_makes_the_bytes_of_jobs_in_one_process(made, tmp_path):
    assert content(made.out) == content(alone(tmp_path))
    assert re.search(
        r"Hearts: 1 complete\nTime: .*\nRepository: out/tiny/tiny.zarr\nReport: +out/tiny/report.html", made.told
    )
    assert (made.out / "report.html").stat().st_size > 10_000
    assert not any((made.out / "drafts").glob("*"))
    logs = {path.relative_to(made.out / "logs").with_suffix("").as_posix() for path in made.out.glob("logs/**/*.log")}
    times = {path.relative_to(made.out / "benchmarks").with_suffix("").as_posix() for path in made.out.rglob("*.tsv")}
    killed = {"phantom/heart/mid"}  # before its time was written
    assert logs - killed == {*times, "snakemake"} - killed
    assert {name.partition("/")[0] for name in logs} == {*ASKED, "snakemake"}


@pytest.mark.slow
def test_only_what_is_changed_is_made_again_in_a_copy_without_snakemakes_folder_and_with_other_dates(made, tmp_path):
    copy = Workspace(tmp_path / "copy", CONFIG.replace("size_px: 64", "size_px: 64, dynamic_range_dB: 35"))
    shutil.copytree(made.out, copy.out)
    for number, path in enumerate(copy.out.rglob("*")):
        os.utime(path, (1e9 + 977 * number % 10**6,) * 2)
    assert copy.planned() == {"bmode": 1, "tracking": 1, "repository": 1, "report": 1}


def test_graph_of_rules_is_the_way_of_a_view_and_nothing_is_written(tmp_path):
    workspace = Workspace(tmp_path / "empty")
    graph = workspace.snakemake("--rulegraph")
    names = dict(re.findall(r'(\d+)\[label = "(\w+)"', graph))
    edges = {(names[one], names[other]) for one, other in re.findall(r"(\d+) -> (\d+)", graph)}
    assert set(names.values()) == {"all", *ASKED}
    chain = ["mechanics", "phantom", "rf", "bmode", "tracking", "repository", "report"]
    assert set(pairwise(chain)) <= edges
    assert {one for one, other in edges if other == "tracking"} == {"mechanics", "truth", "bmode", "points"}
    assert {other for one, other in edges if one == "truth"} == {"tracking", "repository", "all"}
    assert not workspace.out.exists()


@pytest.mark.slow
def test_workflow_of_ones_own_takes_over_the_rules_as_the_page_says(tmp_path):
    page = (ROOT / "docs/workflow.md").read_text().partition("## A rule of your own")[2]
    snakefile, script = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[:2]
    workspace = Workspace(tmp_path / "own", CONFIG.replace("name: tiny", "name: mine"))
    (workspace.folder / "tiny.yaml").rename(workspace.folder / "mine.yaml")
    (workspace.folder / "Snakefile").write_text(snakefile)
    (workspace.folder / "volumes.py").write_text(script)
    workspace.run(sys.executable, "-m", "snakemake", "--cores", "2", "all", "volumes")
    assert len((workspace.folder / "out/mine/volumes.csv").read_text().splitlines()) == 1 + 3


def parsed(code: str, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the Python at the beginning of the Snakefile, up to where it reads the configuration, and then code."""
    text = (ROOT / "Snakefile").read_text()
    start = text[: text.index("if not config:")]
    given = f"from types import SimpleNamespace\nworkflow = SimpleNamespace(current_basedir={str(ROOT)!r})\n"
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", VARIABLE)}
    command = [sys.executable, "-c", given + start + code]
    return subprocess.run(command, cwd=folder, env=environment | variables, capture_output=True, text=True, check=True)


def test_checkout_runs_itself_whatever_is_installed(tmp_path):
    (tmp_path / "echotruth").mkdir()
    (tmp_path / "echotruth/__init__.py").write_text("raise SystemExit('another one')\n")
    done = parsed("import echotruth; print(echotruth.__file__)", tmp_path, PYTHONPATH=str(tmp_path))
    assert Path(done.stdout.strip()).parent == ROOT / "src/echotruth"


def test_a_rule_and_a_script_stand_for_every_stage_and_are_short():
    assert {path.stem for path in SCRIPTS} == {path.stem for path in (ROOT / "rules").glob("*.smk")} == RULES
    assert [path.name for path in SCRIPTS if len(path.read_text().splitlines()) > 40] == []


@pytest.mark.parametrize("stage", ["repository", "report"])
def test_script_refuses_a_folder_that_is_no_repository_in_one_sentence(stage, tmp_path, monkeypatch):
    import runpy

    monkeypatch.setattr(sys, "argv", [f"{stage}.py", str(tmp_path)])
    with pytest.raises(SystemExit, match=rf"^{stage}: .*is not a repository: give the folder that a run made"):
        runpy.run_path(str(ROOT / f"workflow/scripts/{stage}.py"), run_name="__main__")
