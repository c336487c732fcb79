"""The record of an array: its grid in time, and how the traces on it become spectra of echoes.

:mod:`~echotruth.imaging.rf.full_matrix` and :mod:`~echotruth.imaging.rf.row_column` spread echoes on this grid by short
kernels (:mod:`~echotruth.imaging.rf.kernel`); here the traces are filtered together, those of each exponent by a filter
that contains the power of the frequency.
"""

from __future__ import annotations

from functools import reduce

import numba
import numpy as np
from scipy import fft

from echotruth.config import Probe
from echotruth.imaging.rf import kernel, spreading
from echotruth.imaging.rf.attenuation import separable_damping
from echotruth.imaging.rf.elevation import MAX_BLOCKS
from echotruth.imaging.rf.frequency_sum import PAIRS
from echotruth.imaging.rf.kernel import NODES, TAPS, Band, Grid, stack_real_imaginary
from echotruth.imaging.rf.probe import pulse_band, pulse_spectrum, spectral_width
from echotruth.units import MHz, dB_per_cm_MHz

PLANE = 2
"""Scheme of the kernels' tables (see :data:`.spreading.COEFFICIENTS`) without a lens."""
MAX_BAND, SHARPNESS = (0.32, 0.41), (20.0, 15.0)
"""Greatest frequency of the pulse over the sampling frequency of the grid, and sharpness of the window: without and
with the lens."""


class Record:
    """The record of every pair of elements.

    Parameters
    ----------
    probe : Probe
    band : Band
        Of its pulse, as :func:`pulse_grid` returns it.
    longest : float
        Longest way to a scatterer and back, m.
    max_delay : float
        Greatest delay, early or late, that will be added to the echoes, s.

    Attributes
    ----------
    frequency : ndarray of shape (bins,), Hz
        Frequencies of the pulse band on the grid of the record.
    first_bin : int
        Bin of the first of them.
    sampling : float, Hz
        Sampling frequency of the record.
    samples : int
        Length of the record; it starts at time 0 and ends with the latest echo plus room for delays and pulse.
    ratio : ndarray of shape (bins,)
        Frequencies over the centre frequency.

    Raises
    ------
    ValueError
        If the record is too long.
    """

    def __init__(self, probe: Probe, band: Band, longest: float, max_delay: float = 0.0) -> None:
        self.sampling = band.grid.sampling
        last = longest / probe.sound_speed_m_per_s + half_pulse(probe) + 2 * max_delay
        self.samples = _length(int(last * self.sampling) + 2 * spreading.LEAD + MAX_BLOCKS * TAPS)
        if self.samples >= 1 << (31 - spreading.FRACTION_BITS):
            remedy = "decrease the depth of the image or probe.sampling_MHz"
            raise ValueError(f"A record of {self.samples} samples is too long: {remedy}.")
        low, high = pulse_band(probe)
        cycles = np.arange(self.samples // 2 + 1) / self.samples
        inside = np.flatnonzero((cycles * self.sampling >= low) & (cycles * self.sampling <= high))
        self.first_bin = int(inside[0])
        self.frequency = cycles[inside] * self.sampling
        self.ratio = self.frequency / (probe.frequency_MHz * MHz)
        rate = damping_rate(probe, self.frequency)
        time = (np.arange(self.samples) - spreading.LEAD) / self.sampling
        damping, filters = separable_damping(rate, time)
        window = kernel.window_spectrum(band.grid.complex_frequency(self.frequency, rate), band.grid.sharpness)
        response = pulse_spectrum(probe, self.frequency) / window
        advance = np.exp(2j * np.pi * cycles[inside] * spreading.LEAD)  # rows begin LEAD samples before time 0
        self._damping = damping.astype(np.float32)
        self._responses = (filters * response * advance).astype(np.complex64)

    def add_spectra(self, spectra: np.ndarray, traces: np.ndarray, power: float) -> None:
        """Add to spectra (bins, pairs) those of traces (pairs, samples), which follow a power of the frequency."""
        band, threads = slice(self.first_bin, self.first_bin + len(self.frequency)), numba.get_num_threads()
        responses = (self._responses * self.ratio**power).astype(np.complex64)
        for start in range(0, len(traces), PAIRS):
            some = traces[start : start + PAIRS]
            echoes = (
                fft.rfft(some * fading, axis=1, workers=threads)[:, band] * response
                for fading, response in zip(self._damping, responses, strict=True)
            )
            spectra[:, start : start + PAIRS] += reduce(np.add, echoes).T


def half_pulse(probe: Probe) -> float:
    """Half of the time that the pulse takes, s."""
    return 4.5 / (2 * np.pi * spectral_width(probe))


def damping_rate(probe: Probe, frequency: np.ndarray) -> np.ndarray:
    """Rate alpha (f - f0) c at which an echo at these frequencies fades faster than at the centre frequency, 1/s."""
    attenuation = probe.attenuation_dB_per_cm_MHz * dB_per_cm_MHz
    return attenuation * (frequency - probe.frequency_MHz * MHz) * probe.sound_speed_m_per_s


def pulse_grid(probe: Probe, elevation: bool) -> Band:
    """Band of the pulse, and the grid that samples it, with or without the lens."""
    low, high = pulse_band(probe)
    grid = Grid(max(probe.sampling_MHz * MHz, high / MAX_BAND[elevation]), SHARPNESS[elevation])
    node, weight = np.polynomial.legendre.leggauss(NODES)
    frequency = (low + high) / 2 + node * (high - low) / 2
    energy = weight * pulse_spectrum(probe, frequency) ** 2
    return Band(frequency, energy / energy.sum(), grid, damping_rate(probe, frequency))


def plane_tables(band: Band, scheme: int, pair_spectra: np.ndarray) -> np.ndarray:
    """Tables of kernels of a scheme, flat, float32, of the fits (angles, terms, NODES) of :func:`.pair_spectra`."""
    spectra = stack_real_imaginary(pair_spectra + 0j)
    terms = [
        np.einsum(
            "pdtf,kf->kpdt",
            kernel.fit_polynomials(band, 1, number - 1, spreading.phases_of(scheme))[0],
            spectra[:, term],
        )
        for term, number in enumerate(spreading.COEFFICIENTS[scheme])
        if number
    ]
    values = np.concatenate(terms, axis=2).ravel()
    tables = spreading.cache_aligned(len(values))
    tables[:] = values
    return tables


def _length(least: int) -> int:
    """Smallest fast transform length of at least `least` samples that is not a multiple of 256.

    Echoes are at similar samples of all traces; with a multiple of 256 these would compete for the same cache lines.
    """
    samples = fft.next_fast_len(least, real=True)
    return samples if samples % 256 else _length(samples + 1)
