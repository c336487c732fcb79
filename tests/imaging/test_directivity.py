"""Directivity against its closed form, and the fits to pairs of elements."""

import numpy as np
import pytest

from echotruth.imaging.rf.directivity import APERTURE, KINDS, WIDEST, shapes, sinc, tilt

RATIO = np.linspace(0.5, 1.5, 11)


def test_series_is_the_sine_over_its_argument():
    x = np.linspace(0, 6, 50)
    np.testing.assert_allclose(sinc(x**2), np.sinc(x / np.pi), atol=1e-8)


def test_tilt_is_the_power_of_the_frequency_that_the_directivity_follows():
    x, step = np.linspace(0.1, 2.7, 20), 1e-5
    slope = (np.log(np.sinc(x * (1 + step) / np.pi)) - np.log(np.sinc(x * (1 - step) / np.pi))) / (2 * step)
    np.testing.assert_allclose(tilt(x**2), slope, rtol=1e-6)
    assert tilt(np.array([100.0])) == tilt(np.array([WIDEST]))


@pytest.mark.parametrize("kind", [0, 10, 20, 25])
@pytest.mark.parametrize("count, bound", [(6, 2e-5), (4, 1e-3)])
def test_shapes_give_the_pulse_of_a_pair_of_unlike_elements(kind, count, bound):
    width = 0.67
    means, found = shapes(width, RATIO, count)
    middle, random = kind / (KINDS - 1), np.random.default_rng(kind)
    one, other = middle + APERTURE * random.uniform(-0.95, 0.95, (2, 50))
    a, b = (tilt((np.pi * width * sine) ** 2) - means[kind] for sine in (one, other))
    terms = np.stack([(a + b) ** m for m in range(4)] + [(a - b) ** 2, (a - b) ** 2 * (a + b)])[:count]
    exact = np.ones((50, 11))
    for sine in (one, other):
        exact *= np.sinc(np.outer(width * sine, RATIO)) / np.sinc(width * sine)[:, None]
    energy = np.exp(-(((RATIO - 1) / 0.212) ** 2))  # of a pulse of 50 % bandwidth
    missed = np.square(terms.T @ found[kind] - exact) @ energy / (np.square(exact) @ energy)
    assert np.sqrt(missed.mean()) < bound
