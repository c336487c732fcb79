"""Receive focusing: from channel data to lines, focused at every range."""

from __future__ import annotations

import numba
import numpy as np

from echotruth.imaging.beamforming.aperture import Aperture, window
from echotruth.imaging.beamforming.interpolation import LEAD, NUMBERS, PHASE_BITS, TAPS, add_taps, table

RANGES = 64
"""Samples of a line that are summed over all elements at a time, to stay in the nearest memory."""


@numba.njit(cache=True)
def turned(half, weight):
    """Real and imaginary part of weight exp(2 i half), float32, for |half| <= pi / 2: polynomials right to 1e-6."""
    s = half * half
    sine = half * polynomial(s, (1 / 6, 1 / 120, 1 / 5040, 1 / 362880, 1 / 39916800))
    cosine = polynomial(s, (1 / 2, 1 / 24, 1 / 720, 1 / 40320, 1 / 3628800))
    twice = np.float32(2) * weight * sine
    return weight - twice * sine, twice * cosine


@numba.njit(cache=True)
def polynomial(s, terms):
    """1 - s (a - s (b - s (c - ...)))."""
    a, b, c, d, e = terms
    one = np.float32(1)
    inner = np.float32(c) - s * (np.float32(d) - s * np.float32(e))
    return one - s * (np.float32(a) - s * (np.float32(b) - s * inner))


@numba.njit(cache=True)
def echo_times(path, geometry, part, centre, channel, tapered, times):
    """Where the echoes of points to an element stand in its channel, and their weights.

    Parameters
    ----------
    path
        Of the wave to the points of a line, shape (ranges,), m.
    geometry
        Of the line, shape (4, ranges), see :func:`focus`.
    part
        First of the points and the one after the last.
    centre
        Of the element, m.
    channel
        Samples per metre of path, the number of samples at which an interpolator may begin (where it does not, the
        weight is 0), and the carrier by which the weights turn, cycles per sample.
    tapered
        Whether the aperture is.
    times
        Written from 0 on: place in the channel, 0 out of it, its sample, phase of the table, rest of the phase, and
        real and imaginary part of the weight, each of shape (RANGES,).
    """
    at, sample, phase, rest, real, imaginary = times
    rate, last, carrier = channel
    first, stop = part
    come, count = path[first:stop], stop - first
    lateral, deep, middle, inverse = (
        geometry[0][first:stop],
        geometry[1][first:stop],
        geometry[2][first:stop],
        geometry[3][first:stop],
    )
    # Loops over few arrays each, which compilers make vectors of.
    for n in range(count):
        across = lateral[n] - centre
        at[n] = (come[n] + np.sqrt(across * across + deep[n] * deep[n])) * rate
    for n in range(count):
        inside = (at[n] >= 0) & (at[n] < last)
        # Twice as far off as the aperture reaches, what is out of the record has no weight.
        real[n] = np.float32((centre - middle[n]) * inverse[n]) if inside else np.float32(1)
        at[n] = at[n] if inside else 0.0
    for n in range(count):
        cycles = (at[n] + LEAD) * carrier
        imaginary[n] = np.float32(np.pi * (cycles - np.int32(cycles + 0.5)))
    for n in range(count):
        real[n], imaginary[n] = turned(imaginary[n], window(real[n], tapered))
    for n in range(count):
        # In double precision, as a fraction of nearly 1 must not become the phase of the next sample.
        sample[n] = np.int32(at[n])
        fine = (at[n] - sample[n]) * (1 << PHASE_BITS)
        phase[n] = np.int32(fine)
        rest[n] = np.float32(fine - phase[n])


@numba.njit(cache=True)
def collect(sums, line):
    """Add the sums over taps (ranges * NUMBERS,) to a line (ranges,), complex64."""
    for n in range(len(line)):
        real, imaginary = np.float32(0), np.float32(0)
        for k in range(n * NUMBERS, (n + 1) * NUMBERS, 2):
            real += sums[k]
            imaginary += sums[k + 1]
        line[n] += np.complex64(complex(real, imaginary))


