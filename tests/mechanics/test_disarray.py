"""The random turn of the fibres has the spread and the correlation asked for, and is the same for the same seed."""

import numpy as np
import pytest

from echotruth.mechanics.disarray import random_field, rotate

LENGTH = 0.5e-3
BOX = 20e-3


@pytest.fixture(scope="module")
def positions():
    return np.random.default_rng(1).uniform(0, BOX, (8000, 3))


def test_numbers_are_normal_with_standard_deviation_one(positions):
    values = random_field(positions, LENGTH, seed=1)
    assert np.mean(values) == pytest.approx(0, abs=0.05)
    assert np.std(values) == pytest.approx(1, abs=0.04)
    assert np.mean(values**4) / np.var(values) ** 2 == pytest.approx(3, abs=0.2)


@pytest.mark.parametrize("lengths", [0.5, 1.5])
def test_correlation_falls_with_the_distance_as_a_bell_curve(positions, lengths):
    way = np.random.default_rng(2).normal(size=positions.shape)
    way *= lengths * LENGTH / np.linalg.norm(way, axis=1, keepdims=True)
    here, there = random_field(positions, LENGTH, seed=1), random_field(positions + way, LENGTH, seed=1)
    assert np.corrcoef(here, there)[0, 1] == pytest.approx(np.exp(-(lengths**2) / 2), abs=0.04)


def test_a_place_has_its_number_in_whatever_order_and_another_seed_has_others(positions):
    values = random_field(positions, LENGTH, seed=7)
    assert np.array_equal(random_field(positions[::-1].reshape(100, 80, 3), LENGTH, seed=7).ravel()[::-1], values)
    assert abs(np.corrcoef(random_field(positions, LENGTH, seed=8), values)[0, 1]) < 0.05


def test_a_frame_turns_about_the_axis():
    frames, axis = np.eye(3)[None], np.array([[0.0, 0, 1]])
    expected = [[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]]
    np.testing.assert_allclose(rotate(frames, axis, np.array([0.3]))[0], expected, atol=1e-15)
