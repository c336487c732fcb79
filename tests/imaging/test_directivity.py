"""Directivity against its closed form, and the fits to pairs of elements."""

import numpy as np
import pytest

from echotruth.imaging.rf.directivity import (
    ANGLES,
    HALF_APERTURE,
    MAX_ARGUMENT_SQUARED,
    pair_spectra,
    sinc,
    spectral_exponent,
)

RATIO = np.linspace(0.5, 1.5, 11)


def test_series_is_the_sine_over_its_argument():
    x = np.linspace(0, 6, 50)
    np.testing.assert_allclose(sinc(x**2), np.sinc(x / np.pi), atol=1e-8)


def test_spectral_exponent_is_the_power_of_the_frequency_that_the_directivity_follows():
    x, step = np.linspace(0.1, 2.7, 20), 1e-5
    slope = (np.log(np.sinc(x * (1 + step) / np.pi)) - np.log(np.sinc(x * (1 - step) / np.pi))) / (2 * step)
    np.testing.assert_allclose(spectral_exponent(x**2), slope, rtol=1e-6)
    greatest, beyond = spectral_exponent(np.array([MAX_ARGUMENT_SQUARED, 100.0]))
    assert greatest == beyond


@pytest.mark.parametrize("angle", [0, 25])
@pytest.mark.parametrize("count, bound", [(6, 2e-5), (4, 1e-3)])
def test_pair_spectra_give_the_pulse_of_a_pair_of_unlike_elements(angle, count, bound):
    width = 0.67
    mean_exponent, spectra = pair_spectra(width, RATIO, count)
    middle, random = angle / (ANGLES - 1), np.random.default_rng(angle)
    one, other = middle + HALF_APERTURE * random.uniform(-0.95, 0.95, (2, 50))
    a, b = (spectral_exponent((np.pi * width * sine) ** 2) - mean_exponent[angle] for sine in (one, other))
    terms = np.stack([(a + b) ** m for m in range(4)] + [(a - b) ** 2, (a - b) ** 2 * (a + b)])[:count]
    exact = np.ones((50, 11))
    for sine in (one, other):
        exact *= np.sinc(np.outer(width * sine, RATIO)) / np.sinc(width * sine)[:, None]
    energy = np.exp(-(((RATIO - 1) / 0.212) ** 2))  # of a pulse of 50 % bandwidth
    missed = np.square(terms.T @ spectra[angle] - exact) @ energy / (np.square(exact) @ energy)
    assert np.sqrt(missed.mean()) < bound
