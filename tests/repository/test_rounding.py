"""Stored numbers are multiples of their quantum, half of it away from what was computed at most."""

import numpy as np

from echotruth.repository import rounding


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
