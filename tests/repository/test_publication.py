"""A repository is published when every file is what its job wrote."""

import sys
from pathlib import Path
from shutil import copytree

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
import zarr

from echotruth.cases import expand, table
from echotruth.config import Bmode, Config, Geometry, Loop, PhaseCorrelation, Physiology, Tracking, View
from echotruth.imaging.bmode import pixel_centres
from echotruth.mechanics.geometry import left_ventricle
from echotruth.repository import layout, ledger, schema
from echotruth.repository.checksums import ChecksumError
from echotruth.repository.ledger import GATES, VIEW_STAGES
from echotruth.repository.publication import publish
from echotruth.repository.store import Store, schema_of
from echotruth.tracking import grid
from echotruth.workflow.cost import Cost
from echotruth.workflow.job import Job

CONFIG = Config(
    name="small",
    geometry=Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
    loop=Loop(frames=4),
    views={"mid": View(), "long_axis": View(plane="long_axis")},
    bmode=Bmode(size_px=64, downsampling=(1, 2)),
    tracking=Tracking(trackers={"one": PhaseCorrelation(window_px=16)}),
    cases={"seed": [1, 2]},
)
CASES = expand(CONFIG)
GROUPS = {stage: schema.written_by(stage, CONFIG) for stage in (*GATES, *VIEW_STAGES)}
JOBS = [*((stage, None) for stage in GATES), *((stage, view) for stage in VIEW_STAGES for view in CONFIG.views)]
LENGTHENS = "the mean longitudinal strain at end-systole is 0.04 and must be at most 0."


def blank(store: Store, group: str) -> dict:
    """Ones in the shape of every array of one job."""
    opened = zarr.open_group(store.path, path=group, mode="r", use_consolidated=False)
    return {array.name: np.ones(opened[array.name].shape[array.leading :]) for array in schema_of(group)}


