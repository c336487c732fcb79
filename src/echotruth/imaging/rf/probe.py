"""The phased array: elements and pulse.

Frame of the probe: origin at the centre of the array, coordinates in the order lateral, axial, elevation.
"""

from math import log, sqrt

import numpy as np

from echotruth.config import Probe
from echotruth.units import MHz, um

SPECTRUM_CUTOFF = 0.01
"""Spectrum of the pulse, relative to its maximum, below which it is cut (-40 dB)."""
MAX_FREQUENCY = 0.46
"""Highest frequency of the pulse over the sampling frequency; above it echoes cannot be spread accurately."""


def element_centres(probe: Probe) -> np.ndarray:
    """Lateral coordinates of the element centres, shape (elements,), m."""
    return (np.arange(probe.elements) - (probe.elements - 1) / 2) * (probe.pitch_um * um)


def wavelength(probe: Probe) -> float:
    """Wavelength at the centre frequency, m."""
    return probe.sound_speed_m_per_s / (probe.frequency_MHz * MHz)


def spectral_width(probe: Probe) -> float:
    """Standard deviation of the Gaussian two-way spectrum (amplitude), B f0 / (2 sqrt(2 ln 2)), Hz.

    The amplitude falls to one half (-6 dB) at half the bandwidth from the centre frequency.
    """
    return probe.bandwidth * (probe.frequency_MHz * MHz) / 2 / sqrt(2 * log(2))


def pulse_band(probe: Probe) -> tuple[float, float]:
    """Lowest and highest frequency of the pulse, Hz: where its spectrum is cut off."""
    centre, half = probe.frequency_MHz * MHz, spectral_width(probe) * sqrt(-2 * log(SPECTRUM_CUTOFF))
    return max(centre - half, 0.0), min(centre + half, MAX_FREQUENCY * (probe.sampling_MHz * MHz))


def pulse_spectrum(probe: Probe, frequency: np.ndarray) -> np.ndarray:
    """Spectrum exp(-(f - f0)^2 / (2 sigma^2)) of the two-way pulse, real and without delay.

    A sinusoid at the centre frequency f0 in a Gaussian window, sigma being :func:`spectral_width`, cut to
    :func:`pulse_band`.

    Parameters
    ----------
    frequency
        Any shape, Hz.

    Returns
    -------
    Same shape, 1; 1 at the centre frequency.
    """
    frequency = np.asarray(frequency, float)
    low, high = pulse_band(probe)
    gaussian = np.exp(-((frequency - probe.frequency_MHz * MHz) ** 2) / (2 * spectral_width(probe) ** 2))
    return np.where((frequency >= low) & (frequency <= high), gaussian, 0.0)
