"""A store is laid out once and grown, written by shards, and says so when one is damaged."""

import json
import os
from hashlib import sha256
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
import xarray as xr
import zarr

from echotruth.cases import expand, table
from echotruth.config import Bmode, Config, Geometry, Loop, PhaseCorrelation, Tracking, View
from echotruth.mechanics.geometry import left_ventricle
from echotruth.repository import layout, ledger, packing, schema
from echotruth.repository.checksums import ChecksumError, verify_structure
from echotruth.repository.store import NotWritten, Store
from echotruth.repository.unpacking import unpack

SMALL = {
    "name": "small",
    "geometry": Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
    "loop": Loop(frames=4),
    "views": {"mid": View(), "long_axis": View(plane="long_axis")},
    "bmode": Bmode(size_px=64, downsampling=(1, 2)),
    "tracking": Tracking(trackers={"one": PhaseCorrelation(window_px=16)}),
}
MESH = left_ventricle(SMALL["geometry"])
GROUPS = (
    "geometry",
    "mechanics",
    "kinematics",
    "physiology",
    "phantom",
    "truth/64",
    "bmode/32",
    "tracking/32/one",
    "evaluation/64",
    "evaluation/32/one",
)


def lay_out(path: Path, seeds: list[int], **changes) -> Store:
    """A store for hearts that differ in their seed, as a run lays it out."""
    config = Config(**(SMALL | changes), cases={"seed": seeds})
    layout.lay_out(path.parent, config, expand(config))
    return Store(path)


def fill(store: Store, group: str, *row: int) -> dict:
    """Write random values in a group's arrays for one job, and return them."""
    random, values = np.random.default_rng(row), {}
    opened = store._open(group, "r")
    for array in schema.arrays_of(group):
        there = opened[array.name]
        shape = there.shape[array.leading :]
        values[array.name] = random.integers(1, 200, shape).astype(there.dtype)
    store.write(group, values, *row)
    return packing.unpack(schema.packs_of(group), values, opened.attrs["labels"])


def job(group: str, case: int) -> tuple[int, ...]:
    """Place of a job: row of the case, and a view where the group has views."""
    return (case, 1) if schema.arrays_of(group)[0].leading == 2 else (case,)


def snapshot(store: Store) -> dict:
    """Path to bytes and time of writing of every file but metadata."""
    files = [path for path in store.path.rglob("*") if path.is_file() and path.name != "zarr.json"]
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in files}


@pytest.fixture(scope="module")
def laid_out(tmp_path_factory) -> Store:
    """A store for two hearts, before any job."""
    return lay_out(tmp_path_factory.mktemp("laid_out") / "small.zarr", [1, 2])


@pytest.fixture
def store(laid_out, tmp_path) -> Store:
    """A copy of its own for every test: laying out takes much longer."""
    copytree(laid_out.path.parent, tmp_path, dirs_exist_ok=True)
    return Store(tmp_path / "small.zarr")


@pytest.mark.parametrize("group", GROUPS)
def test_what_one_job_writes_reads_back(store, group):
    values = fill(store, group, *job(group, 1))
    read = store.read(group, *job(group, 1))
    assert set(read) == set(values)
    for name, value in values.items():
        np.testing.assert_array_equal(read[name], value)


@pytest.mark.parametrize("group", GROUPS)
def test_job_writes_one_file_an_array_that_no_other_job_writes(store, group):
    before = snapshot(store)
    fill(store, group, *job(group, 0))
    first = {path for path in snapshot(store) if path not in before}
    assert sorted(first) == store.files(group, *job(group, 0))
    assert len(first) == len(schema.arrays_of(group))
    kept = snapshot(store)
    fill(store, group, *job(group, 1))
    after = snapshot(store)
    assert {path: after[path] for path in kept} == kept


@pytest.mark.parametrize("group, name", [("bmode/64", "image"), ("truth/32", "strain"), ("mechanics", "pressure")])
@pytest.mark.parametrize("place", [0.02, 0.3, 0.6, 0.99])
def test_flipped_bit_is_an_error_and_not_a_wrong_number(store, group, name, place):
    fill(store, group, *job(group, 0))
    (file,) = [path for path in store.files(group, *job(group, 0)) if f"/{name}/" in path.as_posix()]
    damaged = bytearray(file.read_bytes())
    damaged[int(place * len(damaged))] ^= 4
    file.write_bytes(damaged)
    with pytest.raises(Exception, match=r"(?i)checksum|crc"):
        store.read(group, *job(group, 0))


