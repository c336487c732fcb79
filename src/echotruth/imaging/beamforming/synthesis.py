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

from echotruth.imaging.beamforming import interpolation
from echotruth.imaging.beamforming.gate import Gate, Sampling
from echotruth.imaging.beamforming.transmit import Transmits
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.product import HEIGHT, padded, product

BLOCK = 128
"""Transmits synthesised at a time. Memory is BLOCK * elements * samples * 8 bytes, 31 MB for the default array."""
APART = 16
"""Numbers by which rows of matrices are longer than needed, or what is read together would share a few lines of the
cache."""
TILE = 16
"""Frequencies that one thread takes at a time: two cache lines of a spectrum. Their phases follow one another by
multiplication, so that those of the first alone are kept."""


@numba.njit(cache=True)
def arrange(matrix, rows, left):
    """Write a matrix (elements, elements), complex, as real ones: for :func:`product`, which sums over the first axis.

    Its transpose and that times i, real parts before imaginary ones on both axes, (2 elements, 2 rows or more).
    """
    elements = len(matrix)
    for j in range(elements):
        for i in range(elements):
            real, imaginary = matrix[i, j].real, matrix[i, j].imag
            left[j, i], left[j, rows + i] = real, imaginary
            left[elements + j, i], left[elements + j, rows + i] = -imaginary, real


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
        (tiles, 2, elements, columns) and (2, elements, columns), float32: real and imaginary parts. The
        columns are those of the transmits, filled up, and APART.
    factor
        Of the spectra, shape (bins,), float32.
    bins
        Where the frequencies go in the spectra, shape (bins,).
    spectra
        Written at `bins`: shape (transmits, elements, samples), complex64.
    """
    elements, transmits = matrix.shape[1], len(spectra)
    rows, columns = -(-elements // HEIGHT) * HEIGHT, turn.shape[2]
    for tile in numba.prange(len(start)):
        first = tile * TILE
        count = min(TILE, len(bins) - first)
        found = np.empty((count, 2 * rows + 1, columns - APART), np.float32)
        left = np.zeros((2 * elements, 2 * rows + APART), np.float32)
        weights = start[tile].copy()
        for k in range(count):
            arrange(matrix[first + k], rows, left)
            product(left, weights.reshape(2 * elements, columns), found[k, : 2 * rows])
            turn_on(weights, turn)
        for element in range(elements):
            for transmit in range(transmits):
                for k in range(count):
                    value = complex(found[k, element, transmit], found[k, rows + element, transmit])
                    spectra[transmit, element, bins[first + k]] = np.complex64(value * factor[first + k])


def sampled(matrix: FullMatrix) -> Sampling:
    """Samples of the echoes of a matrix that can be interpolated."""
    place = matrix.first + np.arange(len(matrix.frequency))
    samples = fft.next_fast_len(int(interpolation.OVERSAMPLING * len(place)) + 1)
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
    carrier : float
        Frequency below which the channels are, Hz.
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
        record = sampled(matrix)
        self.frequency = _nearest(matrix.frequency, frequency)[1]
        self.sampling = record.rate
        gate = span and Gate(record, matrix.frequency[[0, -1]], _interpolated(span, record.rate))
        self.gate = gate if gate and gate.samples < record.samples else None
        part, scale = (self.gate, 1.0) if self.gate else (record, record.scale)
        frequencies = self.gate.frequency if self.gate else matrix.frequency
        self.samples, self.start = part.samples, self.gate.first / record.rate if self.gate else 0.0
        number, self.carrier = _nearest(frequencies, frequency)
        # Channels are below their carrier, which need not be one of the record.
        self._bins = (np.arange(len(frequencies)) - number) % self.samples
        cycles = (frequencies - self.carrier) / self.sampling
        self._factor = (scale / interpolation.spectrum(cycles)).astype(np.float32)
        # Channels begin so much earlier that what the first echo is interpolated from is within them.
        delay = transmits.delay + interpolation.LEAD / self.sampling
        step = frequencies[1] - frequencies[0]
        self._blocks = [slice(at, min(at + BLOCK, len(delay))) for at in range(0, len(delay), BLOCK)]
        self._phases = [
            phases(delay[block].T, transmits.weight[block].T, frequencies[::TILE], step) for block in self._blocks
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
        :class:`~echotruth.imaging.beamforming.receive.ReceiveFocus` takes. The data hold until the next are asked for.
        """
        # Fresh memory for every block would cost more than the transform.
        memory = np.empty((self._blocks[0].stop, matrix.shape[1], self.samples), np.complex64)
        for block, (start, turn) in zip(self._blocks, self._phases, strict=True):
            spectra = memory[: block.stop - block.start]
            spectra[:] = 0
            synthesise(matrix, start, turn, self._factor, self._bins, spectra)
            yield block, fft.ifft(spectra, axis=2, overwrite_x=True, workers=numba.get_num_threads())


def _nearest(frequencies: np.ndarray, frequency: float) -> tuple[int, float]:
    """Number of the nearest of some frequencies, and that frequency."""
    number = int(np.abs(frequencies - frequency).argmin())
    return number, float(frequencies[number])


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
    Shapes (tiles, 2, elements, columns) and (2, elements, columns), float32: real and imaginary parts, filled up with
    columns of weight 0.
    """
    more = padded(delay.shape[1]) + APART - delay.shape[1]
    delay, weight = (np.pad(each, ((0, 0), (0, more))) for each in (delay, weight))
    start = -2 * np.pi * np.multiply.outer(frequency, delay)
    turn = -2 * np.pi * step * delay
    weights = weight * np.stack([np.cos(start), np.sin(start)], axis=1)
    return weights.astype(np.float32), np.stack([np.cos(turn), np.sin(turn)]).astype(np.float32)
