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
from echotruth.imaging.rf import FullMatrix
from echotruth.imaging.transmit import Transmits

BLOCK = 64
"""Transmits synthesised at a time. Memory is BLOCK * elements * samples * 8 bytes, 27 MB for the default array."""
TILE = 16
"""Frequencies that one thread takes at a time: two cache lines of a spectrum. Their phases follow one another by
multiplication, so that those of the first alone are kept."""


@numba.njit(cache=True)
def add_products(real, imaginary, matrix, weights):
    """Add a matrix (elements, elements) times weights (2, elements, transmits) to its real and imaginary part."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            a, b = matrix[i, j].real, matrix[i, j].imag
            for k in range(weights.shape[2]):
                real[i, k] += a * weights[0, j, k] - b * weights[1, j, k]
                imaginary[i, k] += a * weights[1, j, k] + b * weights[0, j, k]


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

    Attributes
    ----------
    frequency : float
        The frequency of the record nearest the centre frequency, Hz.
    samples : int
        Of a channel.
    sampling : float
        Of a channel, Hz.
    """

    def __init__(self, matrix: FullMatrix, frequency: float, transmits: Transmits):
        place = matrix.first + np.arange(len(matrix.frequency))
        nearest = int(np.abs(matrix.frequency - frequency).argmin())
        self.frequency = float(matrix.frequency[nearest])
        # Without a sample a period of the carrier, its phase would turn too fast between those of the table.
        self.samples = fft.next_fast_len(int(max(interpolation.OVERSAMPLING * len(place), place[nearest])) + 1)
        self.sampling = matrix.sampling * self.samples / matrix.samples
        self._bins = place % self.samples
        cycles = (place - place[nearest]) / self.samples
        # Twice for the analytic signal.
        scale = 2 * self.samples / matrix.samples
        self._factor = (scale / interpolation.spectrum(cycles)).astype(np.float32)
        # Channels begin so much before time 0 that what an echo at time 0 is interpolated from is within them.
        delay = transmits.delay + interpolation.LEAD / self.sampling
        step = matrix.sampling / matrix.samples
        blocks = [slice(at, at + BLOCK) for at in range(0, len(delay), BLOCK)]
        self._phases = [
            phases(delay[block].T, transmits.weight[block].T, matrix.frequency[::TILE], step) for block in blocks
        ]

    def __call__(self, matrix: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
        """Channel data of a frame, some transmits at a time.

        Parameters
        ----------
        matrix
            Shape (bins, elements, elements), complex64: column j holds the echoes to element j sending alone.

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