@pytest.mark.parametrize(
    "group, name", [("bmode/64", "image"), ("mechanics", "pressure"), ("phantom", "scatterer_count")]
)
def test_truncated_shard_is_an_error(store, group, name):
    fill(store, group, *job(group, 0))
    (file,) = [path for path in store.files(group, *job(group, 0)) if f"/{name}/" in path.as_posix()]
    file.write_bytes(file.read_bytes()[:-3])
    with pytest.raises(Exception):  # noqa: B017 - zarr has several for it
        store.read(group, *job(group, 0))


@pytest.mark.parametrize("group", ["bmode/64", "mechanics", "phantom"])
def test_missing_shard_is_an_error(store, group):
    fill(store, group, *job(group, 0))
    store.files(group, *job(group, 0))[0].unlink()
    with pytest.raises(Exception):  # noqa: B017 - zarr has several for it
        store.read(group, *job(group, 0))


def test_laying_out_twice_leaves_every_shard_untouched(store):
    for group in GROUPS:
        fill(store, group, *job(group, 0))
    shards = {path for group in GROUPS for path in store.files(group, *job(group, 0))}
    before = snapshot(store)
    lay_out(store.path, [1, 2])
    after = snapshot(store)
    assert {path: content for path, (content, _) in after.items()} == {p: content for p, (content, _) in before.items()}
    assert {path: after[path] for path in shards} == {path: before[path] for path in shards}


def test_more_cases_keep_the_bytes_and_the_names_of_earlier_rows(store):
    for group in GROUPS:
        for row in (0, 1):
            fill(store, group, *job(group, row))
    shards = {path for group in GROUPS for row in (0, 1) for path in store.files(group, *job(group, row))}
    before = snapshot(store)
    lay_out(store.path, [1, 2, 3])
    after = snapshot(store)
    assert {path: after[path] for path in shards} == {path: before[path] for path in shards}
    values = fill(store, "mechanics", 2)
    np.testing.assert_array_equal(store.read("mechanics", 2)["displacement"], values["displacement"])


def test_job_without_anything_to_tell_still_leaves_its_files(store):
    opened = store._open("truth/32", "r")
    blank = {
        a.name: np.full(opened[a.name].shape[2:], a.fill, opened[a.name].dtype) for a in schema.arrays_of("truth/32")
    }
    store.write("truth/32", blank, 0, 0)
    assert len(store.files("truth/32", 0, 0)) == len(schema.arrays_of("truth/32"))


def test_another_image_size_leaves_the_others_and_drops_what_is_gone(store):
    kept = fill(store, "bmode/32", 0, 0)
    lay_out(store.path, [1, 2], bmode=Bmode(size_px=64, downsampling=(2,)))
    np.testing.assert_array_equal(store.read("bmode/32", 0, 0)["image"], kept["image"])
    assert not (store.path / "bmode/64").exists()


def test_records_of_an_image_size_that_left_are_dropped_with_its_arrays(store):
    records = [store.path.parent / f"ledger/bmode/heart/mid/{size}.json" for size in (64, 32)]
    for record in records:
        ledger.commit(record, {})
    lay_out(store.path, [1, 2], bmode=Bmode(size_px=64, downsampling=(1,)))
    assert [record.exists() for record in records] == [True, False]


@pytest.mark.parametrize("name", ["one", "two"])
def test_tracker_that_leaves_or_comes_leaves_the_bytes_of_the_others(store, name):
    trackers = {name: PhaseCorrelation(window_px=16) for name in ("one", "two")}
    lay_out(store.path, [1, 2], tracking=Tracking(trackers=trackers))
    for tracker in trackers:
        fill(store, f"tracking/64/{tracker}", 0, 1)
        fill(store, f"evaluation/64/{tracker}", 0, 1)
    fill(store, "evaluation/64", 0, 1)
    before = snapshot(store)
    lay_out(store.path, [1, 2], tracking=Tracking(trackers={name: trackers[name]}))
    after = snapshot(store)
    (gone,) = trackers.keys() - {name}
    assert before.keys() - after.keys() == {path for path in before if gone in path.parts}
    assert {path: content for path, content in before.items() if path in after} == after
    lay_out(store.path, [1, 2], tracking=Tracking(trackers=trackers))
    assert {path: snapshot(store)[path] for path in after} == after


def every_file(store: Store) -> dict:
    """Path to hash and time of writing of every file of the hierarchy."""
    files = [path for path in store.path.rglob("*") if path.is_file()]
    return {
        path.relative_to(store.path).as_posix(): (sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns)
        for path in files
    }


def vouched(store: Store) -> dict:
    """Checksums in the record of the structure."""
    return ledger.read(store.record)["sha256"]


def test_laying_out_what_is_there_writes_nothing(store):
    store.describe({"title": "small"})
    before, record = every_file(store), store.record.stat().st_mtime_ns
    lay_out(store.path, [1, 2])
    assert every_file(store) == before
    assert store.record.stat().st_mtime_ns == record


