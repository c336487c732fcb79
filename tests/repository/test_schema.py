"""The schema describes every array once, in known units."""

import numpy as np
import pytest

from echotruth.config import Bmode, Config, PhaseCorrelation, Tracking
from echotruth.config.tracking import NOT_TRACKERS
from echotruth.repository import schema

ALL = [*schema.CASES, *schema.COORDINATES]
ALL += [array for group in schema.KINDS for array in schema.named(group)]
ALL += schema.DERIVED


@pytest.mark.parametrize("array", ALL, ids=lambda array: f"{array.name}-{len(array.dims)}")
def test_array_is_whole(array):
    assert array.dims and array.long_name
    if array.units == "mixed":  # a coordinate has the unit of each
        assert {f"{dim}_units" for dim in array.dims} & {one.name for one in schema.COORDINATES}
        return
    assert array.units in {"1", "m", "m3", "s", "s-1", "Pa", "Pa s-1", "rad", "rad s-1", "percent"}
    assert array.dtype == "string" or np.dtype(array.dtype).name == array.dtype
    assert array.dims[: array.leading] == tuple(dim for dim in array.dims if dim in ("case", "view"))


def test_names_stand_once_in_a_group():
    for group, arrays in schema.KINDS.items():
        for listed in (arrays, schema.named(group)):
            names = [array.name for array in (*listed, *schema.coordinates(arrays))]
            assert len(names) == len(set(names))


def test_members_of_a_pack_have_all_its_dimensions_and_its_type():
    for packs in schema.PACKS.values():
        for pack in packs:
            for member in pack.members:
                assert set(member.dims) >= set(pack.array.dims[:-1]) and member.dtype == pack.array.dtype, member.name


def test_labels_belong_to_coordinates():
    assert set(schema.LABELS) <= {array.name for array in schema.COORDINATES}


def test_sized_groups_stand_once_for_every_image_size_and_tracked_ones_for_every_tracker():
    trackers = {name: PhaseCorrelation(window_px=32) for name in ("one", "two")}
    config = Config(bmode=Bmode(size_px=256, downsampling=(1, 4)), tracking=Tracking(trackers=trackers))
    groups = schema.groups(config)
    sized = {f"{stage}/{px}" for stage in schema.SIZED for px in (256, 64)}
    tracked = {f"{stage}/{px}/{name}" for stage in schema.TRACKED for px in (256, 64) for name in ("one", "two")}
    assert {path for path in groups if "/" in path} == sized | tracked


def test_names_that_no_tracker_may_have_are_those_beside_its_group():
    """In `tracking/SIZE` there is no array; the shards of every array lie in a folder c."""
    arrays = schema.SIZED["evaluation"]
    assert {array.name for array in (*arrays, *schema.coordinates(arrays))} | {"c"} == NOT_TRACKERS


def test_fill_says_that_nothing_was_written():
    assert np.isnan(schema.Array("a", ("case",), "float32", "m", "a").fill)
    assert schema.Array("a", ("case",), "string", "1", "a").fill == ""
    assert schema.Array("a", ("case",), "uint8", "1", "a").fill == 0


def test_columns_of_cases_carry_the_unit_of_their_key():
    columns = {"cases:fibres.endo_deg": np.array([84.0]), "cases:loop.file": np.array(["mouse"])}
    *_, angle, file = schema.parameters(columns)
    assert (angle.name, angle.dtype, angle.units) == ("fibres.endo_deg", "float64", "degree")
    assert (file.name, file.dtype, file.units) == ("loop.file", "string", "1")
