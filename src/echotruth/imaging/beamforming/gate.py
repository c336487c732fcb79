"""Range gates: the part of the record in which the echoes of a focal zone stand.

A zone needs a few of the record's samples, and its transmits cost as much as it has frequencies. The echoes of all
pairs are taken to time once, sampled little more often than their band asks for; each zone cuts its gate out of them,
and its edges, beyond what is needed, fall off smoothly, so that the spectrum of the gate hardly leaves the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy import fft

from echotruth.config import Probe
from echotruth.imaging.beamforming.interpolation import TAPS
from echotruth.imaging.beamforming.transmit import Zone
from echotruth.imaging.rf.kernel import window
from echotruth.imaging.rf.probe import element_centres

EDGE = 36
"""Samples over which a gate falls off at either end."""
SHARPNESS = 9.0
"""Of the window whose integral that fall is (see :func:`~echotruth.imaging.rf.kernel.window`)."""
MARGIN = 0.08
"""How far the spectrum of a gate is kept beyond the band, over the sampling rate; so gates err by less than 1e-5, of
echoes that fill their band, too."""


@dataclass(frozen=True)
class Sampling:
    """Samples of the echoes of all pairs as analytic signals, below their carrier where the band allows it.

    Attributes
    ----------
    bins : ndarray of shape (bins,)
        Where the frequencies of the matrix go in a spectrum of the record.
    samples : int
        Of the record.
    rate : float, Hz
    scale : float
        Makes the matrix spectra of these samples.
    """

    bins: np.ndarray
    samples: int
    rate: float
    scale: float

    def in_time(self, matrix: np.ndarray) -> np.ndarray:
        """Echoes of all pairs (samples, elements, elements), complex64, of a matrix (bins, elements, elements)."""
        spectra = np.zeros((self.samples, *matrix.shape[1:]), np.complex64)
        spectra[self.bins] = matrix * np.float32(self.scale)
        return fft.ifft(spectra, axis=0, overwrite_x=True, workers=numba.get_num_threads())


class Gate:
    """A part of the record.

    Parameters
    ----------
    sampling : Sampling
    band : (float, float), Hz
        Lowest and highest frequency of the echoes.
    span : (float, float), s
        Earliest and latest time that is needed.

    Attributes
    ----------
    first : int
        Sample of the record at which the gate begins.
    samples : int
    bins : ndarray of shape (bins,)
        Where the frequencies are in a spectrum of the gate.
    frequency : ndarray of shape (bins,), Hz
        Those within the band and its margin, evenly spaced, the lowest first.
    """

    def __init__(self, sampling: Sampling, band: tuple[float, float], span: tuple[float, float]) -> None:
        start, stop = (time * sampling.rate for time in span)
        self.first = int(np.floor(start)) - EDGE
        self.samples = fft.next_fast_len(int(np.ceil(stop)) + 1 + EDGE - self.first)
        self._place = (self.first + np.arange(self.samples)) % sampling.samples
        ramp = np.cumsum(window((np.arange(EDGE) + 0.5) / EDGE * TAPS - TAPS / 2, SHARPNESS))
        self._taper = np.ones((self.samples, 1, 1), np.float32)
        self._taper[:EDGE, 0, 0] = ramp / ramp[-1]
        self._taper[-EDGE:, 0, 0] = ramp[::-1] / ramp[-1]
        margin = min(MARGIN * sampling.rate, (sampling.rate - (band[1] - band[0])) / 2)
        alias = np.arange(self.samples) * sampling.rate / self.samples
        # Of all the frequencies that look alike when sampled, the one in the band.
        true = alias + np.ceil((band[0] - margin - alias) / sampling.rate) * sampling.rate
        inside = np.flatnonzero(true <= band[1] + margin)
        self.bins = inside[np.argsort(true[inside])]
        self.frequency = true[self.bins]

    def spectra(self, echoes: np.ndarray) -> np.ndarray:
        """Spectra (bins, elements, elements) of the gate, of the echoes in time (samples, elements, elements)."""
        gated = echoes[self._place]
        gated *= self._taper
        return fft.fft(gated, axis=0, overwrite_x=True, workers=numba.get_num_threads())[self.bins]


def span(probe: Probe, zone: Zone, range_: np.ndarray, points: tuple[np.ndarray, np.ndarray]) -> tuple[float, float]:
    """Earliest and latest echo between any two elements that the lines of a zone are made of, s.

    Parameters
    ----------
    probe : Probe
    zone : Zone
        Of focused waves.
    range_ : ndarray of shape (ranges,), m
        Of the zone.
    points : two ndarray of shape (lines, ranges), m
        Their lateral and axial coordinates.
    """
    # On a line all paths grow with range, so that its ends tell.
    lateral, axial = (each[:, [0, -1], None] for each in points)
    path = range_[[0, -1], None] + np.hypot(lateral - element_centres(probe), axial)
    received, delay = path / probe.si().sound_speed, zone.transmits.delay
    earliest = received[:, 0].min(axis=1) - delay.max(axis=1)
    latest = received[:, 1].max(axis=1) - delay.min(axis=1)
    return float(earliest.min()), float(latest.max())
