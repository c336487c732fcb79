"""Radio-frequency data: the echoes of a phantom between all pairs of elements.

The echo of a scatterer between two elements is its amplitude times the two directivities, the spreading 1/r on each
way and the two-way amplitude in elevation, delayed by the two ways and shaped by the pulse. By reciprocity only the
pairs i <= j are computed.
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from echotruth.config import Probe
from echotruth.imaging import deposit
from echotruth.imaging.probe import ElevationProfile, element_centres, pulse_band, pulse_spectrum, spectral_width

FAINT = 1e-3
"""Scatterers whose two-way amplitude in elevation is below this are left out; it is 1 in the elevation focus."""
BLOCK = 2048
"""Scatterers deposited at a time."""


class FullMatrix:
    """Echoes between all pairs of elements of a probe.

    Parameters
    ----------
    probe
        The array.
    depth
        Greatest range of interest, m. Scatterers farther than this and half a pulse are left out.
    latest
        Greatest delay, early or late, that will be added to the echoes, s.

    Attributes
    ----------
    frequency : ndarray (bins,)
        Frequencies of the pulse band on the grid of the record, Hz.
    first : int
        Bin of the first of them.
    sampling : float
        Sampling frequency of the record, Hz.
    samples : int
        Length of the record; it starts at time 0 and ends with the latest echo plus room for delays and pulse.
    """

    def __init__(self, probe: Probe, depth: float, latest: float = 0.0):
        p = probe.si()
        half_pulse = 4.5 / (2 * np.pi * spectral_width(probe))
        self.reach = depth + p.sound_speed * half_pulse / 2
        last = 2 * self.reach / p.sound_speed + p.elements * p.pitch / p.sound_speed + half_pulse
        self.samples = fft.next_fast_len(int((last + 2 * latest) * p.sampling) + deposit.TAPS + 1, real=True)
        if self.samples >= 1 << (31 - deposit.FRACTION_BITS):
            raise ValueError(f"A record of {self.samples} samples is too long: image less deep or sample slower.")
        self.sampling = p.sampling
        self.centres = element_centres(probe)
        self.pairs = np.stack(np.triu_indices(probe.elements), axis=1)
        self._samples_per_metre = p.sampling / p.sound_speed
        self._width = p.width * p.frequency / p.sound_speed
        self._profile = ElevationProfile.of(probe, self.reach)
        self._table = deposit.kernel_table()
        low, high = pulse_band(probe)
        cycles = np.arange(self.samples // 2 + 1) / self.samples
        inside = np.flatnonzero((cycles * p.sampling >= low) & (cycles * p.sampling <= high))
        self.first = int(inside[0])
        self.frequency = cycles[inside] * p.sampling
        response = pulse_spectrum(probe, self.frequency) / deposit.kernel_spectrum(cycles[inside])
        # Rows begin LEAD samples before time 0.
        self._response = (response * np.exp(2j * np.pi * cycles[inside] * deposit.LEAD)).astype(np.complex64)

    def heard(self, position: np.ndarray, amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Scatterers within the record and the beam: positions (m, 3) and amplitudes with the elevation weight (m,).

        They come in an arbitrary but fixed order, since neighbours in space make neighbouring memory busy.
        """
        within = np.flatnonzero(np.linalg.norm(position, axis=1) <= self.reach)
        reach = np.hypot(position[within, 0], position[within, 1])
        weight = self._profile(position[within, 2], reach)
        kept = np.flatnonzero(weight >= FAINT)
        kept = np.random.default_rng(0).permutation(kept)
        return position[within[kept]], amplitude[within[kept]] * weight[kept]

    def traces(self, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Deposited echoes before kernel and pulse are accounted for, shape (pairs, samples), float32."""
        position, amplitude = self.heard(position, amplitude)
        traces = np.zeros((len(self.pairs), self.samples), np.float32)
        for start in range(0, len(position), BLOCK):
            block = position[start : start + BLOCK]
            time = np.empty((len(self.centres), len(block)), np.int32)
            weight = np.empty(time.shape, np.float32)
            deposit.one_way(block, self.centres, self._samples_per_metre, self._width, time, weight)
            echo = weight * amplitude[start : start + BLOCK].astype(np.float32)
            deposit.add_echoes(traces, self.pairs, time, weight, echo, self._table)
        return traces

    def __call__(self, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Spectra of the echoes of all pairs at `frequency`.

        Parameters
        ----------
        position
            Shape (scatterers, 3), m.
        amplitude
            Shape (scatterers,), 1.

        Returns
        -------
        Shape (bins, elements, elements), complex64, symmetric in the elements. Units: amplitude / m^2 / sample.
        """
        traces = self.traces(position, amplitude)
        stop = self.first + len(self.frequency)
        spectra = np.empty((len(traces), len(self.frequency)), np.complex64)
        for start in range(0, len(traces), 64):
            part = slice(start, start + 64)
            spectra[part] = fft.rfft(traces[part], axis=1)[:, self.first : stop] * self._response
        matrix = np.empty((len(self.frequency), len(self.centres), len(self.centres)), np.complex64)
        deposit.unfold(spectra, self.pairs, matrix)
        return matrix
