"""What zarr-python writes, TensorStore reads alike, and the labels that it cannot read stand beside them."""

import json

import numpy as np
import pytest
import zarr
from finished_repository import configured, finish

tensorstore = pytest.importorskip("tensorstore", reason="needs the package tensorstore")


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return finish(tmp_path_factory.mktemp("small") / "small", configured()) / "small.zarr"


def arrays(store):
    """Path and metadata of every array."""
    for path in sorted(store.rglob("zarr.json")):
        metadata = json.loads(path.read_text())
        if metadata["node_type"] == "array":
            yield path.parent, metadata


def test_every_array_of_numbers_is_read_alike(store):
    numbers = [folder for folder, metadata in arrays(store) if metadata["data_type"] != "string"]
    assert len(numbers) > 50
    for folder in numbers:
        spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": str(folder)}}
        found = tensorstore.open(spec, read=True, open=True).result().read().result()
        np.testing.assert_array_equal(found, zarr.open_array(folder, mode="r")[...], err_msg=str(folder))


def test_labels_stand_in_the_attributes_of_the_group(store):
    texts = [folder for folder, metadata in arrays(store) if metadata["data_type"] == "string"]
    compared = 0
    for folder in texts:
        expected = zarr.open_array(folder, mode="r")[...].tolist()
        labels = json.loads((folder.parent / "zarr.json").read_text())["attributes"].get("labels", {})
        if folder.name in labels:
            compared += 1
            assert labels[folder.name] == expected
    assert compared > 10
