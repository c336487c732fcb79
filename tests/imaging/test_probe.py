"""The array, its pulse and its beam in elevation."""

import numpy as np
import pytest
from scipy.optimize import brentq

from echotruth.config import Probe
from echotruth.imaging.probe import (
    ElevationProfile,
    apodization,
    directivity,
    element_centres,
    elevation_amplitude,
    pulse,
    pulse_spectrum,
)

WAVELENGTH = 1540 / 25e6


def half_width(function, low, high):
    """Twice the place where a falling function reaches half its value at 0."""
    return 2 * brentq(lambda x: function(x) - function(0.0) / 2, low, high)


def test_elements_are_a_pitch_apart_and_centred():
    centres = element_centres(Probe())
    assert np.allclose(np.diff(centres), 46e-6)
    assert centres.sum() == pytest.approx(0, abs=1e-12)
    assert len(centres) == 64


def test_hann_weights_fall_from_one_to_nearly_zero():
    weights = apodization(Probe(), "hann")
    assert np.allclose(weights, weights[::-1])
    assert weights[31] == pytest.approx(np.cos(np.pi / 128) ** 2)
    assert 0 < weights[0] < 1e-3
    assert (apodization(Probe(), "none") == 1).all()


def test_unknown_apodization_is_refused():
    with pytest.raises(ValueError, match="not known"):
        apodization(Probe(), "boxcar")


@pytest.mark.parametrize("bandwidth", [0.4, 0.7])
def test_spectrum_is_half_at_half_the_bandwidth(bandwidth):
    probe = Probe(bandwidth=bandwidth)
    edge = 25e6 * (1 + np.array([-0.5, 0, 0.5]) * bandwidth)
    assert np.allclose(pulse_spectrum(probe, edge), [0.5, 1, 0.5])


def test_spectrum_is_cut_below_nyquist_and_above_zero():
    assert (pulse_spectrum(Probe(bandwidth=0.7), np.array([-1e6, 0.0, 50e6])) == 0).all()


def test_pulse_is_the_sinusoid_in_a_gaussian_window():
    time = np.linspace(-80e-9, 80e-9, 161)
    deviation = 12.5e6 / np.sqrt(8 * np.log(2))
    window = np.exp(-2 * (np.pi * deviation * time) ** 2)
    assert np.allclose(pulse(Probe(), time), window * np.cos(2 * np.pi * 25e6 * time), atol=6e-3)


def test_directivity_is_one_ahead_and_zero_where_the_strip_cancels():
    assert directivity(0.0, 1.0, 0.67) == 1
    assert directivity(0.5, np.sqrt(0.75), 2.0) == pytest.approx(0, abs=1e-15)
    angle = np.radians(30)
    exact = np.sin(np.pi * 0.67 / 2) / (np.pi * 0.67 / 2) * np.cos(angle)
    assert directivity(np.sin(angle), np.cos(angle), 0.67) == pytest.approx(exact)


def test_elevation_profile_is_symmetric():
    profile = ElevationProfile.of(Probe(), 13e-3)
    elevation = np.linspace(0, 1e-3, 101)
    reach = np.full(101, 5e-3)
    assert (profile(elevation, reach) == profile(-elevation, reach)).all()


def test_width_in_elevation_focus_is_that_of_a_squared_sinc():
    def amplitude(y):
        return float(elevation_amplitude(Probe(), np.array([y]), 6.5e-3)[0])

    assert amplitude(0.0) == pytest.approx(1)
    assert half_width(amplitude, 0.0, 0.3e-3) == pytest.approx(0.8859 * WAVELENGTH * 6.5, rel=1e-3)


def test_lens_is_strongest_at_its_own_focus():
    def on_axis(focus_mm):
        return float(elevation_amplitude(Probe(elevation_focus_mm=focus_mm), np.zeros(1), 6.5e-3)[0])

    assert on_axis(6.5) == pytest.approx(1)
    assert on_axis(4.0) < 0.95
    assert on_axis(13.0) < 0.95


def test_elevation_table_agrees_with_the_integral():
    probe = Probe()
    profile = ElevationProfile.of(probe, 13e-3)
    elevation = np.linspace(-1e-3, 1e-3, 333)
    for reach in (1.1e-3, 3.7e-3, 6.5e-3, 12e-3):
        exact = elevation_amplitude(probe, elevation, reach)
        assert np.abs(profile(elevation, np.full(333, reach)) - exact).max() < 0.01 * exact.max()


def test_elevation_integral_agrees_with_plain_summation():
    height = (np.arange(20000) + 0.5) / 20000 * 1e-3 - 0.5e-3
    reach, y = 4e-3, 0.23e-3
    path = (y - height) ** 2 / (2 * reach) - height**2 / (2 * 6.5e-3)
    exact = np.abs(np.exp(2j * np.pi * path / WAVELENGTH).mean()) ** 2
    assert elevation_amplitude(Probe(), np.array([y]), reach)[0] == pytest.approx(exact, rel=1e-6)
