"""A repository is published when every file is what its job wrote."""

from pathlib import Path
from shutil import copytree

import finished_repository as finished
import numpy as np
import pytest
import xarray as xr

import echotruth as et
from echotruth.cases import expand, table
from echotruth.config import Bmode, Cases, Config, Geometry, Loop, PhaseCorrelation, Physiology, Tracking, View
from echotruth.repository import ledger, schema
from echotruth.repository.checksums import ChecksumError
from echotruth.repository.layout import lay_out
from echotruth.repository.ledger import stages
from echotruth.repository.publication import publish
from echotruth.repository.store import Store
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
LENGTHENS = (
    "the mean longitudinal strain at end-systole is 0.04 and must be at most 0 (physiology.longitudinal_strain_max)."
)


def ones(job: Job) -> dict:
    """Ones in the shape of every array of a job."""
    shapes = {group: finished.shapes(job.store.path, group) for group in written_by(job)}
    return {group: {name: np.ones(shape) for name, shape in found.items()} for group, found in shapes.items()}


def written_by(job: Job) -> list[str]:
    return schema.written_by(job.stage, job.config, job.size or None)


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    """A repository of two cases, all of whose jobs are done."""
    return finished.finish(tmp_path_factory.mktemp("done") / "small", CONFIG, ones)


@pytest.fixture
def folder(done, tmp_path) -> Path:
    """A copy of it of its own for every test: the jobs take much longer."""
    return copytree(done, tmp_path / "small")


def test_whole_repository_is_verified_and_opens(folder):
    summary = publish(folder)
    assert (summary["complete"], summary["implausible"], summary["failed"]) == (2, 0, 0)
    tree = xr.open_datatree(folder / "small.zarr")
    assert list(tree["cases/status"].values) == ["complete", "complete"]
    assert set(tree.attrs["code"]) == set(stages(CONFIG))


def test_every_file_of_the_hierarchy_is_verified(folder):
    written = {path for path in (folder / "small.zarr").rglob("*") if path.is_file()}
    assert publish(folder)["files"] == len(written)
    paths = (path for path in (folder / "ledger").rglob("*.json") if path.name != "repository.json")
    records = [ledger.read(path).get("sha256", {}) for path in paths]
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
@pytest.mark.parametrize("group, row", [("bmode/64", (1, 0)), ("mechanics", (0,)), ("evaluation/64/one", (0, 1))])
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
    stage = {"evaluation/64/one": "tracking"}.get(group, group.partition("/")[0])
    assert f"ledger/{stage}/{CASES[row[0]].id}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_heart_without_a_solution_is_told_with_its_reason(folder):
    for job in finished.jobs(folder, CONFIG, CASES[1].id):
        failed = job.stage == "mechanics"
        job.lines.parent.mkdir(parents=True, exist_ok=True)  # as Snakemake does
        job.commit_without_result("failed" if failed else "skipped", job.excluded() or "no equilibrium at frame 3")
    assert publish(folder)["failed"] == 1
    cases = xr.open_datatree(folder / "small.zarr")["cases"]
    assert list(cases["status"].values) == ["complete", "failed"]
    assert list(cases["reason"].values) == ["", "no equilibrium at frame 3"]


def doubt(folder):
    """The second heart solved again, and found out of bounds."""
    job = Job(folder, "mechanics", CASES[1].id)
    job.note(bounded={"longitudinal_strain_max": 0.04})
    job.commit(ones(job))


def change(folder, **sections):
    """Lay the repository out for a configuration with other sections."""
    config = CONFIG.model_copy(update=sections)
    lay_out(folder, config, expand(config))


def test_heart_out_of_bounds_keeps_its_arrays_and_is_marked(folder):
    doubt(folder)
    summary = publish(folder)
    assert (summary["complete"], summary["implausible"], summary["failed"]) == (1, 1, 0)
    tree = xr.open_datatree(folder / "small.zarr")
    assert list(tree["cases/status"].values) == ["complete", "implausible"]
    assert list(tree["cases/reason"].values) == ["", LENGTHENS]
    assert (tree["mechanics/displacement"].isel(case=1) == 1).all()
    assert (tree["physiology/scalars"].sel(scalar="longitudinal_strain") == 1).all()


