"""A group on disk: it is there as a whole or not at all, it reads back, and no damage of it is a wrong number."""

import errno
import json
import os
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import zarr
from finished_repository import configured

from echotruth.config import Bmode, Tracking
from echotruth.repository import group, rounding, schema
from echotruth.repository.coordinates import coordinates_of
from echotruth.repository.group import ChecksumError, NotWritten
from echotruth.repository.places import group_of, place

CONFIG = configured(tracking=Tracking(grid=0.03, trackers={name: {"method": "dis"} for name in ("one", "two")}))
SIZE = CONFIG.bmode.size_px
ABOUT = {"status": "complete", "version": "1"}


def values(name):
    """Random values of all arrays of a group whose dimensions have a length in this configuration."""
    lengths = {one: np.size(value) for one, value in coordinates_of(name, CONFIG).items()} | {"node": 7}
    random = np.random.default_rng(len(name))
    arrays = [array for array in schema.arrays_of(name).values() if lengths.keys() >= set(array.dims)]
    return {array.name: random.integers(0, 9, [lengths[dim] for dim in array.dims]) / 8 for array in arrays}


def write(name, given, folder):
    group.write(folder, name, given, coordinates_of(name, CONFIG), CONFIG, ABOUT)


def path(name):
    """Path of a group of one heart or clip, below the store."""
    return place(name, "a", "a", "mid")


def made(store, name, given=None):
    given = values(name) if given is None else given
    group.write_groups(store, {path(name): partial(write, name, given)})
    return given


@pytest.mark.parametrize("name", ["mechanics", "physiology", f"truth/{SIZE}", f"bmode/{SIZE}", "tracking/one"])
def test_what_is_written_reads_back_rounded_to_the_quantum_that_its_metadata_state(tmp_path, name):
    given = made(tmp_path / "a.zarr", name)
    found = group.read(tmp_path / "a.zarr", path(name))
    assert found.keys() == given.keys() and found
    for key, value in given.items():
        metadata = json.loads((tmp_path / "a.zarr" / path(name) / key / "zarr.json").read_bytes())
        step = metadata["attributes"].get("quantum")
        assert step == rounding.quantum(schema.arrays_of(name)[key], CONFIG)
        stored = value.astype(found[key].dtype)
        np.testing.assert_array_equal(found[key], stored if step is None else np.round(stored / step) * step)


def test_xarray_finds_dimensions_coordinates_units_and_meaning(tmp_path):
    made(tmp_path / "a.zarr", "tracking/one")
    with xr.open_zarr(tmp_path / "a.zarr", group=path("tracking/one"), consolidated=False) as opened:
        assert opened["displacement"].dims == ("size", "frame", "axial", "lateral", "plane")
        assert (
            list(opened["size"].values) == [SIZE]
            and "nrmse 0 total" in opened["score"].values
            and opened["time"].dims == ("frame",)
        )
        for name, array in schema.arrays_of("tracking/one").items():
            assert opened[name].attrs["units"] == array.units and opened[name].attrs["long_name"] == array.long_name


def test_chunk_is_one_component_of_one_frame_or_of_the_cycle_of_one_size(tmp_path):
    made(tmp_path / "a.zarr", f"truth/{SIZE}")
    made(tmp_path / "a.zarr", "tracking/one")
    strain, tracked = (
        zarr.open_array(tmp_path / "a.zarr", path=path(name), mode="r")
        for name in (f"truth/{SIZE}/strain", "tracking/one/displacement")
    )
    assert strain.chunks == (1, SIZE, SIZE, 1)
    assert tracked.chunks == (1, *tracked.shape[1:4], 1) and tracked.shards == tracked.shape
    folder = tmp_path / "a.zarr" / path(f"truth/{SIZE}") / "strain/c"
    assert [file for file in folder.rglob("*") if file.is_file()] == [folder / "0/0/0/0"]


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.99])
@pytest.mark.parametrize(("name", "array"), [(f"truth/{SIZE}", "strain"), ("points", "true_rotation")])
def test_flipped_bit_is_an_error_and_not_a_wrong_number(tmp_path, name, array, share):
    made(tmp_path / "a.zarr", name)
    (file,) = [one for one in (tmp_path / "a.zarr" / path(name) / array / "c").rglob("*") if one.is_file()]
    content = bytearray(file.read_bytes())
    content[int(share * len(content))] ^= 4
    file.write_bytes(content)
    with pytest.raises(Exception, match=r"is not what was written: `echotruth check`"):
        group.read(tmp_path / "a.zarr", path(name))


def test_what_is_not_there_is_said_in_one_sentence(tmp_path):
    store = tmp_path / "a.zarr"
    group.write_groups(store, {"failed": partial(group.write_nothing, attributes={"reason": "no equilibrium"})})
    made(store, "mechanics")
    (store / "hearts/a/mechanics/zarr.json").write_text("{")
    for where, sentence in {
        "none": "has no group none: run its configuration, which makes it",
        "failed": "failed has no pressure: no equilibrium",
        "hearts/a/mechanics": "the metadata of hearts/a/mechanics are damaged .*: delete that folder, and run",
    }.items():
        with pytest.raises(NotWritten, match=sentence) as caught:
            group.read(store, where, "pressure")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("broken", [0, 1])
