"""Range gates: the part of the record that contains the echoes of a focal zone.

The cost of the transmits of a zone is proportional to the length of its record. The echoes of all pairs are transformed
to time once, sampled little above the Nyquist rate; each zone cuts out its gate, whose edges, beyond what is needed,
are tapered so smoothly that its spectrum hardly leaves the band.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy import fft

from echotruth.config import Probe
from echotruth.imaging.beamforming.interpolation import TAPS
from echotruth.imaging.beamforming.transmit import Zone
from echotruth.imaging.rf.kernel import window
from echotruth.imaging.rf.probe import element_centres

TAPER_SAMPLES = 36
"""Samples over which a gate falls off at either end."""
SHARPNESS = 9.0
"""Sharpness of the window whose integral is the taper (see :func:`~echotruth.imaging.rf.kernel.window`)."""
ELEMENTS = 16
"""Elements of which the echoes to all others are transformed at a time."""
BAND_MARGIN = 0.08
"""Width of the spectrum of a gate that is kept beyond the band at either end, over the sampling rate; the error is then
below 1e-5, for echoes that fill their band, too."""


@dataclass(frozen=True)
class Sampling:
    """Sampling of the echoes of all pairs as analytic signals, below their carrier where the band allows it.

    Attributes
    ----------
    bins : ndarray of shape (bins,)
        Indices of the frequencies of the matrix in a spectrum of the record.
    samples : int
        Of the record.
    rate : float, Hz
    scale : float
        Factor from the matrix to the spectra of these samples.
    """

    bins: np.ndarray
    samples: int
    rate: float
    scale: float

    def to_time(self, matrix: np.ndarray) -> np.ndarray:
        """Echoes of all pairs (samples, elements, elements), complex64, of a matrix (bins, elements, elements)."""
        echoes = np.empty((self.samples, *matrix.shape[1:]), np.complex64)
        for some in _elements(matrix):
            spectra = np.zeros((self.samples, *matrix[0, some].shape), np.complex64)
            spectra[self.bins] = matrix[:, some] * np.float32(self.scale)
            echoes[:, some] = fft.ifft(spectra, axis=0, overwrite_x=True, workers=numba.get_num_threads())
        return echoes


def _elements(echoes: np.ndarray) -> list[slice]:
    """Elements (the second axis) whose echoes are transformed at a time, so that little memory is taken beside."""
    return [slice(first, first + ELEMENTS) for first in range(0, echoes.shape[1], ELEMENTS)]


class Gate:
    """A part of the record.

    Parameters
    ----------
    sampling : Sampling
    band : ndarray of shape (2,), Hz
        Lowest and highest frequency of the echoes.
    time_range : (float, float), s
        Earliest and latest time that is needed.

    Attributes
    ----------
    first : int
        Sample of the record at which the gate begins.
    samples : int
    bins : ndarray of shape (bins,)
        Indices of the frequencies in a spectrum of the gate.
    frequency : ndarray of shape (bins,), Hz
        Frequencies within the band and its margin, evenly spaced, the lowest first.
    """

    def __init__(self, sampling: Sampling, band: np.ndarray, time_range: tuple[float, float]) -> None:
        start, stop = (time * sampling.rate for time in time_range)
        self.first = int(np.floor(start)) - TAPER_SAMPLES
        self.samples = fft.next_fast_len(int(np.ceil(stop)) + 1 + TAPER_SAMPLES - self.first)
        self._indices = (self.first + np.arange(self.samples)) % sampling.samples
        ramp = np.cumsum(window((np.arange(TAPER_SAMPLES) + 0.5) / TAPER_SAMPLES * TAPS - TAPS / 2, SHARPNESS))
        self._taper = np.ones((self.samples, 1, 1), np.float32)
        self._taper[:TAPER_SAMPLES, 0, 0] = ramp / ramp[-1]
        self._taper[-TAPER_SAMPLES:, 0, 0] = ramp[::-1] / ramp[-1]
        margin = min(BAND_MARGIN * sampling.rate, (sampling.rate - (band[1] - band[0])) / 2)
        alias = np.arange(self.samples) * sampling.rate / self.samples
        # The frequency in the band, of those that share an alias.
        frequency = alias + np.ceil((band[0] - margin - alias) / sampling.rate) * sampling.rate
        inside = np.flatnonzero(frequency <= band[1] + margin)
        self.bins = inside[np.argsort(frequency[inside])]
        self.frequency = frequency[self.bins]

    def spectra(self, echoes: np.ndarray) -> np.ndarray:
        """Spectra (bins, elements, elements) of the gate, of the echoes in time (samples, elements, elements)."""
        spectra = np.empty((len(self.bins), *echoes.shape[1:]), np.complex64)
        for some in _elements(echoes):
            gated = echoes[:, some][self._indices]
            gated *= self._taper
            spectra[:, some] = fft.fft(gated, axis=0, overwrite_x=True, workers=numba.get_num_threads())[self.bins]
        return spectra


def echo_time_range(probe: Probe, zone: Zone, range_: np.ndarray, points: tuple) -> tuple[float, float]:
    """Earliest and latest echo (r + |x - x_j|) / c - delay_i of any elements i, j, points x and ranges r of a zone, s.

    Parameters
    ----------
    probe : Probe
    zone : Zone
        Zone of focused waves.
    range_ : ndarray of shape (ranges,), m
    points : two ndarray of shape (lines, ranges), m
        Lateral and axial coordinates of the samples.
    """
    # All paths grow with range, so that the ends of the lines suffice.
    lateral, axial = (coordinate[:, [0, -1], None] for coordinate in points)
    path = range_[[0, -1], None] + np.hypot(lateral - element_centres(probe), axial)
    time, delay = path / probe.sound_speed_m_per_s, zone.transmits.delay
    earliest = time[:, 0].min(axis=1) - delay.max(axis=1)
    latest = time[:, 1].max(axis=1) - delay.min(axis=1)
    return float(earliest.min()), float(latest.max())
