"""Focused transmits: channel data of the lines of a sector, made from the full matrix.

A focused transmit is the sum of the single ones, delayed and weighted; at each frequency that is a matrix product.
"""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np
from scipy import fft

from echotruth.config import Probe, Rf
from echotruth.imaging.probe import apodization, element_centres
from echotruth.imaging.rf import FullMatrix

LINES = 16
"""Transmits synthesised at a time, to bound memory."""
TILE = 16
"""Frequencies that one thread takes at a time: two cache lines of a spectrum."""


def line_angles(rf: Rf) -> np.ndarray:
    """Angles of the lines from the axial axis, shape (lines,), rad, from the smallest lateral coordinate on."""
    sector = rf.si().sector
    return np.linspace(-sector / 2, sector / 2, rf.lines)


def transmit_delays(probe: Probe, rf: Rf) -> np.ndarray:
    """Delays that focus each line, shape (lines, elements), s.

    The wave reaches the focus at (focus distance) / (speed of sound), as if it came from the centre of the array.
    """
    focus, angle = rf.si().focus, line_angles(rf)
    lateral = focus * np.sin(angle)[:, None] - element_centres(probe)
    return (focus - np.hypot(lateral, focus * np.cos(angle)[:, None])) / probe.si().sound_speed


def transmit_weights(delay: np.ndarray, weight: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """Phases and weights of the elements in each transmit; doubled, for the analytic signal.

    Parameters
    ----------
    delay
        Shape (lines, elements), s.
    weight
        Shape (elements,), 1.
    frequency
        Shape (bins,), Hz.

    Returns
    -------
    Shape (bins, 2, elements, lines), float32: real and imaginary part of 2 weight exp(-2 pi i frequency delay).
    """
    phase = 2 * np.pi * np.multiply.outer(frequency, np.ascontiguousarray(delay.T))
    return (2 * weight[:, None] * np.stack([np.cos(phase), -np.sin(phase)], axis=1)).astype(np.float32, order="C")


@numba.njit(cache=True, fastmath={"contract"})
def add_products(real, imaginary, matrix, weights):
    """Add a matrix (elements, elements) times weights (2, elements, lines) to its real and imaginary part."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            a, b = matrix[i, j].real, matrix[i, j].imag
            for line in range(weights.shape[2]):
                real[i, line] += a * weights[0, j, line] - b * weights[1, j, line]
                imaginary[i, line] += a * weights[1, j, line] + b * weights[0, j, line]


@numba.njit(parallel=True, cache=True)
def transmit(matrix, weights, bins, spectra):
    """Channel spectra of focused transmits.

    Parameters
    ----------
    matrix
        Shape (bins, elements, elements), complex64.
    weights
        Shape (bins, 2, elements, lines), float32.
    bins
        Where the frequencies go in the spectra, shape (bins,).
    spectra
        Written at `bins`: shape (lines, elements, samples), complex64.
    """
    elements, lines = weights.shape[2:]
    for tile in numba.prange((len(bins) + TILE - 1) // TILE):
        start = tile * TILE
        count = min(TILE, len(bins) - start)
        real = np.zeros((count, elements, lines), np.float32)
        imaginary = np.zeros((count, elements, lines), np.float32)
        for k in range(count):
            add_products(real[k], imaginary[k], matrix[start + k], weights[start + k])
        for line in range(lines):
            for element in range(elements):
                for k in range(count):
                    value = np.complex64(complex(real[k, element, line], imaginary[k, element, line]))
                    spectra[line, element, bins[start + k]] = value


class FocusedTransmits:
    """Channel data of the focused lines of a sector.

    Parameters
    ----------
    probe, rf
        The array and its lines.
    depth
        Greatest range of interest, m.

    Attributes
    ----------
    matrix : FullMatrix
        The echoes between all pairs.
    frequency : float
        Frequency to which the channel data are demodulated, Hz: the bin nearest the centre frequency.
    """

    def __init__(self, probe: Probe, rf: Rf, depth: float):
        delay = transmit_delays(probe, rf)
        weight = apodization(probe, rf.apodization)
        self.matrix = FullMatrix(probe, depth, np.abs(delay).max())
        frequency = self.matrix.frequency
        nearest = int(np.argmin(np.abs(frequency - probe.si().frequency)))
        self.frequency = float(frequency[nearest])
        self._bins = (np.arange(len(frequency)) - nearest) % self.matrix.samples
        starts = range(0, rf.lines, LINES)
        self._weights = [transmit_weights(delay[start : start + LINES], weight, frequency) for start in starts]

    def __call__(self, position: np.ndarray, amplitude: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
        """Channel data of a frame, some lines at a time.

        Yields
        ------
        The lines as a slice, and their data, shape (lines, elements, samples), complex64: the analytic signal
        (positive frequencies, twice the RF) from time 0 on, demodulated by exp(-2 pi i frequency time). The data
        hold until the next are asked for.
        """
        matrix = self.matrix(position, amplitude)
        elements, start = matrix.shape[1], 0
        # Fresh memory for every block would cost more than the transform.
        memory = np.empty((LINES, elements, self.matrix.samples), np.complex64)
        for weights in self._weights:
            spectra = memory[: weights.shape[3]]
            spectra[:] = 0
            transmit(matrix, weights, self._bins, spectra)
            yield slice(start, start + len(spectra)), fft.ifft(spectra, axis=2, overwrite_x=True)
            start += len(spectra)
