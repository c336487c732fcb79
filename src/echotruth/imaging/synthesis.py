"""Channel data of any transmits, made from the full matrix.

A transmit is the sum of the single ones, delayed and weighted; at each frequency that is a matrix product. The
channels are made ready for interpolation: sampled little more often than the band asks for, and with what the
interpolation will do to their spectrum divided out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np
from scipy import fft

from echotruth.imaging import interpolation
from echotruth.imaging.gate import Gate, Sampling
from echotruth.imaging.mould import fused
from echotruth.imaging.rf import FullMatrix
from echotruth.imaging.transmit import Transmits

BLOCK = 64
"""Transmits synthesised at a time. Memory is BLOCK * elements * samples * 8 bytes, 27 MB for the default array."""
TILE = 16
"""Frequencies that one thread takes at a time: two cache lines of a spectrum. Their phases follow one another by
multiplication, so that those of the first alone are kept."""


@numba.njit(cache=True)
def add_products(real, imaginary, matrix, weights):
    """Add a matrix (elements, elements) times weights (2, elements, transmits) to its real and imaginary part.

    Four elements at a time, so that the sums are seldom stored.
    """
    elements, transmits = weights.shape[1:]
    whole = elements // 4 * 4
    for i in range(matrix.shape[0]):
        for j in range(0, whole, 4):
            a, b = matrix[i, j].real, matrix[i, j].imag
            c, d = matrix[i, j + 1].real, matrix[i, j + 1].imag
            e, f = matrix[i, j + 2].real, matrix[i, j + 2].imag
            g, h = matrix[i, j + 3].real, matrix[i, j + 3].imag
            for k in range(transmits):
                p, q, r, s = weights[0, j, k], weights[0, j + 1, k], weights[0, j + 2, k], weights[0, j + 3, k]
                t, u, v, w = weights[1, j, k], weights[1, j + 1, k], weights[1, j + 2, k], weights[1, j + 3, k]
                one = fused(a, p, fused(c, q, fused(e, r, fused(g, s, real[i, k]))))
                real[i, k] = fused(-b, t, fused(-d, u, fused(-f, v, fused(-h, w, one))))
                one = fused(a, t, fused(c, u, fused(e, v, fused(g, w, imaginary[i, k]))))
                imaginary[i, k] = fused(b, p, fused(d, q, fused(f, r, fused(h, s, one))))
        for j in range(whole, elements):
            a, b = matrix[i, j].real, matrix[i, j].imag
            for k in range(transmits):
                p, t = weights[0, j, k], weights[1, j, k]
                real[i, k] = fused(a, p, fused(-b, t, real[i, k]))
                imaginary[i, k] = fused(a, t, fused(b, p, imaginary[i, k]))


@numba.njit(cache=True)
def turn_on(weights, turn):
    """Multiply weights by phase factors, both (2, elements, transmits): real and imaginary part."""
    for j in range(weights.shape[1]):
        for k in range(weights.shape[2]):
            a, b = weights[0, j, k], weights[1, j, k]
            weights[0, j, k] = a * turn[0, j, k] - b * turn[1, j, k]
            weights[1, j, k] = a * turn[1, j, k] + b * turn[0, j, k]


@numba.njit(parallel=True, cache=True)
def synthesise(matrix, start, turn, factor, bins, spectra):
    """Channel spectra of transmits.

    Parameters
    ----------
    matrix
        Shape (bins, elements, elements), complex64.
    start, turn
        Weights at the first frequency of each tile and what turns them into those at the next frequency, shapes
        (tiles, 2, elements, transmits) and (2, elements, transmits), float32: real and imaginary parts.
    factor
        Of the spectra, shape (bins,), float32.
    bins
        Where the frequencies go in the spectra, shape (bins,).
    spectra
        Written at `bins`: shape (transmits, elements, samples), complex64.
    """
    elements, transmits = turn.shape[1:]
    for tile in numba.prange(len(start)):
        first = tile * TILE
        count = min(TILE, len(bins) - first)
        real = np.zeros((count, elements, transmits), np.float32)
        imaginary = np.zeros((count, elements, transmits), np.float32)
        weights = start[tile].copy()
        for k in range(count):
            add_products(real[k], imaginary[k], matrix[first + k], weights)
            turn_on(weights, turn)
        for transmit in range(transmits):
            for element in range(elements):
                for k in range(count):
                    value = complex(real[k, element, transmit], imaginary[k, element, transmit])
                    spectra[transmit, element, bins[first + k]] = np.complex64(value * factor[first + k])


def sampled(matrix: FullMatrix, frequency: float) -> Sampling:
    """Samples of the echoes of a matrix that can be interpolated, the carrier being at `frequency`, Hz."""
    place = matrix.first + np.arange(len(matrix.frequency))
    nearest = int(np.abs(matrix.frequency - frequency).argmin())
    # Without a sample a period of the carrier, its phase would turn too fast between those of the table.
    samples = fft.next_fast_len(int(max(interpolation.OVERSAMPLING * len(place), place[nearest])) + 1)
    # Twice for the analytic signal.
    scale = 2 * samples / matrix.samples
    return Sampling(place % samples, samples, matrix.sampling * samples / matrix.samples, scale)


class Synthesis:
    """Channel data of transmits, phases worked out once for all frames.

    Parameters
    ----------
    matrix
        The echoes between all pairs.
    frequency
        Centre frequency of the pulse, Hz.
    transmits
        Delays and weights.
    span
        Earliest and latest echo that is needed, s; None for all of them.

    Attributes
    ----------
    frequency : float
        The frequency of the record nearest the centre frequency, Hz.
    gate : Gate or None
        The part of the record that is needed, where that is less than all.
    samples : int
        Of a channel.
    sampling : float
        Of a channel, Hz.
    start : float
        Time of the echoes at the beginning of a channel, s.
    """

    def __init__(
        self, matrix: FullMatrix, frequency: float, transmits: Transmits, span: tuple[float, float] | None = None
    ):
        record = sampled(matrix, frequency)
        self.frequency = float(matrix.frequency[np.abs(matrix.frequency - frequency).argmin()])
        self.sampling = record.rate
        gate = span and Gate(record, matrix.frequency[[0, -1]], _interpolated(span, record.rate))
        self.gate = gate if gate and gate.samples < record.samples else None
        part, scale = (self.gate, 1.0) if self.gate else (record, record.scale)
        frequencies = self.gate.frequency if self.gate else matrix.frequency
        self.samples, self._bins = part.samples, part.bins
        self.start = self.gate.first / record.rate if self.gate else 0.0
        cycles = (frequencies - self.frequency) / self.sampling
        self._factor = (scale / interpolation.spectrum(cycles)).astype(np.float32)
        # Channels begin so much earlier that what the first echo is interpolated from is within them.
        delay = transmits.delay + interpolation.LEAD / self.sampling
        step = frequencies[1] - frequencies[0]
        blocks = [slice(at, at + BLOCK) for at in range(0, len(delay), BLOCK)]
        self._phases = [
            phases(delay[block].T, transmits.weight[block].T, frequencies[::TILE], step) for block in blocks
        ]

    def __call__(self, matrix: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
        """Channel data of a frame, some transmits at a time.

        Parameters
        ----------
        matrix
            Shape (bins, elements, elements), complex64, of the whole record or of the gate: column j holds the echoes
            to element j sending alone.

        Yields
        ------
        The transmits as a slice, and their data, shape (transmits, elements, samples), complex64: what
        :class:`~echotruth.imaging.beamform.ReceiveFocus` takes. The data hold until the next are asked for.
        """
        elements, first = matrix.shape[1], 0
        # Fresh memory for every block would cost more than the transform.
        memory = np.empty((min(BLOCK, self._phases[0][1].shape[2]), elements, self.samples), np.complex64)
        for start, turn in self._phases:
            spectra = memory[: turn.shape[2]]
            spectra[:] = 0
            synthesise(matrix, start, turn, self._factor, self._bins, spectra)
            channels = fft.ifft(spectra, axis=2, overwrite_x=True, workers=numba.get_num_threads())
            yield slice(first, first + len(spectra)), channels
            first += len(spectra)


def _interpolated(span: tuple[float, float], rate: float) -> tuple[float, float]:
    """A span of time and what the samples in it are interpolated from, s."""
    return span[0] - interpolation.TAPS / rate, span[1] + interpolation.TAPS / rate


def phases(delay: np.ndarray, weight: np.ndarray, frequency: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the elements in each transmit, weight exp(-2 pi i frequency delay), and their turn over `step`.

    Parameters
    ----------
    delay, weight
        Shape (elements, transmits), s and 1.
    frequency
        Shape (tiles,), Hz.
    step
        Hz.

    Returns
    -------
    Shapes (tiles, 2, elements, transmits) and (2, elements, transmits), float32: real and imaginary parts.
    """
    start = -2 * np.pi * np.multiply.outer(frequency, delay)
    turn = -2 * np.pi * step * delay
    weights = weight * np.stack([np.cos(start), np.sin(start)], axis=1)
    return weights.astype(np.float32), np.stack([np.cos(turn), np.sin(turn)]).astype(np.float32)