@pytest.mark.parametrize("stage, place", [("phantom", ("mid",)), ("tracking", ("long_axis", 32))])
def test_heart_out_of_bounds_is_imaged_only_where_the_configuration_says_so(folder, stage, place):
    doubt(folder)
    assert Job(folder, stage, CASES[0].id, *place).excluded() == ""
    assert Job(folder, stage, CASES[1].id, *place).excluded() == LENGTHENS
    assert Job(folder, "mechanics", CASES[1].id).excluded() == ""
    change(folder, physiology=Physiology(exclude_implausible=False))
    assert Job(folder, stage, CASES[1].id, *place).excluded() == ""
    assert publish(folder)["implausible"] == 1


def test_other_bounds_change_the_verdict_and_not_a_byte_of_the_hearts(folder):
    doubt(folder)
    before = finished.content(folder)
    record = (folder / f"ledger/mechanics/{CASES[1].id}.json").read_bytes()
    change(folder, physiology=Physiology(longitudinal_strain_max=0.1))
    assert publish(folder)["implausible"] == 0
    after = finished.content(folder)
    shards = {path for path in before if "small.zarr/cases/" not in path and not path.endswith("small.zarr/zarr.json")}
    assert {path: after[path] for path in shards} == {path: before[path] for path in shards}
    assert (folder / f"ledger/mechanics/{CASES[1].id}.json").read_bytes() == record


@pytest.mark.parametrize("exclude", [True, False])
def test_heart_without_a_solution_is_never_measured_nor_imaged(folder, exclude):
    change(folder, physiology=Physiology(exclude_implausible=exclude))
    Job(folder, "mechanics", CASES[1].id).commit_without_result("failed", "no equilibrium")
    for job in list(finished.jobs(folder, CONFIG, CASES[1].id))[1:]:
        assert job.excluded() == "no equilibrium"


@pytest.mark.parametrize("stage, place", [("bmode", ("mid", 64)), ("tracking", ("mid", 32)), ("mechanics", ())])
def test_what_is_skipped_leaves_nothing_of_an_earlier_run_and_all_of_others(folder, stage, place):
    other, job = (Job(folder, stage, case.id, *place) for case in CASES)
    before = {path for path in job.store.path.rglob("*") if path.is_file()}
    own = {path for group in written_by(job) for path in job.store.files(group, *job.index)}
    job.commit_without_result("skipped", LENGTHENS)
    assert own and {path for path in job.store.path.rglob("*") if path.is_file()} == before - own
    for group in written_by(other):
        assert other.store.files(group, *other.index)


def test_job_of_a_view_has_its_place_whatever_is_put_in_front_of_it(folder):
    before = {view: Job(folder, "phantom", CASES[1].id, view).index for view in CONFIG.views}
    assert before == {"mid": (1, 0), "long_axis": (1, 1)}
    change(folder, views={"apex": View(position=0.8), **CONFIG.views})
    assert {view: Job(folder, "phantom", CASES[1].id, view).index for view in CONFIG.views} == before
    assert Job(folder, "phantom", CASES[1].id, "apex").index == (1, 2)


def test_case_that_left_the_configuration_is_retired(folder):
    change(folder, cases=Cases(seed=[1]))
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
    change(folder, cases=Cases(seed=[1]))
    publish(folder)
    frame = et.Repository(folder).tree["cases"].to_dataset().to_dataframe()
    assert np.isnan(frame["fibres.endo_deg"].iloc[1]) and frame["geometry.preset"].iloc[1] == ""
    assert frame["fibres.endo_deg"].iloc[0] == CONFIG.fibres.endo_deg


def test_groups_opened_together_have_the_labels_and_indexes_that_each_has_alone(folder):
    publish(folder)
    tree = et.Repository(folder).tree
    for group in schema.groups(CONFIG):
        alone = xr.open_zarr(folder / "small.zarr", group=group, chunks=None)
        together, above = tree[group].to_dataset(), tree[group].parent.to_dataset()
        assert set(together.xindexes) == set(alone.xindexes) | set(above.xindexes)
        assert set(together.coords) == set(alone.coords) | set(above.xindexes)
        for name in alone.coords:
            assert together.coords[name].variable.identical(alone.coords[name].variable), name
            assert name not in alone.xindexes or together.indexes[name].equals(alone.indexes[name])
        assert "labels" not in together.attrs
