"""Metadata: what a group says of itself, of those below it, and whether it is of the settings of today."""

import pytest
import xarray as xr
import zarr

from echotruth.repository import metadata
from echotruth.repository.metadata import OUTDATED


@pytest.fixture
def folder(tmp_path):
    zarr.create_group(tmp_path / "a", zarr_format=3, attributes={"version": "1"})
    return tmp_path / "a"


def test_group_of_other_settings_is_set_aside_and_taken_back(folder):
    before = (folder / "zarr.json").read_bytes()
    assert metadata.settle(folder, "1") and not (folder / OUTDATED).exists()
    assert not metadata.settle(folder, "2") and not (folder / "zarr.json").exists()
    assert not metadata.settle(folder, "3")
    assert metadata.settle(folder, "1") and (folder / "zarr.json").read_bytes() == before
    assert not metadata.settle(folder.with_name("none"), "1")


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"attributes": 3}', "[" * 100_000])
def test_group_whose_metadata_are_damaged_has_no_attributes_and_is_set_aside(folder, content):
    (folder / "zarr.json").write_text(content)
    assert metadata.attributes(folder) == {} and not metadata.settle(folder, "1")


def test_holder_has_the_metadata_of_all_below_and_is_written_only_if_they_change(tmp_path):
    for path in ("truth/64", "bmode/64"):
        group = zarr.create_group(tmp_path / path, zarr_format=3, attributes={"version": "1"})
        group.create_array("image", shape=(2,), dtype="uint8", dimension_names=("frame",))
        metadata.write(tmp_path / path.partition("/")[0], {}, consolidated=False)
    metadata.write(tmp_path, {"case": "a"})
    with xr.open_datatree(tmp_path, engine="zarr", consolidated=True) as tree:
        assert tree.attrs == {"case": "a"} and tree["bmode/64/image"].dims == ("frame",)
    before = (tmp_path / "zarr.json").stat().st_mtime_ns
    metadata.write(tmp_path, {"case": "a"})
    assert (tmp_path / "zarr.json").stat().st_mtime_ns == before
    metadata.write(tmp_path, {"case": "b"})
    assert metadata.attributes(tmp_path) == {"case": "b"}
