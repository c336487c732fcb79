"""Receive focusing: from channel data to lines, focused at every range."""

from functools import partial

import numba
import numpy as np

from echotruth.imaging.beamforming.aperture import Aperture, apodization_weight
from echotruth.imaging.beamforming.interpolation import LEAD_TAPS, PHASE_BITS, TAP_FLOATS, add_taps, interpolator_table
from echotruth.imaging.rf.kernel import TAPS
from echotruth.threads import share

BLOCK_RANGES = 64
"""Samples of a line that are summed over all elements at a time, to stay in the first-level cache."""


@numba.njit(cache=True)
def phasor(half_angle, weight):
    """Real and imaginary part of weight exp(2 i half_angle), float32, for |half_angle| <= pi / 2; accurate to 1e-6.

    cos(2a) = 1 - 2 sin(a)^2, sin(2a) = 2 sin(a) cos(a), with Taylor polynomials of sin(a) and cos(a).
    """
    s = half_angle * half_angle
    sine = half_angle * polynomial(s, (1 / 6, 1 / 120, 1 / 5040, 1 / 362880, 1 / 39916800))
    cosine = polynomial(s, (1 / 2, 1 / 24, 1 / 720, 1 / 40320, 1 / 3628800))
    twice = np.float32(2) * weight * sine
    return weight - twice * sine, twice * cosine


@numba.njit(cache=True)
def polynomial(s, coefficients):
    """1 - a s + b s^2 - c s^3 + d s^4 - e s^5."""
    a, b, c, d, e = coefficients
    one = np.float32(1)
    inner = np.float32(c) - s * (np.float32(d) - s * np.float32(e))
    return one - s * (np.float32(a) - s * (np.float32(b) - s * inner))


@numba.njit(cache=True)
def echo_times(path, geometry, block, centre, channel, tapered, times):
    """Echo times (path + distance from point to element) / c, and weights apodization * exp(2 pi i carrier time).

    Parameters
    ----------
    path
        Transmit path to the points of a line, shape (ranges,), m.
    geometry
        Of the line, shape (4, ranges), see :func:`focus`.
    block
        First of the points and the one after the last.
    centre
        Lateral coordinate of the element, m.
    channel
        Samples per metre of path, samples at which an interpolator may begin (elsewhere the weight is 0), and carrier,
        cycles per sample.
    tapered
        Whether the apodization is tapered.
    times
        Written from 0 on: time in samples, 0 outside the channel; its sample, phase in the table, fraction of a phase,
        and real and imaginary part of the weight, each of shape (BLOCK_RANGES,).
    """
    time, sample, phase, fraction, real, imaginary = times
    rate, last, carrier = channel
    first, stop = block
    transmit_path, count = path[first:stop], stop - first
    lateral, axial = geometry[0][first:stop], geometry[1][first:stop]
    middle, inverse_width = geometry[2][first:stop], geometry[3][first:stop]
    # Loops over few arrays each, which compilers vectorise.
    for n in range(count):
        offset = lateral[n] - centre
        time[n] = (transmit_path[n] + np.sqrt(offset * offset + axial[n] * axial[n])) * rate
    for n in range(count):
        inside = (time[n] >= 0) & (time[n] < last)
        # An offset of one width is outside the aperture, so that echoes outside the record have no weight.
        real[n] = np.float32((centre - middle[n]) * inverse_width[n]) if inside else np.float32(1)
        time[n] = time[n] if inside else 0.0
    for n in range(count):
        cycles = (time[n] + LEAD_TAPS) * carrier
        imaginary[n] = np.float32(np.pi * (cycles - np.int32(cycles + 0.5)))
    for n in range(count):
        real[n], imaginary[n] = phasor(imaginary[n], apodization_weight(real[n], tapered))
    for n in range(count):
        # In double precision, as a fraction of nearly 1 must not become the phase of the next sample.
        sample[n] = np.int32(time[n])
        phases = (time[n] - sample[n]) * (1 << PHASE_BITS)
        phase[n] = np.int32(phases)
        fraction[n] = np.float32(phases - phase[n])


