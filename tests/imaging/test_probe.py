"""The array and its pulse."""

import numpy as np
import pytest

from benchmarks.exact_sum import pulse
from echotruth.config import Probe
from echotruth.imaging.rf.probe import element_centres, pulse_spectrum


def test_elements_are_a_pitch_apart_and_centred():
    centres = element_centres(Probe())
    assert np.allclose(np.diff(centres), 46e-6)
    assert centres.sum() == pytest.approx(0, abs=1e-12)
    assert len(centres) == 64


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
