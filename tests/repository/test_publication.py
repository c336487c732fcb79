"""A repository is published when every file is what its job wrote."""

from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
import xarray as xr
import yaml
import zarr
from echotruth.workflow.stage_cost import Cost

import echotruth as et
from echotruth.cases import expand, table
from echotruth.config import Bmode, Cases, Config, Geometry, Loop, PhaseCorrelation, Physiology, Tracking, View
from echotruth.imaging.bmode import pixel_centres
from echotruth.mechanics.geometry import left_ventricle
from echotruth.repository import layout, ledger, schema
from echotruth.repository.checksums import ChecksumError
from echotruth.repository.ledger import GATES, VIEW_STAGES
from echotruth.repository.publication import publish
from echotruth.repository.store import Store, schema_of
from echotruth.tracking import grid
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


pytestmark = pytest.mark.usefixtures("script")


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    """A repository of two cases, all of whose jobs are done."""
    folder = tmp_path_factory.mktemp("done")
    (folder / "config.yaml").write_text(yaml.safe_dump(CONFIG.model_dump(mode="json")))
    rows = list(ledger.register(folder / "registry.txt", [case.id for case in CASES]))
    ledger.register(folder / "views.txt", list(CONFIG.views))
    columns = layout.columns(table(CASES), rows)
    constants = {"cases": {"constants": layout.constants(table(CASES))}}
    labels = layout.labels(CONFIG, rows, np.zeros((len(rows), 4))) | layout.positions(CONFIG, pixel_centres, grid)
    groups = schema.groups(CONFIG) | {"cases": schema.parameters(columns)}
    sizes = layout.sizes(left_ventricle(CONFIG.geometry))
    Store(folder / "small.zarr").lay_out(groups, sizes, labels | columns, constants)
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


def test_every_file_of_the_hierarchy_is_verified(folder):
    written = {path for path in (folder / "small.zarr").rglob("*") if path.is_file()}
    assert publish(folder)["files"] == len(written)
    records = [ledger.read(path)["sha256"] for path in (folder / "ledger").rglob("*.json")]
    recorded = [name for record in records for name in record]
    assert len(recorded) == len(set(recorded))
    assert {folder / "small.zarr" / name for name in recorded} == written


@pytest.mark.parametrize("name", ["zarr.json", "bmode/64/image/zarr.json", "truth/32/view/c/0", "cases/status/c/0"])
def test_damaged_structure_is_named(folder, name):
    publish(folder)
    file = folder / "small.zarr" / name
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(ChecksumError, match="differs from what was laid out: run again") as caught:
        publish(folder)
    assert str(file) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [None, "", "{", "[]", "{}"])
def test_repository_whose_structure_nothing_vouches_for_is_not_published(folder, content):
    record = folder / "ledger/structure.json"
    record.unlink()
    if content is not None:
        record.write_text(content)
    with pytest.raises(ChecksumError, match=r"structure\.json: is missing or damaged"):
        publish(folder)


def test_publishing_twice_gives_the_same_bytes(folder):
    def content():
        return {path: path.read_bytes() for path in (folder / "small.zarr").rglob("*") if path.is_file()}

    publish(folder)
    first = content()
    publish(folder)
    assert content() == first


@pytest.mark.parametrize("harm", ["changed", "truncated", "missing"])
@pytest.mark.parametrize("group, row", [("bmode/64", (1, 0)), ("mechanics", (0,)), ("evaluation", (0, 1))])
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
    assert (tree["physiology/scalars"].sel(scalar="longitudinal_strain") == 1).all()


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


def test_job_of_a_view_has_its_place_whatever_is_put_in_front_of_it(folder):
    before = {view: Job(folder, "bmode", CASES[1].id, view).index for view in CONFIG.views}
    assert before == {"mid": (1, 0), "long_axis": (1, 1)}
    changed = CONFIG.model_copy(update={"views": {"apex": View(position=0.8), **CONFIG.views}})
    (folder / "config.yaml").write_text(yaml.safe_dump(changed.model_dump(mode="json"), sort_keys=False))
    ledger.register(folder / "views.txt", list(changed.views))
    assert {view: Job(folder, "bmode", CASES[1].id, view).index for view in CONFIG.views} == before
    assert Job(folder, "bmode", CASES[1].id, "apex").index == (1, 2)


def test_case_that_left_the_configuration_is_retired(folder):
    fewer = CONFIG.model_copy(update={"cases": Cases(seed=[1])})
    (folder / "config.yaml").write_text(yaml.safe_dump(fewer.model_dump(mode="json")))
    assert publish(folder)["complete"] == 1
    assert list(xr.open_datatree(folder / "small.zarr")["cases/status"].values) == ["complete", "retired"]


def test_table_of_cases_has_a_row_a_case_and_a_column_a_key(folder):
    publish(folder)
    tree = et.Repository(folder).tree
    frame = tree["cases"].to_dataset().to_dataframe()
    expected = table(CASES).set_index("case")
    assert list(frame.index) == list(expected.index)
    assert set(frame.columns) == {"status", "reason", *expected.columns}
    for key in expected:
        text = isinstance(expected[key].iloc[0], str)
        values = list(expected[key]) if text else expected[key].astype(float).to_numpy()
        np.testing.assert_array_equal(frame[key], values, err_msg=key)
    assert tree["cases/fibres.endo_deg"].attrs == {"units": "degree", "long_name": "fibres.endo_deg"}


def test_retired_case_has_no_values_in_the_table(folder):
    fewer = CONFIG.model_copy(update={"cases": Cases(seed=[1])})
    (folder / "config.yaml").write_text(yaml.safe_dump(fewer.model_dump(mode="json")))
    publish(folder)
    frame = et.Repository(folder).tree["cases"].to_dataset().to_dataframe()
    assert np.isnan(frame["fibres.endo_deg"].iloc[1]) and frame["geometry.preset"].iloc[1] == ""
    assert frame["fibres.endo_deg"].iloc[0] == CONFIG.fibres.endo_deg


def test_groups_opened_together_have_the_labels_and_indexes_that_each_has_alone(folder):
    publish(folder)
    tree = et.Repository(folder).tree
    for group in schema.groups(CONFIG):
        alone = xr.open_zarr(folder / "small.zarr", group=group, chunks=None)
        together = tree[group].to_dataset(inherit=False)
        assert set(together.xindexes) == set(alone.xindexes) and set(alone.coords) == set(together.coords)
        for name in alone.coords:
            assert together.coords[name].variable.identical(alone.coords[name].variable), name
            assert name not in alone.xindexes or together.indexes[name].equals(alone.indexes[name])
        assert "labels" not in together.attrs