@pytest.fixture(scope="module", autouse=True)
def script():
    """The version in a record is that of the script that runs: here, of this file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [__file__])
        yield


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    """A repository of two cases, all of whose jobs are done."""
    folder = tmp_path_factory.mktemp("done")
    (folder / "config.yaml").write_text(yaml.safe_dump(CONFIG.model_dump(mode="json")))
    rows = list(ledger.register(folder / "registry.txt", [case.id for case in CASES]))
    columns = layout.columns(table(CASES), rows)
    labels = layout.labels(CONFIG, rows, np.zeros((len(rows), 4))) | layout.positions(CONFIG, pixel_centres, grid)
    groups = schema.groups(CONFIG) | {"cases": schema.parameters(columns)}
    Store(folder / "small.zarr").lay_out(groups, layout.sizes(left_ventricle(CONFIG.geometry)), labels | columns)
    for case in CASES:
        for stage, view in JOBS:
            job = Job(folder, stage, case.id, view)
            job.commit({group: blank(job.store, group) for group in GROUPS[stage]}, Cost())
    return folder


@pytest.fixture
def folder(done, tmp_path) -> Path:
    """A copy of it of its own for every test: the jobs take much longer."""
    return copytree(done, tmp_path / "small")


def test_whole_repository_is_verified_and_opens(folder):
    summary = publish(folder)
    assert (summary["complete"], summary["implausible"], summary["failed"]) == (2, 0, 0)
    tree = xr.open_datatree(folder / "small.zarr")
    assert list(tree["cases/status"].values) == ["complete", "complete"]
    assert set(tree.attrs["code"]) == {*GATES, *VIEW_STAGES}


def test_every_file_that_a_job_wrote_is_verified(folder):
    written = {
        path
        for stage in GROUPS.values()
        for group in stage
        for array in schema_of(group)
        for path in (folder / "small.zarr" / group / array.name / "c").rglob("*")
        if path.is_file()
    }
    assert publish(folder)["files"] == len(written)


def test_publishing_twice_gives_the_same_bytes(folder):
    def content():
        return {path: path.read_bytes() for path in (folder / "small.zarr").rglob("*") if path.is_file()}

    publish(folder)
    first = content()
    publish(folder)
    assert content() == first


@pytest.mark.parametrize("harm", ["changed", "truncated", "missing"])
@pytest.mark.parametrize("group, row", [("bmode/64", (1, 0)), ("mechanics", (0,)), ("evaluation/32", (0, 1))])
def test_damaged_file_and_its_record_are_named(folder, group, row, harm):
    file = Store(folder / "small.zarr").files(group, *row)[0]
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content if harm == "changed" else content[:-1])
    if harm == "missing":
        file.unlink()
    with pytest.raises(ChecksumError) as caught:
        publish(folder)
    assert str(file) in str(caught.value)
    assert f"ledger/{group.partition('/')[0]}/{CASES[row[0]].id}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_heart_without_a_solution_is_told_with_its_reason(folder):
    for stage, view in JOBS:
        job = Job(folder, stage, CASES[1].id, view)
        job.record_without_result(
            "failed" if stage == "mechanics" else "skipped", job.skip_reason() or "no equilibrium at frame 3"
        )
    assert publish(folder)["failed"] == 1
    cases = xr.open_datatree(folder / "small.zarr")["cases"]
    assert list(cases["status"].values) == ["complete", "failed"]
    assert list(cases["reason"].values) == ["", "no equilibrium at frame 3"]


def doubt(folder):
    """The second heart measured again, and found out of bounds."""
    job = Job(folder, "physiology", CASES[1].id)
    job.set_verdict("implausible", LENGTHENS)
    job.commit({"physiology": blank(job.store, "physiology")}, Cost())


def test_heart_out_of_bounds_keeps_its_arrays_and_is_marked(folder):
    doubt(folder)
    summary = publish(folder)
    assert (summary["complete"], summary["implausible"], summary["failed"]) == (1, 1, 0)
    tree = xr.open_datatree(folder / "small.zarr")
    assert list(tree["cases/status"].values) == ["complete", "implausible"]
    assert list(tree["cases/reason"].values) == ["", LENGTHENS]
    assert (tree["mechanics/displacement"].isel(case=1) == 1).all()
    assert (tree["physiology/longitudinal_strain"] == 1).all()


@pytest.mark.parametrize("stage, view", [("phantom", "mid"), ("evaluation", "long_axis")])
def test_heart_out_of_bounds_is_imaged_only_where_the_configuration_says_so(folder, stage, view):
    doubt(folder)
    assert Job(folder, stage, CASES[0].id, view).skip_reason() == ""
    assert Job(folder, stage, CASES[1].id, view).skip_reason() == LENGTHENS
    assert Job(folder, "physiology", CASES[1].id).skip_reason() == ""
    kept = CONFIG.model_copy(update={"physiology": Physiology(exclude_implausible=False)})
    (folder / "config.yaml").write_text(yaml.safe_dump(kept.model_dump(mode="json")))
    assert Job(folder, stage, CASES[1].id, view).skip_reason() == ""
    assert publish(folder)["implausible"] == 1


@pytest.mark.parametrize("exclude", [True, False])
def test_heart_without_a_solution_is_never_measured_nor_imaged(folder, exclude):
    kept = CONFIG.model_copy(update={"physiology": Physiology(exclude_implausible=exclude)})
    (folder / "config.yaml").write_text(yaml.safe_dump(kept.model_dump(mode="json")))
    Job(folder, "mechanics", CASES[1].id).record_without_result("failed", "no equilibrium")
    for stage, view in JOBS[1:]:
        assert Job(folder, stage, CASES[1].id, view).skip_reason() == "no equilibrium"


@pytest.mark.parametrize("stage, view", [("bmode", "mid"), ("mechanics", None)])
def test_what_is_skipped_leaves_nothing_of_an_earlier_run(folder, stage, view):
    other, job = (Job(folder, stage, case.id, view) for case in CASES)
    job.record_without_result("skipped", LENGTHENS)
    for group in GROUPS[stage]:
        assert not job.store.files(group, *job.index)
        assert other.store.files(group, *other.index)


def test_case_that_left_the_configuration_is_retired(folder):
    fewer = CONFIG.model_copy(update={"cases": {"seed": [1]}})
    (folder / "config.yaml").write_text(yaml.safe_dump(fewer.model_dump(mode="json")))
    assert publish(folder)["complete"] == 1
    assert list(xr.open_datatree(folder / "small.zarr")["cases/status"].values) == ["complete", "retired"]


def test_table_of_cases_has_a_row_a_case(folder):
    publish(folder)
    tree = xr.open_datatree(folder / "small.zarr")
    frame = pd.DataFrame({"seed": tree["cases/seed"].values}, index=tree["cases/case"].values)
    assert frame["seed"].to_dict() == {case.id: case.config.seed for case in CASES}
