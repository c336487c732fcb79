"""The schema describes every array once, in known units, and a finished repository holds what it says."""

import numpy as np
import pytest
import zarr
from finished_repository import OPTIONAL

from echotruth.repository import schema
from echotruth.repository.places import group_of

ALL = [*schema.COORDINATES.values(), *schema.DERIVED, *(array for arrays in schema.KINDS.values() for array in arrays)]
UNITS = {"1", "m", "m3", "m3 s-1", "kg", "s", "s-1", "Pa", "Pa s-1", "rad", "rad s-1", "percent"}


@pytest.mark.parametrize("array", ALL, ids=lambda array: f"{array.name}-{len(array.dims)}")
def test_array_is_whole(array):
    assert array.long_name
    if array.units == "mixed":  # a coordinate has the unit of each
        assert {f"{dim}_units" for dim in array.dims} & set(schema.COORDINATES)
    else:
        assert array.units in UNITS and (array.dtype == "string" or np.dtype(array.dtype).name == array.dtype)


def test_names_stand_once_in_a_group_and_labels_belong_to_coordinates():
    for arrays in schema.KINDS.values():
        assert len({array.name for array in arrays}) == len(arrays)
    assert set(schema.LABELS) <= set(schema.COORDINATES)


@pytest.mark.slow
def test_finished_repository_has_the_arrays_of_the_schema_and_no_others(finished):
    store, seen = zarr.open_group(next(finished.glob("*.zarr")), mode="r", use_consolidated=False), set()
    for path, group in store.members(max_depth=None):
        kind = schema.kind(group_of(path)) if isinstance(group, zarr.Group) and path.count("/") > 1 else ""
        if kind in schema.KINDS:
            arrays = dict(group.arrays())
            known = schema.COORDINATES | schema.arrays_of(kind)
            for name, array in arrays.items():
                dtype = "string" if known[name].dtype == "string" else str(array.dtype)
                assert (array.metadata.dimension_names or ()) == known[name].dims and dtype in (
                    "string",
                    known[name].dtype,
                )
                assert array.attrs["units"] == known[name].units
            seen.add(kind)
            assert arrays.keys() & schema.arrays_of(kind).keys(), path
    assert seen == {kind for kind in schema.KINDS if not kind.startswith("inference/") and "volume" not in kind}


@pytest.mark.slow
def test_every_array_is_in_a_finished_repository_but_for_those_that_are_asked_for(finished):
    store = next(finished.glob("*.zarr"))
    found = {path.parent.name for path in store.rglob("zarr.json")}
    kinds = [kind for kind in schema.KINDS if "inference" not in kind and "volume" not in kind]
    wanted = [array.name for kind in kinds for array in schema.KINDS[kind]]
    asked = tuple(name for name in OPTIONAL if name != "transmit")
    assert [name for name in wanted if name not in found and not name.startswith(asked)] == []


@pytest.mark.slow
def test_clip_lists_all_groups_and_arrays_that_it_holds(finished):
    clips = list(finished.glob("*.zarr/clips/*/*/"))
    for clip in clips:
        listed = zarr.open_group(clip, mode="r", use_consolidated=True).metadata.consolidated_metadata
        held = {path.parent.relative_to(clip).as_posix() for path in clip.rglob("*/zarr.json")}
        assert set(listed.flattened_metadata) == held
    assert len(clips) > 2
