"""Metadata: what a group says of itself and of those below it, and whether it is as it was written."""

import json

import pytest
import xarray as xr
import zarr

from echotruth.repository import metadata
from echotruth.repository.checksums import checksum, seal, sealed


@pytest.fixture
def folder(tmp_path):
    group = zarr.create_group(tmp_path / "a", zarr_format=3, attributes={"version": "1"})
    group.create_array("image", shape=(2,), dtype="uint8", fill_value=0)[...] = [1, 2]
    seal(tmp_path / "a")
    return tmp_path / "a"


def test_group_has_the_checksums_of_its_files_as_it_was_written(folder):
    assert metadata.attributes(folder)["version"] == "1"
    document = json.loads((folder / "zarr.json").read_bytes())
    found = sealed(document)
    assert set(found) == {"image/zarr.json", "image/c/0"}
    assert all(checksum(folder / name) == hash for name, hash in found.items())


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"attributes": 3}', "[" * 100_000])
def test_group_whose_metadata_are_damaged_has_no_attributes(folder, content):
    (folder / "zarr.json").write_text(content)
    assert metadata.attributes(folder) == {}


@pytest.mark.parametrize(
    ("was", "now"), [('"version": "1"', '"version": "2"'), ("group", "grouq"), ('"checksums": "', '"checksums": "0')]
)
def test_group_whose_metadata_are_not_as_written_has_no_attributes(folder, was, now):
    text = (folder / "zarr.json").read_text()
    assert was in text
    (folder / "zarr.json").write_text(text.replace(was, now))
    assert metadata.attributes(folder) == {}


def test_holder_has_the_metadata_of_all_below_and_is_written_only_if_they_change(tmp_path):
    for path in ("truth/64", "bmode/64"):
        group = zarr.create_group(tmp_path / path, zarr_format=3, attributes={"version": "1"})
        group.create_array("image", shape=(2,), dtype="uint8", dimension_names=("frame",))
        (tmp_path / path.partition("/")[0] / "zarr.json").write_bytes(metadata.content({}))
    metadata.write(tmp_path, {"case": "a"})
    with xr.open_datatree(tmp_path, engine="zarr", consolidated=True) as tree:
        assert tree.attrs == {"case": "a"} and tree["bmode/64/image"].dims == ("frame",)
    before = (tmp_path / "zarr.json").stat().st_mtime_ns
    metadata.write(tmp_path, {"case": "a"})
    assert (tmp_path / "zarr.json").stat().st_mtime_ns == before
    metadata.write(tmp_path, {"case": "b"})
    assert metadata.attributes(tmp_path) == {"case": "b"}
