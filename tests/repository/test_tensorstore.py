"""Tensorstore, another reader of Zarr 3, reads every array of numbers of a repository as Zarr does."""

import json

import numpy as np
import pytest
import zarr

tensorstore = pytest.importorskip("tensorstore", reason="needs the package tensorstore")


def test_every_array_of_numbers_is_read_alike(textured):
    about = {path.parent: json.loads(path.read_bytes()) for path in textured.glob("*.zarr/**/zarr.json")}
    arrays = [folder for folder, one in about.items() if one["node_type"] == "array" and one["data_type"] != "string"]
    assert len(arrays) > 100
    for folder in arrays:
        spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": str(folder)}}
        found = tensorstore.open(spec, read=True, open=True).result().read().result()
        np.testing.assert_array_equal(found, zarr.open_array(folder, mode="r")[...], err_msg=str(folder))