def test_record_of_the_structure_vouches_for_every_file_that_no_job_wrote(store):
    assert vouched(store) == {path: content for path, (content, _) in every_file(store).items()}
    shards = set()
    for group in GROUPS:
        fill(store, group, *job(group, 0))
        shards |= {path.relative_to(store.path).as_posix() for path in store.files(group, *job(group, 0))}
    store.write_column("status", ["complete", "failed"])
    store.describe({"title": "small"})
    files = {path: content for path, (content, _) in every_file(store).items()}
    assert set(files) == shards | set(vouched(store))
    assert vouched(store) == {path: content for path, content in files.items() if path not in shards}


def test_damaged_structure_is_found_and_mended_byte_for_byte_without_loss_of_a_shard(store):
    for group in GROUPS:
        fill(store, group, *job(group, 0))
    store.describe({"title": "small"})
    before = {path: content for path, (content, _) in every_file(store).items()}
    random = np.random.default_rng(0)
    for harmed in random.permutation(sorted(vouched(store)))[:60].reshape(3, 20):
        for path in harmed:
            file, content = store.path / path, bytearray((store.path / path).read_bytes())
            content[random.integers(len(content))] ^= 1 << random.integers(8)
            harms = (None, b"", content[: len(content) // 2], content)
            harm(file, harms[random.integers(4)])
            with pytest.raises(ChecksumError, match="is missing or differs from what was laid out"):
                verify_structure(store.path, store.record)
        lay_out(store.path, [1, 2])
        store.describe({"title": "small"})  # the attributes of the root are those of publication
        assert {path: content for path, (content, _) in every_file(store).items()} == before


def harm(file: Path, content: bytes | None) -> None:
    """Replace the content of a file, or delete it."""
    file.unlink()
    if content is not None:
        file.write_bytes(content)


def test_shape_that_a_flipped_bit_changed_does_not_cost_the_shards(store):
    """A larger image in the metadata would mean that the shards are of another size."""
    values = fill(store, "bmode/64", 0, 0)
    metadata = store.path / "bmode/64/image/zarr.json"
    metadata.write_text(metadata.read_text().replace("64", "65"))
    lay_out(store.path, [1, 2])
    np.testing.assert_array_equal(store.read("bmode/64", 0, 0)["image"], values["image"])


@pytest.mark.parametrize("group", ["bmode/64", "mechanics", "phantom"])
def test_shard_of_length_zero_is_an_error_and_not_fill(store, group):
    fill(store, group, *job(group, 0))
    for file in store.files(group, *job(group, 0)):
        content = file.read_bytes()
        file.write_bytes(b"")
        with pytest.raises(NotWritten, match="is empty"):
            store.read(group, *job(group, 0))
        file.write_bytes(content)


def test_view_in_front_of_the_others_moves_nothing_and_all_are_found_by_name(store):
    values = {group: fill(store, group, 0, 1) for group in GROUPS if len(job(group, 0)) == 2}
    shards = {path for group in values for path in store.files(group, 0, 1)}
    before = snapshot(store)
    views = {"apex": View(position=0.8), **SMALL["views"]}
    lay_out(store.path, [1, 2], views=views)
    after = snapshot(store)
    assert {path: after[path] for path in shards} == {path: before[path] for path in shards}
    assert store.labels("view") == ["mid", "long_axis", "apex"]
    fill(store, "bmode/32", 0, 2)
    with xr.open_datatree(store.path, engine="zarr") as tree:
        for group, written in values.items():
            found = unpack(tree[group].to_dataset().isel(case=0).sel(view="long_axis"))
            for name, value in written.items():
                np.testing.assert_array_equal(found[name].values, value, err_msg=name)
        assert (tree["bmode/32/image"].isel(case=0).sel(view="apex") > 0).all()


def test_view_that_leaves_and_returns_keeps_its_place_and_its_bytes(store):
    fill(store, "truth/64", 1, 0)
    before = every_file(store)
    long_axis = {"long_axis": SMALL["views"]["long_axis"]}
    lay_out(store.path, [1, 2], views=long_axis)
    assert every_file(store) == before
    lay_out(store.path, [1, 2], views=long_axis | {"mid": SMALL["views"]["mid"]})
    assert every_file(store) == before


def test_cases_that_leave_and_come_move_nothing(store):
    fill(store, "bmode/64", 1, 0)
    (shard,) = store.files("bmode/64", 1, 0)
    before = every_file(store)
    lay_out(store.path, [3, 2])
    assert len(store.labels("case")) == 3
    assert (
        every_file(store)[shard.relative_to(store.path).as_posix()] == before[shard.relative_to(store.path).as_posix()]
    )
    seeds = zarr.open_array(store.path, path="cases/seed", mode="r")[...]
    np.testing.assert_array_equal(seeds, [np.nan, 2, 3])


def test_labels_are_in_the_attributes_of_every_group_as_in_its_coordinates(store):
    root = zarr.open_group(store.path, mode="r")
    strings = {array.name for array in schema.COORDINATES if array.dtype == "string"}
    groups = {path for path, item in root.members(max_depth=None) if "labels" in item.attrs}
    assert groups == set(schema.groups(Config(**SMALL)))
    for path in groups:
        there = {name for name, _ in root[path].arrays()} & strings - (set() if path == "cases" else {"case"})
        expected = {name: [str(label) for label in root[path][name][...]] for name in there}
        assert root[path].attrs["labels"] == expected
        assert there or path in ("fibres", "pathology")


def test_table_of_cases_has_arrays_of_what_differs_and_an_attribute_for_the_rest(store):
    cases = zarr.open_group(store.path, path="cases", mode="r")
    assert set(cases.array_keys()) == {"case", "status", "reason", "seed"}
    constants = cases.attrs["constants"]
    assert constants["fibres.endo_deg"] == Config().fibres.endo_deg and constants["geometry.preset"] == "mouse"
    assert {*constants, "case", "seed"} == set(table(expand(Config(**SMALL))).columns)


def test_many_cases_are_laid_out_in_few_files(tmp_path):
    """One file a column, and none a case."""
    rows = [f"case{number}" for number in range(10_000)]
    columns = {"cases:seed": np.arange(10_000.0), "cases:loop.file": np.repeat(["mouse", "rat"], 5_000)}
    arrays = {"cases": schema.parameters(columns), "physiology": schema.SINGLE["physiology"]}
    labels = columns | layout.labels(Config(**SMALL), rows, np.zeros((10_000, 4)))
    Store(tmp_path / "many.zarr").lay_out(arrays, {}, labels)
    files = [path for path in (tmp_path / "many.zarr").rglob("*") if path.is_file()]
    whole = len(schema.coordinates(schema.SINGLE["physiology"])) + len(arrays["cases"]) + 1
    assert len(files) == 3 + len(schema.SINGLE["physiology"]) + 2 * whole
    tree = xr.open_datatree(tmp_path / "many.zarr", engine="zarr")
    assert str(tree["cases"].sel(case="case7654")["loop.file"].values) == "rat"


def test_shard_and_its_folders_are_synced_once_each_after_they_are_written(store, monkeypatch):
    synced, sync = [], os.fsync

    def record(descriptor):
        synced.append(Path(os.readlink(f"/proc/self/fd/{descriptor}")))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", record)
    fill(store, "bmode/64", 0, 1)
    (shard,) = store.files("bmode/64", 0, 1)
    array = store.path / "bmode/64/image"
    assert sorted(synced) == sorted(
        [shard, *(folder for folder in shard.parents if array in (folder, *folder.parents))]
    )
    assert {shard, shard.parent, array / "c/0/1", array / "c/0", array / "c", array} <= set(synced)


def test_draft_of_a_living_writer_stays_and_that_of_a_killed_one_goes_when_its_job_runs_again(store):
    living = store.path / "mechanics/pressure/c/1/0.abc.partial"
    killed = store.path / "mechanics/pressure/c/0/0.abc.partial"
    for draft in (living, killed):
        draft.parent.mkdir(parents=True)
        draft.write_bytes(b"half")
    store.describe({"title": "small"})
    assert living.exists() and killed.exists()
    fill(store, "mechanics", 0)
    assert living.exists() and not killed.exists()


def test_draft_of_structure_is_removed_when_it_is_laid_out(store):
    draft = store.path / "mechanics/.zarr.json.host.1.0.partial"
    draft.write_bytes(b"half")
    lay_out(store.path, [1, 2])
    assert not draft.exists()


def test_metadata_of_all_arrays_are_gathered_and_current(store):
    lay_out(store.path, [1, 2, 3])
    store.describe({"title": "small"})
    gathered = json.loads((store.path / "zarr.json").read_text())["consolidated_metadata"]["metadata"]
    single = {path.parent.relative_to(store.path).as_posix(): path for path in store.path.rglob("zarr.json")}
    del single["."]
    assert gathered == {path: json.loads(file.read_text()) for path, file in single.items()}
    with xr.open_datatree(store.path, engine="zarr") as tree:
        assert tree.attrs["title"] == "small" and tree["bmode/64"].sizes["case"] == 3


def test_verdicts_stay_when_cases_are_added(store):
    store.write_column("status", ["complete", "failed"])
    store.write_column("reason", ["", "no equilibrium"])
    lay_out(store.path, [1, 2, 3])
    cases = zarr.open_group(store.path, path="cases", mode="r")
    assert list(cases["status"][...]) == ["complete", "failed", ""]
    assert list(cases["reason"][...]) == ["", "no equilibrium", ""]
