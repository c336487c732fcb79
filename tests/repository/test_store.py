"""A store is laid out once and grown, written by shards, and says so when one is damaged."""

from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from echotruth.cases import expand, table
from echotruth.config import Bmode, Config, Geometry, Loop, PhaseCorrelation, Tracking, View
from echotruth.imaging.bmode import pixel_centres
from echotruth.loop.cycle import read_loop
from echotruth.mechanics.geometry import left_ventricle
from echotruth.repository import layout, schema
from echotruth.repository.store import Store, schema_of
from echotruth.tracking import grid

SMALL = {
    "name": "small",
    "geometry": Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
    "loop": Loop(frames=4),
    "views": {"mid": View(), "long_axis": View(plane="long_axis")},
    "bmode": Bmode(size_px=64, downsampling=(1, 2)),
    "tracking": Tracking(trackers={"one": PhaseCorrelation(window_px=16)}),
}
MESH = left_ventricle(SMALL["geometry"])
GROUPS = ("geometry", "mechanics", "kinematics", "phantom", "truth/64", "bmode/32", "tracking/32", "evaluation/64")


def lay_out(path: Path, seeds: list[int], **changes) -> Store:
    """A store for hearts that differ in their seed, as src/echotruth/workflow/scripts/cases.py makes it."""
    config = Config(**(SMALL | changes), cases={"seed": seeds})
    cases = expand(config)
    rows = [case.id for case in cases]
    times = np.stack([read_loop(case.config.loop).time for case in cases])
    columns = layout.columns(table(cases), rows)
    labels = layout.labels(config, rows, times) | layout.positions(config, pixel_centres, grid) | columns
    store = Store(path)
    store.lay_out(schema.groups(config) | {"cases": schema.parameters(columns)}, layout.sizes(MESH), labels)
    return store


def fill(store: Store, group: str, *row: int) -> dict:
    """Write random values in a group's arrays for one job, and return them."""
    random, values = np.random.default_rng(row), {}
    opened = store._open(group, "r")
    for array in schema_of(group):
        there = opened[array.name]
        shape = there.shape[array.leading :]
        values[array.name] = random.integers(1, 200, shape).astype(there.dtype)
    store.write(group, values, *row)
    return values


def job(group: str, case: int) -> tuple[int, ...]:
    """Place of a job: row of the case, and a view where the group has views."""
    return (case, 1) if schema_of(group)[0].leading == 2 else (case,)


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
    return Store(copytree(laid_out.path, tmp_path / "small.zarr"))


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
    assert len(first) == len(schema_of(group))
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
    blank = {a.name: np.full(opened[a.name].shape[2:], a.fill, opened[a.name].dtype) for a in schema_of("truth/32")}
    store.write("truth/32", blank, 0, 0)
    assert len(store.files("truth/32", 0, 0)) == len(schema_of("truth/32"))


def test_another_image_size_leaves_the_others_and_drops_what_is_gone(store):
    kept = fill(store, "bmode/32", 0, 0)
    lay_out(store.path, [1, 2], bmode=Bmode(size_px=64, downsampling=(2,)))
    np.testing.assert_array_equal(store.read("bmode/32", 0, 0)["image"], kept["image"])
    assert not (store.path / "bmode/64").exists()


def test_describing_removes_what_a_killed_job_left_and_gathers_the_metadata(store):
    stray = store.path / "mechanics/pressure/c/0/0.abc.partial"
    stray.parent.mkdir(parents=True)
    stray.write_bytes(b"half")
    store.describe({"title": "small"})
    assert not stray.exists()
    assert b"consolidated_metadata" in (store.path / "zarr.json").read_bytes()
