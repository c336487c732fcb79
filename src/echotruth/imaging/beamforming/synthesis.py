"""Channel data of any transmits, synthesised from the full matrix.

A transmit is the delayed and weighted sum over single transmitters: S_i = sum_j M_ij w_j exp(-2 pi i f delay_j), at
each frequency a matrix product. The channels are prepared for interpolation: sampled little above the Nyquist rate of
their band, and with their spectrum divided by that of the interpolator.
"""

from collections.abc import Iterator
from functools import partial

import numba
import numpy as np
from scipy import fft

from echotruth.imaging.beamforming import interpolation
from echotruth.imaging.beamforming.gate import Gate, Sampling
from echotruth.imaging.beamforming.transmit import Transmits
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.product import HEIGHT, ROW_PADDING, padded, product
from echotruth.imaging.rf.record import Record
from echotruth.threads import share

BLOCK_TRANSMITS = 128
"""Transmits synthesised at a time. Memory is this * elements * samples * 8 bytes, 31 MB for the default array."""
TILE_BINS = 16
"""Frequencies that one thread takes at a time: two cache lines of a spectrum. The phases of all but the first follow by
multiplication and need not be kept."""


@numba.njit(cache=True)
def to_real_form(matrix, rows, left):
    """Write a matrix M (elements, elements), complex, as the transpose of [[Re, -Im], [Im, Re]], for :func:`product`.

    `left` has shape (2 elements, 2 rows or more); :func:`product` sums over its first axis.
    """
    elements = len(matrix)
    for j in range(elements):
        for i in range(elements):
            real, imaginary = matrix[i, j].real, matrix[i, j].imag
            left[j, i], left[j, rows + i] = real, imaginary
            left[elements + j, i], left[elements + j, rows + i] = -imaginary, real


@numba.njit(cache=True)
def rotate(weights, rotation):
    """Multiply weights by phase factors, both (2, elements, transmits): real and imaginary part."""
    for j in range(weights.shape[1]):
        for k in range(weights.shape[2]):
            a, b = weights[0, j, k], weights[1, j, k]
            weights[0, j, k] = a * rotation[0, j, k] - b * rotation[1, j, k]
            weights[1, j, k] = a * rotation[1, j, k] + b * rotation[0, j, k]