@numba.njit(cache=True)
def add_tap_sums(sums, line):
    """Add the sums over the taps of each sample, (ranges * TAP_FLOATS,), to a line (ranges,), complex64."""
    for n in range(len(line)):
        real, imaginary = np.float32(0), np.float32(0)
        for k in range(n * TAP_FLOATS, (n + 1) * TAP_FLOATS, 2):
            real += sums[k]
            imaginary += sums[k + 1]
        line[n] += np.complex64(complex(real, imaginary))


@numba.njit(nogil=True, cache=True)
def focus(lines, first, channels, waves, geometry, array, table, part):
    """Add the delayed, weighted echoes of all elements to some lines.

    Parameters
    ----------
    lines
        Shape (lines, ranges), complex64; added to.
    first
        The first of these lines.
    channels
        Shape (transmits, elements, 2 samples), float32: real and imaginary parts in turn.
    waves
        Transmit of each of these lines, shape (n,), and transmit path to their points, shape (n, ranges), m.
    geometry
        Of all lines, shape (lines, 4, ranges): lateral and axial coordinates of the points (m), centre (m) and
        1 / width (1/m) of their apertures.
    array
        Centres of the elements (elements,), m, samples per metre of path, whether apertures are tapered, and the
        carrier, cycles per sample.
    table
        See :func:`echotruth.imaging.beamforming.interpolation.interpolator_table`.
    part
        First of these lines to be added to, and the one after the last.
    """
    (transmit, path), (centres, rate, tapered, carrier) = waves, array
    elements, floats = channels.shape[1:]
    channel = rate, floats // 2 - TAPS, carrier
    for n in range(*part):
        line, flat = first + n, channels[transmit[n]].reshape(elements * floats)
        sums = np.empty(BLOCK_RANGES * TAP_FLOATS, np.float32)
        sample, phase = np.empty(BLOCK_RANGES, np.int32), np.empty(BLOCK_RANGES, np.int32)
        fraction = np.empty(BLOCK_RANGES, np.float32)
        real, imaginary = np.empty(BLOCK_RANGES, np.float32), np.empty(BLOCK_RANGES, np.float32)
        time = np.empty(BLOCK_RANGES)
        for start in range(0, path.shape[1], BLOCK_RANGES):
            block = start, min(start + BLOCK_RANGES, path.shape[1])
            sums.fill(0)
            for element in range(elements):
                times = time, sample, phase, fraction, real, imaginary
                echo_times(path[n], geometry[line], block, centres[element], channel, tapered, times)
                for k in range(block[1] - start):
                    source, row = element * floats + 2 * sample[k], phase[k] * 2 * TAP_FLOATS
                    add_taps(sums, k * TAP_FLOATS, flat, source, table, row, (fraction[k], real[k], imaginary[k]))
            add_tap_sums(sums, lines[line, start : block[1]])


class ReceiveFocus:
    """Dynamic receive focusing: the sum of the channels at the :func:`echo_times`, weighted by the aperture.

    Parameters
    ----------
    aperture
        Elements and their weights.
    line_origin, range_
        Origins of the lines (lines,) and ranges of their samples (ranges,), m.
    points
        Lateral and axial coordinates, each of shape (lines, ranges), m.
    frequency, sampling
        Carrier of the channel data and their sampling frequency, Hz.
    sound_speed
        m/s.
    """

    def __init__(self, aperture: Aperture, line_origin, range_, points, *, frequency, sampling, sound_speed):
        centre, width = aperture.centre_and_width(line_origin[:, None], range_)
        self._geometry = np.stack([*points, centre, 1 / width], axis=1)
        self._array = aperture.centres, sampling / sound_speed, aperture.tapered, frequency / sampling
        self._table = interpolator_table()

    def __call__(self, lines: np.ndarray, first: int, channels: np.ndarray, transmit: np.ndarray, path: np.ndarray):
        """Add echoes to some lines.

        Parameters
        ----------
        lines
            Shape (lines, ranges), complex64: the analytic signal at the points; added to.
        first
            The first of the lines that are added to.
        channels
            Shape (transmits, elements, samples), complex64, of
            :class:`~echotruth.imaging.beamforming.synthesis.TransmitSynthesis`.
        transmit
            Transmit of each of these lines, shape (n,).
        path
            Transmit path to the points of these lines, shape (n, ranges), m.
        """
        fixed = self._geometry, self._array, self._table
        share(partial(focus, lines, first, channels.view(np.float32), (transmit, path), *fixed), len(transmit))