@numba.njit(parallel=True, cache=True)
def focus(lines, first, channels, which, path, geometry, array, table):
    """Add the echoes of the points of some lines to them; one thread makes a line.

    Parameters
    ----------
    lines
        Shape (lines, ranges), complex64; added to.
    first
        The first of these lines.
    channels
        Shape (transmits, elements, 2 samples), float32: real and imaginary parts in turn.
    which
        Transmit taken for each of these lines, shape (n,).
    path
        Of the wave to the points of these lines, shape (n, ranges), m.
    geometry
        Of all lines, shape (lines, 4, ranges), m: lateral and axial coordinates of the points, and middle (m)
        and 1 / width (1/m) of their apertures.
    array
        Centres of the elements (elements,), m, samples per metre of path, whether apertures are tapered, and the
        carrier, cycles per sample.
    table
        Of interpolators, as :func:`echotruth.imaging.beamforming.interpolation.table` makes it.
    """
    centres, rate, tapered, carrier = array
    elements, numbers = channels.shape[1:]
    channel = rate, numbers // 2 - TAPS, carrier
    for n in numba.prange(len(which)):
        line, flat = first + n, channels[which[n]].reshape(elements * numbers)
        sums = np.empty(RANGES * NUMBERS, np.float32)
        sample, phase = np.empty(RANGES, np.int32), np.empty(RANGES, np.int32)
        rest, real, imaginary = np.empty(RANGES, np.float32), np.empty(RANGES, np.float32), np.empty(RANGES, np.float32)
        at = np.empty(RANGES)
        for start in range(0, path.shape[1], RANGES):
            part = start, min(start + RANGES, path.shape[1])
            sums[:] = 0
            for element in range(elements):
                times = at, sample, phase, rest, real, imaginary
                echo_times(path[n], geometry[line], part, centres[element], channel, tapered, times)
                for k in range(part[1] - start):
                    place, row = element * numbers + 2 * sample[k], phase[k] * 2 * NUMBERS
                    add_taps(sums, k * NUMBERS, flat, place, table, row, (rest[k], real[k], imaginary[k]))
            collect(sums, lines[line, start : part[1]])


class ReceiveFocus:
    """Dynamic focusing on receive at points along scan lines.

    The transmitted wave reaches a point after its path, over c; the echo comes to an element after the distance
    between them, over c. The element data are delayed by both and summed with the weights of the aperture.

    Parameters
    ----------
    aperture
        Elements and their weights.
    foot, range_
        Of the lines (lines,) and of their samples (ranges,), m.
    points
        Lateral and axial coordinates, each of shape (lines, ranges), m.
    frequency, sampling
        Carrier of the channel data and their sampling frequency, Hz.
    sound_speed
        m/s.
    """

    def __init__(self, aperture: Aperture, foot, range_, points, *, frequency, sampling, sound_speed):
        middle, width = aperture.bounds(foot[:, None], range_)
        self._geometry = np.stack([*points, middle, 1 / width], axis=1)
        self._array = aperture.centres, sampling / sound_speed, aperture.tapered, frequency / sampling
        self._table = table()

    def __call__(self, lines: np.ndarray, first: int, channels: np.ndarray, which: np.ndarray, path: np.ndarray):
        """Add echoes to some lines.

        Parameters
        ----------
        lines
            Shape (lines, ranges), complex64: the analytic signal at the points; added to.
        first
            The first of the lines that are added to.
        channels
            Shape (transmits, elements, samples), complex64, of
            :class:`~echotruth.imaging.beamforming.synthesis.Synthesis`.
        which
            Transmit whose echoes each of these lines takes, shape (n,).
        path
            From time 0 to the points of these lines, shape (n, ranges), m.
        """
        focus(lines, first, channels.view(np.float32), which, path, self._geometry, self._array, self._table)
