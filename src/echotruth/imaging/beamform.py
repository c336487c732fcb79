"""Receive focusing: from channel data to lines, focused at every range."""

from __future__ import annotations

import numba
import numpy as np

from echotruth.imaging.aperture import Aperture, window
from echotruth.imaging.interpolation import LANES, PHASE_BITS, TAPS, add_taps, table

RANGES = 64
"""Samples of a line that are summed over all elements at a time, to stay in the nearest memory."""


@numba.njit(cache=True)
def echo_times(path, geometry, part, centre, rate, last, tapered, times):
    """Where the echoes of points to an element stand in its channel.

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
    rate
        Samples per metre of path.
    last
        Number of samples at which an interpolator may begin; where it does not, the weight is 0.
    tapered
        Whether the aperture is.
    times
        Written from 0 on: sample, phase of the table, rest of the phase and weight, each of shape (RANGES,).
    """
    sample, phase, rest, weight = times
    first, stop = part
    for n in range(stop - first):
        across, axial = geometry[0, first + n] - centre, geometry[1, first + n]
        at = (path[first + n] + np.sqrt(across * across + axial * axial)) * rate
        inside = (at >= 0) & (at < last)
        at = at if inside else 0.0
        whole = np.int32(at)
        # In double precision, as a fraction of nearly 1 must not become the phase of the next sample.
        fine = (at - whole) * (1 << PHASE_BITS)
        sample[n], phase[n] = whole, np.int32(fine)
        rest[n] = np.float32(fine - np.int32(fine))
        share = window(np.float32((centre - geometry[2, first + n]) * geometry[3, first + n]), tapered)
        weight[n] = share if inside else np.float32(0)


@numba.njit(cache=True)
def collect(sums, line):
    """Add the sums over taps (ranges * LANES,) to a line (ranges,), complex64."""
    half = LANES // 2
    for n in range(len(line)):
        real, imaginary, first = np.float32(0), np.float32(0), n * LANES
        for k in range(first, first + half, 2):
            real += sums[k] - sums[k + half + 1]
            imaginary += sums[k + 1] + sums[k + half]
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
        Centres of the elements (elements,), m, samples per metre of path, and whether apertures are
        tapered.
    table
        Of interpolators, as :func:`echotruth.imaging.interpolation.table` makes it.
    """
    centres, rate, tapered = array
    elements, numbers = channels.shape[1:]
    last = numbers // 2 - TAPS
    for n in numba.prange(len(which)):
        line, flat = first + n, channels[which[n]].reshape(elements * numbers)
        sums = np.empty(RANGES * LANES, np.float32)
        sample, phase = np.empty(RANGES, np.int32), np.empty(RANGES, np.int32)
        rest, weight = np.empty(RANGES, np.float32), np.empty(RANGES, np.float32)
        for start in range(0, path.shape[1], RANGES):
            part = start, min(start + RANGES, path.shape[1])
            sums[:] = 0
            for element in range(elements):
                times = sample, phase, rest, weight
                echo_times(path[n], geometry[line], part, centres[element], rate, last, tapered, times)
                for k in range(part[1] - start):
                    at, row = element * numbers + 2 * sample[k], phase[k] * 2 * LANES
                    add_taps(sums, k * LANES, flat, at, table, row, (rest[k], weight[k]))
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
        self._array = aperture.centres, sampling / sound_speed, aperture.tapered
        self._table = table(frequency / sampling)

    def __call__(self, lines: np.ndarray, first: int, channels: np.ndarray, which: np.ndarray, path: np.ndarray):
        """Add echoes to some lines.

        Parameters
        ----------
        lines
            Shape (lines, ranges), complex64: the analytic signal at the points; added to.
        first
            The first of the lines that are added to.
        channels
            Shape (transmits, elements, samples), complex64, of :class:`~echotruth.imaging.synthesis.Synthesis`.
        which
            Transmit whose echoes each of these lines takes, shape (n,).
        path
            From time 0 to the points of these lines, shape (n, ranges), m.
        """
        focus(lines, first, channels.view(np.float32), which, path, self._geometry, self._array, self._table)