@numba.njit(nogil=True, cache=True)
def synthesise(matrix, start, rotation, factor, bins, spectra, tiles):
    """Channel spectra of transmits.

    Parameters
    ----------
    matrix
        Shape (bins, elements, elements), complex64.
    start, rotation
        See :func:`transmit_weights`.
    factor
        Factor of the spectra, shape (bins,), float32.
    bins
        Indices of the frequencies in the spectra, shape (bins,).
    spectra
        Written at `bins`: shape (transmits, elements, samples), complex64.
    tiles
        First tile of frequencies to be written, and the one after the last.
    """
    elements, transmits = matrix.shape[1], len(spectra)
    rows, columns = -(-elements // HEIGHT) * HEIGHT, rotation.shape[2]
    for tile in range(*tiles):
        first = tile * TILE_BINS
        count = min(TILE_BINS, len(bins) - first)
        result = np.empty((count, 2 * rows + 1, columns - ROW_PADDING), np.float32)
        left = np.zeros((2 * elements, 2 * rows + ROW_PADDING), np.float32)
        weights = start[tile].copy()
        for k in range(count):
            to_real_form(matrix[first + k], rows, left)
            product(left, weights.reshape(2 * elements, columns), result[k, : 2 * rows])
            rotate(weights, rotation)
        for element in range(elements):
            for transmit in range(transmits):
                for k in range(count):
                    value = complex(result[k, element, transmit], result[k, rows + element, transmit])
                    spectra[transmit, element, bins[first + k]] = np.complex64(value * factor[first + k])


def channel_sampling(matrix: Record) -> Sampling:
    """Sampling at which the echoes of a matrix can be interpolated."""
    band = matrix.first_bin + np.arange(len(matrix.frequency))
    samples = fft.next_fast_len(int(interpolation.OVERSAMPLING * len(band)) + 1)
    # The factor 2 makes the signal analytic.
    scale = 2 * samples / matrix.samples
    return Sampling(band % samples, samples, matrix.sampling * samples / matrix.samples, scale)


class TransmitSynthesis:
    """Channel data of transmits; phases are computed once for all frames.

    Parameters
    ----------
    matrix
        The echoes between all pairs.
    frequency
        Centre frequency of the pulse, Hz.
    transmits
        Delays and weights.
    time_range
        Earliest and latest echo that is needed, s; None for all of them.

    Attributes
    ----------
    frequency : float
        The frequency of the record nearest the centre frequency, Hz.
    carrier : float
        Carrier of the channels, Hz.
    gate : Gate or None
        The part of the record that is needed, where that is less than all.
    samples : int
        Number of samples of a channel.
    sampling : float
        Sampling frequency of a channel, Hz.
    start : float
        Time of the echoes at the beginning of a channel, s.
    """

    def __init__(
        self, matrix: FullMatrix, frequency: float, transmits: Transmits, time_range: tuple[float, float] | None = None
    ):
        record = channel_sampling(matrix)
        self.frequency = _nearest(matrix.frequency, frequency)[1]
        self.sampling = record.rate
        margin = interpolation.TAPS / record.rate
        needed = time_range and (time_range[0] - margin, time_range[1] + margin)
        gate = needed and Gate(record, matrix.frequency[[0, -1]], needed)
        self.gate = gate if gate and gate.samples < record.samples else None
        part, scale = (self.gate, 1.0) if self.gate else (record, record.scale)
        frequencies = self.gate.frequency if self.gate else matrix.frequency
        self.samples, self.start = part.samples, self.gate.first / record.rate if self.gate else 0.0
        carrier_bin, self.carrier = _nearest(frequencies, frequency)
        # Channels are below their carrier, which need not be a frequency of the record.
        self._bins = (np.arange(len(frequencies)) - carrier_bin) % self.samples
        cycles = (frequencies - self.carrier) / self.sampling
        self._factor = (scale / interpolation.interpolator_spectrum(cycles)).astype(np.float32)
        # Channels begin so much earlier that all taps of the first echo are within them.
        delay = transmits.delay + interpolation.LEAD_TAPS / self.sampling
        step = frequencies[1] - frequencies[0]
        starts = range(0, len(delay), BLOCK_TRANSMITS)
        self._blocks = [slice(start, min(start + BLOCK_TRANSMITS, len(delay))) for start in starts]
        self._weights = [
            transmit_weights(delay[block].T, transmits.weight[block].T, frequencies[::TILE_BINS], step)
            for block in self._blocks
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
        :class:`~echotruth.imaging.beamforming.receive.ReceiveFocus` takes. The next data overwrite them.
        """
        # Fresh memory for every block would cost more than the transform.
        memory = np.empty((self._blocks[0].stop, matrix.shape[1], self.samples), np.complex64)
        for block, (start, rotation) in zip(self._blocks, self._weights, strict=True):
            spectra = memory[: block.stop - block.start]
            spectra[:] = 0
            share(partial(synthesise, matrix, start, rotation, self._factor, self._bins, spectra), len(start))
            yield block, fft.ifft(spectra, axis=2, overwrite_x=True, workers=numba.get_num_threads())


def _nearest(frequencies: np.ndarray, frequency: float) -> tuple[int, float]:
    """Index of the nearest of some frequencies, and that frequency."""
    index = int(np.abs(frequencies - frequency).argmin())
    return index, float(frequencies[index])


def transmit_weights(
    delay: np.ndarray, weight: np.ndarray, frequency: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Complex weights of the elements, weight exp(-2 pi i frequency delay), and their rotation exp(-2 pi i step delay).

    Parameters
    ----------
    delay, weight
        Shape (elements, transmits), s and 1.
    frequency
        First frequency of each tile, shape (tiles,), Hz.
    step
        From one frequency to the next, Hz.

    Returns
    -------
    Shapes (tiles, 2, elements, columns) and (2, elements, columns), float32: real and imaginary parts. The columns are
    the transmits, filled up with columns of weight 0, and ROW_PADDING.
    """
    more = padded(delay.shape[1]) + ROW_PADDING - delay.shape[1]
    delay, weight = (np.pad(values, ((0, 0), (0, more))) for values in (delay, weight))
    phase = -2 * np.pi * np.multiply.outer(frequency, delay)
    phase_step = -2 * np.pi * step * delay
    weights = weight * np.stack([np.cos(phase), np.sin(phase)], axis=1)
    return weights.astype(np.float32), np.stack([np.cos(phase_step), np.sin(phase_step)]).astype(np.float32)
