"""The workflow is a plain one: whatever Snakemake documents works on it, and its scripts are run by hand."""

import re
import runpy
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from rigid_hearts import CONFIG
from workspace import ROOT, Workspace, differing

from echotruth.repository import ledger
from echotruth.repository.ledger import STAGES

SCRIPTS = sorted((ROOT / "workflow/scripts").glob("[!_]*.py"))
RULES = [*STAGES, "repository", "report"]
ASKED = [rule for rule in RULES if rule != "inference"]
"""Rules that have jobs if no tracker is named to infer from."""
TINY = ("--configfile", "tiny.yaml", "--cores", "2")
ONE = CONFIG.replace("seed: [1, 2]", "seed: [1]")
PLACE = {"case": "heart", "view": "mid", "size": "128"}
"""The one heart of this configuration, its view and its size."""


@pytest.fixture
def empty(tmp_path) -> Workspace:
    """A folder with a configuration and nothing else."""
    return Workspace(tmp_path / "echotruth", ONE)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Workspace:
    """A folder in which plain Snakemake made the repository and its report."""
    workspace = Workspace(tmp_path_factory.mktemp("made") / "echotruth", ONE)
    workspace.snakemake(*TINY)
    return workspace


def test_a_rule_and_a_script_stand_for_every_stage():
    assert {path.stem for path in SCRIPTS} == {path.stem for path in (ROOT / "rules").glob("*.smk")} == set(RULES)


def test_plan_of_a_fresh_folder_has_jobs_of_every_stage_and_writes_nothing(empty):
    assert empty.planned() == dict.fromkeys(ASKED, 1)
    assert not empty.out.exists()


def test_demo_is_the_default_configuration(empty):
    assert "out/demo/ledger/mechanics/" in empty.snakemake("-n", "--cores", "1")


def test_graph_of_rules_names_every_stage(empty):
    graph = empty.snakemake(*TINY, "--rulegraph")
    assert set(re.findall(r'label = "(\w+)"', graph)) == {"all", *ASKED}


def test_linter_of_snakemake_finds_nothing(empty):
    assert "Congratulations" in empty.snakemake(*TINY, "--lint")


def test_wrong_configuration_is_told_in_one_sentence(empty):
    empty.write(CONFIG + "phantoms: {}\n")
    output = empty.snakemake(*TINY, "-n", status=1)
    assert "did you mean phantom?" in output and "Traceback" not in output


@pytest.mark.slow
def test_after_a_run_nothing_is_left_to_do_and_the_store_is_up_to_date(made):
    assert made.planned() == {}
    assert "Nothing to be done" in made.snakemake(*TINY, "out/tiny/tiny.zarr")
    assert not (made.out / "scratch").exists()


@pytest.mark.slow
def test_command_passes_targets_and_options_on(made):
    output = made.echotruth("run", "tiny.yaml", "repository", "-n", "--rerun-triggers", "mtime")
    assert "Nothing to be done" in output


@pytest.mark.slow
def test_report_of_snakemake_shows_the_figures(made):
    made.snakemake(*TINY, "--report", "report.zip")
    names = {Path(name).name for name in zipfile.ZipFile(made.folder / "report.zip").namelist()}
    assert {path.name for path in made.out.glob("figures/*.png")} | {"clip.gif", "report.html"} <= names


@pytest.mark.slow
def test_every_job_has_a_log_and_a_benchmark_of_snakemake(made):
    records = {path.relative_to(made.out / "ledger").with_suffix("") for path in made.out.glob("ledger/*/**/*.json")}
    assert len(records) == len(STAGES) - 1  # nothing is inferred
    for folder, suffix in (("logs", ".log"), ("benchmarks", ".tsv")):
        found = {path.relative_to(made.out / folder).with_suffix("") for path in made.out.glob(f"{folder}/*/**/*.*")}
        assert found == records and (made.out / folder / f"report{suffix}").is_file()
    assert next(made.out.glob("benchmarks/rf/**/*.tsv")).read_text().startswith("s\th:m:s\tmax_rss\t")


OWN = """\
import yaml
from echotruth.workflow.plan import Plan

with open("tiny.yaml") as file:
    CONFIG = yaml.safe_load(file)

module echotruth:
    snakefile: "{snakefile}"
    config: CONFIG

use rule * from echotruth

onstart:  # Snakemake does not run that of a module
    Plan(CONFIG).begin()

rule sizes:
    default_target: True
    input: rules.store.output
    output: "sizes.txt"
    shell: "du -a {{input}} > {{output}}"
"""


@pytest.mark.slow
def test_workflow_is_a_module_of_another_whose_rule_takes_the_store(made, empty):
    own = empty.folder / "Snakefile"
    own.write_text(OWN.format(snakefile=ROOT / "Snakefile"))
    output = empty.snakemake("--cores", "2", file=own)
    assert "out/tiny/tiny.zarr/bmode" in (empty.folder / "sizes.txt").read_text(), output
    assert differing(empty.out, made.out) == []
    assert empty.planned(None, "out/tiny/tiny.zarr") == {} and set(empty.planned()) == {"report"}


