"""The repository that comes with the package is whole and small, opens by its name, and is not written to."""

import doctest
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import echotruth as et
from echotruth.cases import expand
from echotruth.config import shipped
from echotruth.config.loading import load
from echotruth.repository import ledger
from echotruth.repository.check import check
from echotruth.repository.equivalence import first_difference
from echotruth.repository.inventory import Inventory
from echotruth.repository.provenance import packages

FOLDER = shipped.sample()
BYTES = 6_000_000


def state() -> dict[Path, int]:
    """Time of the last change of every file and folder of the sample."""
    return {path: path.stat().st_mtime_ns for path in [FOLDER, *FOLDER.rglob("*")]}


@pytest.fixture
def untouched():
    """The sample is the same after the test as before it."""
    before = state()
    yield
    assert state() == before


def test_it_is_whole_and_finished():
    report = check(FOLDER)
    assert report.faults == [] and report.notes == []
    assert report.jobs == 2 + 2 * 2 * 5


def test_it_is_that_of_the_shipped_configuration():
    made, asked = load(FOLDER / "config.yaml"), load(shipped.path_of(shipped.SAMPLE))
    assert {case.id: case.config for case in expand(made)} == {case.id: case.config for case in expand(asked)}


def test_it_is_small_and_holds_nothing_of_the_run():
    files = [path for path in FOLDER.rglob("*") if path.is_file()]
    names = {path.relative_to(FOLDER).parts[0] for path in files}
    texts = {"config.yaml", "cases.csv", "registry.txt", "views.txt"}
    assert names == {"sample.zarr", "ledger", "cases", *texts}
    assert sum(path.stat().st_size for path in files) < BYTES


def test_infarct_lowers_the_ejection_fraction_and_both_are_tracked():
    sample = et.sample()
    clip = sample.clip("infarct", "mid")
    assert clip["image"].shape == (10, 256, 256) and abs(clip["displacement"].isel(frame=0)).max() == 0
    measures = et.unpack(sample.tree["physiology"].to_dataset(), "ejection_fraction")["ejection_fraction"]
    healthy, infarct = (float(measures.sel(case=case)) for case in ("healthy", "infarct"))
    assert infarct < healthy - 0.03
    assert list(sample.cases["status"]) == ["complete", "complete"]
    scores = sample.scores
    assert len(scores) == 2 * 2 * 2 and not any(scores["failure"])
    assert scores["nrmse_all_percent"].between(0, 50).all()


def test_it_opens_by_its_name_unless_something_in_the_folder_has_it(call, tmp_path, untouched, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert et.Repository("sample").folder == FOLDER == et.sample().folder
    assert len(et.learning.FlowPairs("sample")) == 2 * 2 * 9
    status, output, _ = call("info", "sample")
    assert status == 0 and 'et.Repository("sample")' in output and "2 complete" in output
    status, output, _ = call("status", "sample")
    assert status == 0 and "is finished" in output
    (tmp_path / "sample").mkdir()
    with pytest.raises(FileNotFoundError, match="sample: is not a repository"):
        et.Repository("sample")


def test_commands_that_write_refuse_it_and_say_how_to_copy_it(call, tmp_path, untouched):
    for command in (
        ["evaluate", "sample", "--tracker", "ilk"],
        ["check", "sample", "--heal"],
        ["merge", FOLDER, "sample"],
    ):
        status, _, errors = call(*command)
        assert status == 2 and errors.count("\n") == 1 and "echotruth merge out/mine sample" in errors
    status, output, _ = call("merge", tmp_path / "mine", "sample")
    assert status == 0 and "published" in output
    assert check(tmp_path / "mine", quick=True).faults == []


def test_what_is_exported_lies_in_the_working_folder(call, tmp_path, untouched):
    status, _, errors = call(
        "export", "sample", "--format", "csv", "--case", "infarct", "--view", "mid", "--tracker", "dis"
    )
    assert (status, errors) == (0, "")
    assert [path.name for path in tmp_path.glob("out/sample/export/csv/*")] == ["infarct_mid_256.csv", "summary.csv"]


def test_difficulty_is_not_kept_in_the_package(untouched, monkeypatch):
    monkeypatch.setattr("echotruth.evaluation.difficulty.table.difficulty", lambda *_: [])
    assert et.sample().difficulty("infarct", "mid").empty


def test_it_opens_fast_as_nothing_is_imported_that_only_computing_and_tables_need(tmp_path, untouched):
    code = "import sys, echotruth as et; et.sample(); print({'numba', 'scipy', 'pandas', 'xarray'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert found.stdout == "set()\n"


@pytest.mark.slow
def test_example_of_the_package_runs(untouched):
    (found,) = doctest.DocTestFinder(recurse=False).find(et, "echotruth", globs={})
    assert doctest.DocTestRunner().run(found).failed == 0


STAGES = {"phantom": None, "truth": 256, "rf": None, "bmode": 256, "tracking": 256}
REMAKE = f"""
import runpy, sys
from pathlib import Path
from echotruth.workflow.job import Job, run
from echotruth.workflow.processes import lock_cache_writes, script

lock_cache_writes()
for stage, size in {STAGES}.items():
    run(Job(Path(sys.argv[1]), stage, "infarct", "mid", size), runpy.run_path(script(stage))["work"])
"""
"""In a process of its own: in that of the tests numpy may be older than the choice of instructions."""


@pytest.mark.slow
def test_a_view_that_is_made_again_has_the_same_bytes(tmp_path, untouched):
    again = tmp_path / "sample"
    shutil.copytree(FOLDER, again)
    for stage, size in STAGES.items():
        record = ledger.record_path(again, stage, "infarct", "mid", size)
        for file in ledger.read(record)["sha256"]:
            (again / "sample.zarr" / file).unlink()
        record.unlink()
    subprocess.run([sys.executable, "-c", REMAKE, again], check=True)
    old, new = Inventory(FOLDER), Inventory(again)
    records = [record for record in new.records() if (record.case, record.view) == ("infarct", "mid")]
    assert [record.stage for record in records] == sorted(STAGES)
    assert [first_difference(record, new, old) for record in records] == [None] * len(STAGES)
    for record in records:
        made, stored = (ledger.read(path) for path in (record.path, FOLDER / new.name(record.path)))
        if (made["instructions"], packages()) == (stored["instructions"], et.sample().attributes("")["packages"]):
            assert made["sha256"] == stored["sha256"]
