"""What is packed is found again by its name, in the store and at a notebook."""

import numpy as np
import pytest
import xarray as xr

from echotruth.repository import schema
from echotruth.repository.array import Array
from echotruth.repository.packing import Pack, pack, unpack
from echotruth.repository.store import Store
from echotruth.repository.unpacking import unpack as unpacked
from tests.repository.test_store import lay_out

PACK = Pack(
    Array("numbers", ("case", "frame", "number"), "float64", "mixed", "numbers"),
    (
        Array("alone", ("case", "frame"), "float64", "s", "one number"),
        Array("pair", ("case", "region", "frame", "polar"), "float64", "m", "numbers with dimensions before and after"),
    ),
)
TRACKED, TRUE, CLIP = "evaluation/32/one", "evaluation/32", {"case": 0, "view": 1}
COORDINATES = {"region": [0, 1, 2], "polar": ["radial", "tangential"]}


def test_labels_name_the_array_and_the_place_and_have_its_unit():
    labels = PACK.labels(COORDINATES)
    assert labels["number"][:4] == ["alone", "pair[0,radial]", "pair[0,tangential]", "pair[1,radial]"]
    assert labels["number_units"] == ["s"] + 6 * ["m"]


def test_each_number_stands_at_its_label():
    random = np.random.default_rng(1)
    values = {"alone": random.random(4), "pair": random.random((3, 4, 2)), "other": np.arange(3)}
    stored = pack([PACK], values)
    assert set(stored) == {"numbers", "other"} and stored["numbers"].shape == (4, 7)
    place = PACK.labels(COORDINATES)["number"].index("pair[2,tangential]")
    np.testing.assert_array_equal(stored["numbers"][:, place], values["pair"][2, :, 1])
    np.testing.assert_array_equal(stored["numbers"][:, 0], values["alone"])


def test_unpacking_undoes_packing():
    random = np.random.default_rng(2)
    values = {"alone": random.random(4), "pair": random.random((3, 4, 2)), "other": np.arange(3)}
    found = unpack([PACK], pack([PACK], values), PACK.labels(COORDINATES))
    assert set(found) == set(values)
    for name, value in values.items():
        np.testing.assert_array_equal(found[name], value)


def test_a_part_of_the_members_is_refused_and_none_is_fine():
    with pytest.raises(ValueError, match="numbers needs all its members at once: alone is missing"):
        pack([PACK], {"pair": np.zeros((3, 4, 2))})
    assert set(pack([PACK], {"other": 1})) == {"other"}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Store in which one heart has all scores and measures, and what they are."""
    store = lay_out(tmp_path_factory.mktemp("packed") / "small.zarr", [1])
    random, values = np.random.default_rng(3), {}
    for group, row in ((TRACKED, (0, 1)), (TRUE, (0, 1)), ("physiology", (0,))):
        opened = store._open(group, "r")
        stored = {
            one.array.name: random.random(opened[one.array.name].shape[len(row) :]) for one in schema.packs_of(group)
        }
        values[group] = unpack(schema.packs_of(group), stored, opened.attrs["labels"])
        store.write(group, values[group], *row)
    return store, values


def test_store_reads_single_arrays_of_a_pack_by_their_names(written):
    store, values = written
    for group, shapes in (
        (TRACKED, {"nrmse": (7, 3), "coverage": ()}),
        (TRUE, {"true_segment_strain": (3, 4, 2, 17, 3)}),
    ):
        found = store.read(group, 0, 1, names=tuple(shapes))
        assert {name: value.shape for name, value in found.items()} == shapes
        for name, value in found.items():
            np.testing.assert_array_equal(value, values[group][name].astype(value.dtype))


def test_notebook_finds_every_array_with_its_dimensions_coordinates_and_unit(written):
    store, values = written
    with xr.open_datatree(store.path, engine="zarr") as tree:
        for group, row in ((TRACKED, CLIP), (TRUE, CLIP), ("physiology", {"case": 0})):
            members = {one.name: one for pack in schema.packs_of(group) for one in pack.members}
            data = unpacked(tree[group].to_dataset())
            for name, value in values[group].items():
                assert data[name].dims == members[name].dims
                assert data[name].attrs == {"units": members[name].units, "long_name": members[name].long_name}
                np.testing.assert_array_equal(data[name].isel(row), value.astype(data[name].dtype), err_msg=name)
        nrmse = unpacked(tree[TRACKED].to_dataset(), "nrmse").nrmse
    assert list(nrmse.region.values) == [*range(7)] and list(nrmse.component.values) == [
        "radial",
        "tangential",
        "total",
    ]


def test_selection_in_another_order_gives_the_same_numbers(written):
    store, _ = written
    with xr.open_datatree(store.path, engine="zarr") as tree:
        data = tree[TRACKED].to_dataset()[["scores"]]
        labels = [str(label) for label in data["score"].values if str(label).startswith("nrmse[")]
        labels[1:] = labels[:0:-1]
        whole, turned = (unpacked(one, "nrmse").nrmse.load() for one in (data, data.sel(score=labels)))
    assert list(turned["component"].values) != list(whole["component"].values)
    np.testing.assert_array_equal(turned.sel(region=whole["region"], component=whole["component"]), whole)


def test_selection_is_unpacked_as_far_as_it_goes(written):
    store, values = written
    with xr.open_datatree(store.path, engine="zarr") as tree:
        data = tree[TRACKED].to_dataset()
        one = unpacked(data.sel(view="long_axis").isel(case=0), "strain_rms")
        assert set(one.data_vars) == {"strain_rms"}
        assert "time" not in one.coords
        assert one.strain_rms.dims == ("reference", "region", "wall_component")
        np.testing.assert_array_equal(one.strain_rms, values[TRACKED]["strain_rms"])
        with pytest.raises(ValueError, match=r"^nrmse: the selection has a part of its numbers"):
            unpacked(data.sel(score=["nrmse[0,total]", "nrmse[1,radial]"]))
        with pytest.raises(ValueError, match=r"^tracked_strain is not an array of this group"):
            unpacked(data, "tracked_strain")


def test_unit_of_every_number_is_that_of_its_array(written):
    store: Store = written[0]
    opened = store._open(TRACKED, "r")
    members = {member.name: member for member in schema.packs_of(TRACKED)[0].members}
    labels = [str(label) for label in opened["score"][...]]
    assert [str(unit) for unit in opened["score_units"][...]] == [members[x.partition("[")[0]].units for x in labels]
    assert len(set(labels)) == len(labels)