def by_hand(workspace: Workspace, stage: str, *arguments: str, status: int = 0) -> str:
    return workspace.run(sys.executable, str(ROOT / f"workflow/scripts/{stage}.py"), *arguments, status=status)


def places(stage: str) -> list[str]:
    return [PLACE[name] for name in STAGES.get(stage, ())]


@pytest.mark.slow
def test_scripts_are_run_by_hand_one_after_the_other(made, empty):
    shutil.copytree(made.out, empty.out)
    for record in empty.out.glob("ledger/*/**/*.json"):
        for name in ledger.read(record)["sha256"]:
            (empty.out / "tiny.zarr" / name).unlink()
        record.unlink()
    (empty.out / "ledger/repository.json").unlink()
    (empty.out / "report.html").unlink()
    for stage in ["mechanics", "phantom", "rf", "truth", "bmode", "tracking", "repository"]:
        by_hand(empty, stage, "out/tiny", *places(stage))
    assert differing(empty.out, made.out) == []
    by_hand(empty, "report", "out/tiny")
    assert (empty.out / "report.html").is_file()


@pytest.mark.parametrize("stage", RULES)
def test_script_says_what_it_takes(stage, monkeypatch, capsys):
    path = ROOT / f"workflow/scripts/{stage}.py"
    monkeypatch.setattr(sys, "argv", [str(path), "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(path), run_name="__main__")
    output = capsys.readouterr().out
    assert ended.value.code == 0 and output.startswith(f"usage: {stage}.py")
    assert "folder of the repository" in output and "\n\n" in output


def assert_sentence(output: str, *words: str) -> None:
    """Output is one line, and has some words."""
    assert output.count("\n") == 1 and "Traceback" not in output and all(word in output for word in words), output


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["tracking", "repository", "report"])  # those of all jobs have one beginning
def test_folder_that_is_no_repository_is_refused_in_one_sentence(empty, stage):
    (empty.folder / "out/tiny").mkdir(parents=True)
    output = by_hand(empty, stage, "out/tiny", *places(stage), status=1)
    assert_sentence(output, f"{stage}: out/tiny: is not a repository: give the folder that a run made")
    assert not list(empty.out.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(("stage", "wrong", "words"), [
    ("mechanics", {"case": "nobody"}, ["nobody", "the ids are in cases.csv"]),
    ("rf", {"case": "nobody"}, ["nobody", "the ids are in cases.csv"]),
    ("rf", {"view": "side"}, ["side is not a view of out/tiny: use mid"]),
    ("bmode", {"size": "100"}, ["100 is not an image size of out/tiny: use 128"]),
    ("rf", {}, ["scatterers.npz: is not there: run the stage phantom first"]),
    ("bmode", {}, ["lines.npz: is not there: run the stage rf first"]),
])  # fmt: skip
def test_wrong_place_is_refused_in_one_sentence(made, stage, wrong, words):
    arguments = [(PLACE | wrong)[name] for name in STAGES[stage]]
    assert_sentence(by_hand(made, stage, "out/tiny", *arguments, status=1), f"{stage}: ", *words)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_scripts_are_short(path):
    assert len(path.read_text().splitlines()) <= 40


DOCUMENTED = {"snakemake.utils", "snakemake.api", "snakemake.exceptions"}
"""Modules that Snakemake documents for others."""
INTERNAL = re.compile(r"(?<!docs/)\bworkflow\.(?!cores\b)\w+|\b(?:rules|checkpoints)\._\w+")
"""Attributes of Snakemake's objects that it does not document for rules."""


def sources() -> list[Path]:
    found = [path for name in ("src", "workflow", "benchmarks", "tests") for path in (ROOT / name).rglob("*.py")]
    return [path for path in found if "__pycache__" not in path.parts]


def test_no_file_imports_an_internal_of_snakemake():
    """Also in texts that are run as programs."""
    statement = re.compile(r"(?m)^\s*(?:from|import) (snakemake\b[\w.]*)")
    used = {path: set(statement.findall(path.read_text())) for path in sources()}
    assert {path: names for path, names in used.items() if names - DOCUMENTED} == {}


def test_no_rule_uses_an_internal_of_snakemake():
    rules = [ROOT / "Snakefile", *(ROOT / "rules").glob("*.smk")]
    found = {path.name: INTERNAL.findall(_code(path)) for path in rules}
    assert {name: uses for name, uses in found.items() if uses} == {}
    assert not [path.name for path in rules if re.search(r"(?:import|from) snakemake(?!\.utils)", path.read_text())]


def _code(path: Path) -> str:
    """Text of a file of rules without imports, of which those from the package have a part named workflow."""
    return re.sub(r"(?m)^from .*$", "", path.read_text())


def test_checkout_and_package_run_the_same_files():
    code = "from echotruth.config import shipped; print(shipped.ROOT)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()) == ROOT
