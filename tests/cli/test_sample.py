"""The repository that comes with the package is whole and small, opens by its name, and is not written to."""

import doctest
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cli.command_line import ROOT

import echotruth as et
from echotruth.cases import expand
from echotruth.config import shipped
from echotruth.config.loading import load
from echotruth.repository.check import check
from echotruth.repository.code import PACKAGE
from echotruth.repository.version import packages

FOLDER = shipped.sample()
BYTES = 7_500_000


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
    assert report.groups == 2 * 6 + 2 * 2 * 5, "without scatterers and lines"


@pytest.mark.slow
def test_it_is_in_the_users_cache_or_where_that_cannot_be_written_in_a_folder_that_does_not_stay(tmp_path):
    code = "import echotruth as et; et.sample().scores; print(et.sample().folder, et.sample().is_sample)"

    def folder(cache):
        environment = os.environ | {"XDG_CACHE_HOME": str(cache)}
        run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        path, is_sample = run.stdout.split()
        assert is_sample == "True"
        return Path(path)

    kept = folder(tmp_path / "cache")
    assert kept == tmp_path / "cache/echotruth" / FOLDER.name and (kept / "cases.csv").is_file()
    (tmp_path / "file").touch()
    other = folder(tmp_path / "file")
    assert tmp_path not in other.parents and not other.exists()


def test_question_whether_a_folder_is_the_sample_unpacks_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "sample", lambda: pytest.fail("it is unpacked"))
    assert not shipped.is_sample(tmp_path / "out/demo")


def test_it_is_that_of_the_shipped_configuration():
    made, asked = load(FOLDER / "config.yaml"), load(shipped.path_of(shipped.SAMPLE))
    assert {case.id: case.config for case in expand(made)} == {case.id: case.config for case in expand(asked)}


def test_it_is_small_and_holds_nothing_of_the_run():
    names = {path.name for path in FOLDER.iterdir()}
    assert names == {"sample.zarr", "cases", "config.yaml", "cases.csv", "SHA256SUMS"}
    assert (PACKAGE / "shipped/sample.zip").stat().st_size < BYTES


def test_infarct_lowers_the_ejection_fraction_and_both_are_tracked():
    sample = et.sample()
    clip = sample.clip("infarct", "mid")
    assert clip["image"].shape == (10, 256, 256) and abs(clip["displacement"].isel(frame=0)).max() == 0
    healthy, infarct = (
        float(sample.arrays("physiology", case)["ejection_fraction"]) for case in ("healthy", "infarct")
    )
    assert infarct < healthy - 0.03
    assert list(sample.cases["status"]) == ["complete", "complete"]
    scores = sample.scores
    assert len(scores) == 2 * 2 * 2 and not any(scores["failure"])
    assert scores["nrmse_all_percent"].between(0, 60).all()
    assert (scores["nrmse_all_percent"][scores["tracker"] == "bspline_dic"] < 40).all()


def test_it_opens_by_its_name_unless_something_in_the_folder_has_it(call, tmp_path, untouched, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert et.Repository("sample").folder == FOLDER == et.sample().folder
    assert len(et.learning.FlowPairs("sample")) == 2 * 2 * 9
    status, output, _ = call("info", "sample")
    assert status == 0 and 'et.Repository("sample")' in output and "2 complete" in output
    status, output, _ = call("status", "sample")
    assert status == 0 and "finished" in output
    (tmp_path / "sample").mkdir()
    with pytest.raises(FileNotFoundError, match="sample: is not a repository"):
        et.Repository("sample")


def test_commands_that_write_refuse_it_and_merge_copies_it(call, tmp_path, untouched):
    status, _, errors = call("evaluate", "sample", "--tracker", "window_deformation")
    assert status == 2 and errors.count("\n") == 1 and "echotruth merge sample sample copies it" in errors
    status, output, errors = call("merge", "sample", "sample")
    assert (status, errors) == (0, "") and output.startswith("out/sample: 6 hearts and clips are copied: echotruth run")
    assert (tmp_path / "out/sample/sample.zarr/clips/infarct/mid/bmode/256/zarr.json").is_file()


def test_what_is_exported_lies_in_the_working_folder(call, tmp_path, untouched):
    status, _, errors = call(
        "export", "sample", "--format", "csv", "--case", "infarct", "--view", "mid", "--tracker", "dis"
    )
    assert (status, errors) == (0, "")
    assert [path.name for path in tmp_path.glob("out/sample/export/csv/*")] == ["infarct_mid_256.csv", "summary.csv"]


def test_formats_of_rf_say_that_the_sample_has_none_and_what_makes_it(call, untouched):
    status, _, errors = call("export", "sample", "--format", "uff")
    assert status == 2 and errors.startswith(
        "echotruth: sample: comes without RF, which uff needs: echotruth run sample"
    )
    assert errors.count("\n") == 1


def test_it_opens_fast_as_nothing_is_imported_that_only_computing_and_tables_need(tmp_path, untouched):
    code = "import sys, echotruth as et; et.sample(); print({'numba', 'scipy', 'pandas', 'xarray'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert found.stdout == "set()\n"


@pytest.mark.slow
def test_example_of_the_package_runs(untouched):
    (found,) = doctest.DocTestFinder(recurse=False).find(et, "echotruth", globs={})
    assert doctest.DocTestRunner().run(found).failed == 0


REMAKE = """
import sys
from importlib import import_module
from pathlib import Path
from echotruth.workflow.job import Job, run

for job in "phantom", "truth", "points", "rf", "bmode", "tracking dis", "tracking bspline_dic":
    stage, *tracker = job.split()
    run(Job(Path(sys.argv[1]), stage, "infarct", "mid", *tracker), import_module(f"workflow.scripts.{stage}").work)
"""


@pytest.mark.slow
def test_a_view_that_is_made_again_has_the_same_values(tmp_path, untouched):
    """And the same bytes, where the versions of the packages are those that made the sample."""
    again, clip = tmp_path / "sample", "sample.zarr/clips/infarct/mid"
    shutil.copytree(FOLDER, again)
    shutil.rmtree(again / clip)
    environment = os.environ | {"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}
    subprocess.run([sys.executable, "-c", REMAKE, again], env=environment, check=True)
    made, stored = et.Repository(again), et.sample()
    for group in ("truth/256", "bmode/256"):
        found, expected = (one.arrays(group, "infarct", "mid") for one in (made, stored))
        for name, array in expected.items():
            np.testing.assert_allclose(found[name], array, atol=1 if array.dtype == "uint8" else 1e-5, err_msg=name)
    if packages() == stored.attributes("")["packages"]:
        files = [path for path in (FOLDER / clip).rglob("c/**/*") if path.is_file()]
        assert [path for path in files if path.read_bytes() != (again / path.relative_to(FOLDER)).read_bytes()] == []
