"""Stored numbers are multiples of their quantum, half of it away from what was computed at most."""

import json

import numpy as np
import pytest

from echotruth.config import Bmode, Config
from echotruth.repository import rounding, schema
from tests.repository.test_store import SMALL, lay_out


def test_values_move_by_half_a_quantum_at_most_to_a_multiple_of_it():
    values = np.random.default_rng(1).normal(scale=1e-3, size=10_000).astype("float32")
    quantum = 2.0**-24
    result = rounding.rounded(values, quantum)
    assert result.dtype == np.float32
    assert np.abs(result.astype(float) - values).max() <= quantum / 2
    multiples = result.astype(float) / quantum
    np.testing.assert_array_equal(multiples, np.floor(multiples))
    np.testing.assert_array_equal(rounding.rounded(result, quantum), result)


def test_halves_go_to_even_multiples_and_what_is_no_number_stays():
    values = np.array([0.5, 1.5, -0.5, -0.2, np.nan, np.inf, -np.inf, 0.0])
    result = rounding.rounded(values, 1.0)
    np.testing.assert_array_equal(result, [0, 2, 0, 0, np.nan, np.inf, -np.inf, 0])
    assert not np.signbit(result[2:4]).any()


def test_without_a_quantum_values_stay_bit_for_bit():
    values = np.array([0.1, -0.0, np.nan])
    assert rounding.rounded(values, None).tobytes() == values.tobytes()


@pytest.mark.parametrize("field_of_view_mm, size_px", [(12, 512), (12, 128), (160, 512), (10.24, 1024)])
def test_quantum_of_lengths_is_the_power_of_two_below_a_256th_of_the_finest_pixel(field_of_view_mm, size_px):
    bmode = Bmode(field_of_view_mm=field_of_view_mm, size_px=size_px, downsampling=(1, 2))
    finest = field_of_view_mm * 1e-3 / size_px
    quantum = rounding.length_quantum(Config(bmode=bmode))
    assert quantum <= finest / 256 < 2 * quantum
    assert np.frexp(quantum)[0] == 0.5


def test_store_rounds_what_a_job_writes_to_the_quantum_that_its_metadata_state(tmp_path):
    config = Config(**SMALL)
    store = lay_out(tmp_path / "small.zarr", [1])
    opened = store._open("tracking/64/one", "r")
    random, values = np.random.default_rng(2), {}
    for array in schema.KINDS["tracking/SIZE/TRACKER"]:
        values[array.name] = random.normal(scale=1e-3, size=opened[array.name].shape[2:])
    store.write("tracking/64/one", values, 0, 1)
    read = store.read("tracking/64/one", 0, 1)
    stated = {
        name: json.loads((store.path / f"tracking/64/one/{name}/zarr.json").read_bytes())["attributes"]["quantum"]
        for name in values
    }
    assert stated == {"displacement": rounding.length_quantum(config), "quality": 2.0**-8}
    for name, quantum in stated.items():
        expected = np.round(values[name].astype("float32") / quantum) * quantum
        np.testing.assert_array_equal(read[name], expected)
        assert not np.array_equal(read[name], values[name].astype("float32"))


def test_chunk_is_one_component_of_one_frame_or_of_the_cycle_that_one_tracker_found(tmp_path):
    tracking = SMALL["tracking"].model_copy(update={"grid_px": 2})
    store = lay_out(tmp_path / "small.zarr", [1], tracking=tracking)
    for name in ("displacement", "strain"):
        assert store._open("truth/64", "r")[name].chunks == (1, 1, 1, 64, 64, 1)
    tracked = store._open("tracking/64/one", "r")["displacement"]
    assert tracked.chunks == (1, 1, *tracked.shape[2:5], 1)