def test_groups_of_a_job_that_fails_are_not_there_and_leave_nothing(tmp_path, broken):
    def fail(folder):
        write("mechanics", values("mechanics"), folder)
        raise OSError(errno.ENOSPC, "No space left on device")

    writers = [fail if number == broken else partial(write, "mechanics", values("mechanics")) for number in range(2)]
    with pytest.raises(OSError, match="No space left"):
        group.write_groups(tmp_path / "a.zarr", dict(zip(["one", "two"], writers, strict=True)))
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_group_takes_the_place_of_an_earlier_one_with_other_arrays(tmp_path):
    store, few = tmp_path / "a.zarr", {"pressure": np.zeros(3)}
    made(store, "mechanics")
    made(store, "mechanics", few)
    assert group.read(store, path("mechanics")).keys() == {"pressure"}
    assert not (store / path("mechanics") / "volume").exists() and not list((tmp_path / "drafts").iterdir())


def test_what_holds_fill_values_alone_is_on_disk_all_the_same(tmp_path):
    made(tmp_path / "a.zarr", f"bmode/{SIZE}", {"image": np.zeros((3, SIZE, SIZE))})
    assert (tmp_path / "a.zarr" / path(f"bmode/{SIZE}") / "image/c/0/0/0").is_file()


@pytest.mark.parametrize("name", ["mechanics", "phantom", "truth/64", "inference/fit"])
def test_name_of_a_group_is_that_of_its_path(name):
    assert group_of(path(name)) == name


@pytest.mark.parametrize(("field_of_view_mm", "size_px"), [(12, 512), (12, 128), (160, 512), (10.24, 1024)])
def test_quantum_of_lengths_is_the_power_of_two_below_a_256th_of_the_finest_pixel(field_of_view_mm, size_px):
    config = configured(bmode=Bmode(field_of_view_mm=field_of_view_mm, size_px=size_px, downsampling=(1, 2)))
    quantum, finest = rounding.length_quantum(config), field_of_view_mm * 1e-3 / size_px
    assert quantum <= finest / 256 < 2 * quantum and np.frexp(quantum)[0] == 0.5


@pytest.mark.parametrize("name", ["points", f"truth/{SIZE}", f"bmode/{SIZE}"])
def test_lost_file_is_an_error_and_not_fill(tmp_path, name):
    """What holds fill values alone is none."""
    given = made(tmp_path / "a.zarr", name, {key: np.zeros_like(value) for key, value in values(name).items()})
    assert group.read(tmp_path / "a.zarr", path(name)).keys() == given.keys()
    for key in given:
        shutil.rmtree(tmp_path / "a.zarr" / path(name) / key / "c", ignore_errors=True)
        (tmp_path / "a.zarr" / path(name) / key / "c").unlink(missing_ok=True)
        array = zarr.open_array(tmp_path / "a.zarr", path=f"{path(name)}/{key}", mode="r")
        with pytest.raises(ChecksumError, match=rf"{key} has lost its data: `echotruth check`"):
            group.part(array)
        with pytest.raises(ChecksumError, match=r"is not what was written: `echotruth check` of the repository names"):
            group.read(tmp_path / "a.zarr", path(name), key)


def cut(file):
    os.truncate(file, file.stat().st_size // 2)


def zero(file):
    file.write_bytes(bytes(file.stat().st_size))


@pytest.mark.parametrize("harm", [lambda file: os.truncate(file, 0), cut, zero, os.unlink])
@pytest.mark.parametrize("name", ["mechanics", f"truth/{SIZE}"])
def test_file_that_is_emptied_cut_zeroed_or_lost_is_an_error_also_where_a_part_is_read(tmp_path, name, harm):
    """The files of the groups that hold shards; a power cut leaves a length of 0."""
    for key in made(tmp_path / "a.zarr", name):
        (file,) = [one for one in (tmp_path / "a.zarr" / path(name) / key).rglob("c*/**/*") if one.is_file()] or [
            tmp_path / "a.zarr" / path(name) / key / "c"
        ]
        before = file.read_bytes()
        harm(file)
        array = zarr.open_array(tmp_path / "a.zarr", path=f"{path(name)}/{key}", mode="r")
        for index in ((), (0,) * min(array.ndim, 1)):
            with pytest.raises(ChecksumError, match=rf"{key} .*`echotruth check`"):
                group.part(array, *index)
        with pytest.raises(ChecksumError, match="`echotruth check`"):
            group.read(tmp_path / "a.zarr", path(name), key)
        file.write_bytes(before)


def test_exchanged_files_are_an_error_where_whole_arrays_are_read(tmp_path):
    store, name = tmp_path / "a.zarr", f"bmode/{SIZE}"
    places = [place(name, "a", "a", view) for view in ("mid", "apex")]
    for number, where in enumerate(places):
        image = np.full((3, SIZE, SIZE), number)
        group.write_groups(store, {where: partial(write, name, {"image": image})})
    one, other = (store / where / "image/c/0/0/0" for where in places)
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    for where in places:
        with pytest.raises(ChecksumError, match=r"image/c/0/0/0 is not what was written: `echotruth check`"):
            group.read(store, where, "image")


def test_files_are_on_the_disk_before_a_group_is_moved_to_its_place(tmp_path, monkeypatch):
    synced, fsync, store = set(), os.fsync, tmp_path / "a.zarr"
    monkeypatch.setattr(os, "fsync", lambda number: synced.add(os.readlink(f"/proc/self/fd/{number}")) or fsync(number))
    replace = Path.replace

    def checked(draft, target):
        if draft.is_dir():
            assert {str(one) for one in draft.rglob("*")} | {str(draft)} <= synced
        return replace(draft, target)

    monkeypatch.setattr(Path, "replace", checked)
    made(store, "mechanics")
    assert str((store / path("mechanics")).parent) in synced
