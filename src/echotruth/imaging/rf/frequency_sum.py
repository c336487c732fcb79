"""Echoes summed frequency by frequency, for scatterers whose echoes cannot be spread.

Near the array, or far beside its plane, the response of the lens differs more from element to element than a kernel
with corrections of first order allows, or is longer than a kernel. Echoes of such scatterers are summed as the formula
of :mod:`~echotruth.imaging.rf.full_matrix` stands. Those of neighbours in range arrive within a short time, so that few
frequencies determine all others.

The Fresnel integral of the lens is, with a and b proportional to frequency, half the integral of exp(-i (a t^2 - b t))
over t from -1 to 1. It is the sum of three waves: one from the edge of the element at each end, and, if it is inside,
one from the point t0 = b / 2a where the phase stands still. Apart from the delay of its path, and from the root of the
frequency, by which it falls, each changes so little with frequency that its values at a few determine all. A harmonic
is sent as the square of the sum of these waves at half of the frequency.
"""

from __future__ import annotations

from functools import partial
from math import ceil, factorial, floor
from typing import Any

import numba
import numpy as np
from numpy.polynomial.legendre import leggauss, legvander
from numpy.typing import NDArray
from scipy import fft
from scipy.special import wofz

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.rf.directivity import STEPS, sinc
from echotruth.imaging.rf.probe import pulse_band, spectral_width
from echotruth.imaging.rf.product import HEIGHT, ROW_PADDING, padded, product
from echotruth.threads import share
from echotruth.units import MHz, dB_per_cm_MHz, mm, um

GATE, LEAST, MOST, MARGIN = 48, 64, 1024, 4.5
"""Samples of two-way time, or half of those in which the first echoes arrive if that is more, in which scatterers lie
whose echoes are transformed together, if they are not too few or too many; and time before the first and after the last
echo, in standard deviations of the pulse in time."""
BLOCK, GROUP = 32, 16
"""Scatterers whose waves are in the cache at a time; frequencies from each of which phases are turned to the next, and
for every group computed anew."""
MAX_NODES, NODE_TOLERANCE, WAVES = 6, 7e-4, 3
"""Most frequencies at which the waves of an element are computed; fewer, n, are enough where (log(high / low) / 4)^n,
which the error of the polynomial through them follows, is below the tolerance; and the number of waves."""
SKIRT = 0.5
"""Standard deviations of the pulse's spectrum that are summed on either side of the band: cut off at its end, an echo
would be long, and few frequencies would not determine all."""
EDGE_STEPS = 2048
"""Steps of the table of :func:`edge_wave`; the error of linear interpolation is 1e-7."""
LOWEST = 0.005
"""Least frequency of the waves over the highest of the band; those of lower frequencies are nearly the same."""
LEAST_CURVATURE = 1e-3
"""Least phase a at the centre frequency, rad; the waves of the edges would be infinite at 0, and their sum is not."""

PAIRS = 64
"""Traces transformed at a time."""

SINE = tuple(np.float32((-1) ** n / factorial(2 * n + 1)) for n in range(6))
COSINE = tuple(np.float32((-1) ** n / factorial(2 * n)) for n in range(7))
"""Coefficients of the Taylor polynomials of the sine, without its factor, and of the cosine."""

Scatterers = tuple[Floats, Floats, Floats, Floats]
"""Positions (n, 3), m; amplitudes at the centre frequency and exponents (n,); and what passes to elements, (n, few)."""


class FrequencySum:
    """Echoes between elements of a probe under its lens, summed frequency by frequency.

    Parameters
    ----------
    probe : Probe
    sampling : float, Hz
    samples : int
        Length of the record.
    harmonic : bool
        Whether the wave is sent at half of the frequency, and its square received.
    """

    def __init__(self, probe: Probe, sampling: float, samples: int, harmonic: bool = False) -> None:
        self._ways = 2 if harmonic else 1
        self._sampling, self._samples = sampling, samples
        self._centre, self._pulse_width = probe.frequency_MHz * MHz, spectral_width(probe)
        (low, high), skirt, speed = pulse_band(probe), SKIRT * self._pulse_width, probe.sound_speed_m_per_s
        self._band = max(low - skirt, 0.0), high + skirt
        self._waves = low, high = max(low - skirt, LOWEST * high), high + skirt
        nodes = min(ceil(np.log(NODE_TOLERANCE) / np.log(min(np.log(high / low) / 4, 0.5))), MAX_NODES)
        node = leggauss(nodes)[0]
        self._polynomials = np.linalg.inv(legvander(node, nodes - 1))
        frequency = np.sqrt(low * high) * (high / low) ** (node / 2)
        squares = np.minimum(np.arange(STEPS + 2) / STEPS, 1)
        width = np.pi * (probe.width_um * um) * frequency / speed
        self._tables = edge_wave(EDGE_STEPS), sinc(np.multiply.outer(squares, width**2)).astype(np.float32)
        least = LEAST_CURVATURE / (2 * np.pi * self._centre)
        self._lens = probe.height_mm * mm, probe.elevation_focus_mm * mm, least
        self._medium = frequency, speed, probe.attenuation_dB_per_cm_MHz * dB_per_cm_MHz

    def add(
        self, spectra: NDArray[np.complex64], first_bin: int, array: tuple[Floats, Floats], scatterers: Scatterers
    ) -> None:
        """Add the spectra of all pairs i <= j of some elements, without the delays of both.

        Parameters
        ----------
        spectra : ndarray of shape (bins, pairs), complex64
            Added to, in the band of the pulse.
        first_bin : int
            The first of their bins in the spectrum of the record.
        array : tuple of ndarray of shape (few,), m and s
            Lateral coordinates of the elements, and the delay of each, about which echoes arrive.
        scatterers : Scatterers
        """
        traces, threads = self._traces(array, scatterers), numba.get_num_threads()
        for start in range(0, len(traces), PAIRS):
            found = fft.rfft(traces[start : start + PAIRS], axis=1, workers=threads)
            spectra[:, start : start + PAIRS] += found[:, first_bin : first_bin + len(spectra)].T

    def _traces(self, array: tuple[Floats, Floats], scatterers: Scatterers) -> NDArray[np.float32]:
        """Traces of the pairs, (pairs, samples); their spectra are right in the band of the pulse."""
        (centres, delay), pairs = array, np.triu_indices(len(array[0]))
        traces = np.zeros((len(pairs[0]), self._samples), np.float32)
        range_ = np.linalg.norm(scatterers[0], axis=1)
        order, stop = np.argsort(range_, kind="stable"), 0
        while (start := stop) < len(order):
            _, alone = self._window(scatterers[0][order[start : start + 1]], centres, delay)
            depth = max(GATE, alone / 2) * self._medium[1] / 2 / self._sampling
            within = int(np.searchsorted(range_[order], range_[order[start]] + depth)) - start
            stop = start + min(max(within, LEAST), MOST)
            position, amplitude, exponent, passes = (each[order[start:stop]] for each in scatterers)
            first, length = self._window(position, centres, delay)
            own, late = (position, amplitude, exponent, passes), delay + first / self._sampling / 2
            spectra = self._gate(own, (centres, late), pairs, length)
            echoes = fft.irfft(spectra, length, axis=1, workers=numba.get_num_threads())
            # A gate may begin before time 0; what is there stands at the end of the record.
            begin = first % self._samples
            head = min(length, self._samples - begin)
            traces[:, begin : begin + head] += echoes[:, :head]
            traces[:, : length - head] += echoes[:, head:]
        return traces

    def _window(self, position: Floats, centres: Floats, delay: Floats) -> tuple[int, int]:
        """First sample in which echoes of scatterers (n, 3), m, arrive, and number of samples up to the last."""
        (height, focus, _), speed, beside = self._lens, self._medium[1], np.abs(position[:, 2:])
        range_ = np.hypot(position[:, :1] - centres, position[:, 1:2])
        # From the nearest and the farthest part of the height of an element, less the path from its centre.
        half, nearest = height / 2, np.minimum(beside, height / 2)
        early = nearest * (beside - nearest / 2) / range_ + half**2 / (2 * focus)
        late = half * (beside + half / 2) / range_
        distance, margin = np.hypot(range_, beside), MARGIN / (2 * np.pi * self._pulse_width)
        first = floor((2 * ((distance - early) / speed - delay).min() - margin) * self._sampling)
        last = ceil((2 * ((distance + late) / speed - delay).max() + margin) * self._sampling)
        return first, min(fft.next_fast_len(min(last - first, self._samples), real=True), self._samples)

    def _gate(
        self, scatterers: Scatterers, array: tuple[Floats, Floats], pairs: tuple[Any, Any], length: int
    ) -> NDArray[np.complex64]:
        """Spectra of a record of so many samples, without the delays of elements: (pairs, length // 2 + 1)."""
        (low, high), step, few, (i, j) = self._band, self._sampling / length, len(array[0]), pairs
        bins = np.arange(max(ceil(low / step), 1), floor(high / step) + 1)
        frequency, width = np.maximum(bins * step, self._waves[0]), padded(few)
        position, amplitude, exponent, passes = scatterers
        blocks = -(-len(position) // BLOCK)
        waves = np.zeros(
            (self._ways, blocks, WAVES, 2, len(self._polynomials), BLOCK * width + ROW_PADDING), np.float32
        )
        arrival = np.zeros((blocks, WAVES, BLOCK * width))
        inputs = (position, passes), array, self._lens, self._medium, self._tables
        share(partial(send, *inputs, waves, arrival), len(position))
        loss = 2 * self._medium[2] * np.linalg.norm(position, axis=1)
        ratio = np.log(frequency / self._centre)
        strength = np.zeros((len(bins), blocks * BLOCK), np.float32)
        growth = np.multiply.outer(ratio, exponent) - np.multiply.outer(frequency, loss)
        # The waves are times the root of their frequency. Of a harmonic, the sum over both ways has its mean.
        pulse = self._pulse(frequency) / frequency / np.sqrt(frequency) ** (self._ways - 1)
        strength[:, : len(position)] = pulse[:, None] * amplitude * np.exp(growth)
        sums, carry = np.zeros((len(bins), 2, padded(few, HEIGHT), width), np.float32), self._carry(frequency)
        share(partial(add_echoes, waves, arrival, carry, (bins[0] * step, step), strength, sums), len(carry))
        spectra, parts = np.zeros((len(i), length // 2 + 1), np.complex64), sums.reshape(len(bins), 2, -1)
        spectra.real[:, bins] = parts[:, 0].take(i * width + j, axis=1).T
        spectra.imag[:, bins] = -(parts[:, 1].take(i * width + j, axis=1) + parts[:, 1].take(j * width + i, axis=1)).T
        if low == 0:
            spectra[:, 0] = self._pulse(0.0) * _at_rest(scatterers, array[0])[i, j]
        return spectra

    def _pulse(self, frequency: Floats | float) -> Floats:
        """Spectrum of the pulse, which is not cut off."""
        return np.exp(-((frequency - self._centre) ** 2) / (2 * self._pulse_width**2))

    def _carry(self, frequency: Floats) -> NDArray[np.float32]:
        """Weights of the values at the nodes in those at frequencies (n,), Hz: (groups, nodes, GROUP).

        The values are those of the polynomial in the logarithm of the frequency through the nodes.
        """
        (low, high), nodes = self._waves, len(self._polynomials)
        place = 2 * np.log(frequency / low) / np.log(high / low) - 1
        weights = np.zeros((padded(len(frequency), GROUP), nodes), np.float32)
        weights[: len(frequency)] = legvander(place, nodes - 1) @ self._polynomials
        return np.ascontiguousarray(weights.reshape(-1, GROUP, nodes).transpose(0, 2, 1))


def _at_rest(scatterers: Scatterers, centres: Floats) -> Floats:
    """Echoes of all pairs at frequency 0, (few, few), 1/m^2, where neither width nor height of an element matters."""
    position, amplitude, exponent, passes = scatterers
    lateral, axial, beside = position.T[..., None]
    wave = passes * axial / ((lateral - centres) ** 2 + axial**2 + beside**2)
    echoes: Floats = np.einsum("ki,kj,k->ij", wave, wave, amplitude * (exponent == 0))
    return echoes


def edge_wave(steps: int) -> Floats:
    """exp(i u^2) times the integral of exp(-i s^2) over s from u on, at 1 / (1 + u) from 0 to 1: (steps + 2, 2).

    Real and imaginary parts; the last row stands twice, for interpolation at u = 0.
    """
    inverse = np.minimum(np.arange(1, steps + 2) / steps, 1)
    turned = np.exp(1j * np.pi / 4)
    value = np.append(0, np.sqrt(np.pi) / 2 / turned * wofz(1j * turned * (1 / inverse - 1)))
    return np.stack([value.real, value.imag], axis=1)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def send(scatterers, array, lens, medium, tables, waves, arrival, part):
    """Write the waves of every element at some scatterers: what they are without phase, and when they arrive.

    Parameters
    ----------
    scatterers
        Positions, m, (scatterers, 3), and what passes between them and elements, (scatterers, elements).
    array
        Lateral coordinates of the elements, m, and delays that are taken away, s, each of shape (elements,).
    lens
        Height of the elements and focus, m, and least delay of the edges by the curvature alone, s.
    medium
        Frequencies, Hz, shape (nodes,); speed of sound, m/s; attenuation, 1/m/Hz.
    tables
        Of :func:`edge_wave`, and of directivity without its cosine over the square of the sine, (STEPS + 2, nodes).
    waves
        Written: shape (ways, blocks, WAVES, 2, nodes, BLOCK width or more), float32; real and imaginary parts, times
        the root of the frequency and without the attenuation up to the range of the scatterer, sqrt(Hz)/m. The second,
        of a harmonic, are those of half the frequencies, such that the square of their sum is the wave that is sent,
        times half of the frequency.
    arrival
        Written: shape (blocks, WAVES, BLOCK width), s.
    part
        First of the scatterers, and the one after the last.
    """
    (position, passes), (centres, delay), (edge, directivity) = scatterers, array, tables
    frequency, speed, attenuation = medium
    width = arrival.shape[2] // BLOCK
    for k in range(*part):
        range_ = np.sqrt(position[k, 0] ** 2 + position[k, 1] ** 2 + position[k, 2] ** 2)
        late = arrival[k // BLOCK]
        for e in range(len(centres)):
            lateral, column = position[k, 0] - centres[e], k % BLOCK * width + e
            distance, side, size, tilt = phases(lateral, position[k, 1], position[k, 2], lens, speed)
            time, centre = distance / speed - delay[e], tilt / (2 * size)
            inside = centre < 1
            late[0, column] = time - side * tilt * centre / 2 if inside else time
            late[1, column] = time + side * (size - tilt)
            late[2, column] = time + side * (size + tilt)
            place, scale = STEPS * (lateral / distance) ** 2, np.sqrt(2 * np.pi * size)
            weight, loss = passes[k, e] * position[k, 1] / distance**2 / scale, attenuation * (distance - range_)
            for n in range(len(frequency)):
                strength, root = weight * between(directivity, place, n), scale * np.sqrt(frequency[n])
                if loss:
                    strength *= np.exp(-loss * frequency[n])
                write_waves(waves[0, k // BLOCK, :, :, n, column], strength, root, side, centre, edge)
                if len(waves) == 2:
                    strength, root = np.sqrt(max(strength, 0.0) / scale), root / np.sqrt(2)
                    write_waves(waves[1, k // BLOCK, :, :, n, column], strength, root, side, centre, edge)


@numba.njit(cache=True, error_model="numpy")
def write_waves(written, strength, root, side, centre, edge):
    """Write real and imaginary parts of the waves of an element, (WAVES, 2); `root` is that of 2 pi f a."""
    inside, still = centre < 1, np.sqrt(np.pi / 2) / 2
    written[0, 0] = still * strength if inside else 0.0
    written[0, 1] = -side * still * strength if inside else 0.0
    for end in range(2):
        row = EDGE_STEPS / (1 + root * abs(2 * end - 1 + centre))
        value = strength / 2 if end == 0 and not inside else -strength / 2
        written[1 + end, 0] = value * between(edge, row, 0)
        written[1 + end, 1] = value * side * between(edge, row, 1)


@numba.njit(cache=True, error_model="numpy")
def phases(lateral, axial, beside, lens, speed):
    """Distance of a scatterer, m, and of the phases a and b over 2 pi f: sign and size of a, and b, s."""
    height, focus, least = lens
    square = lateral**2 + axial**2
    curvature = 1 / np.sqrt(square)
    bend = height * height / 8 * (curvature - 1 / focus) / speed
    side = 1.0 if bend >= 0 else -1.0
    return np.sqrt(square + beside**2), side, max(abs(bend), least), height / 2 * abs(beside) * curvature / speed


@numba.njit(cache=True)
def between(table, place, column):
    """Value of a column of a table (rows, columns) at a fractional row."""
    row = int(place)
    return table[row, column] + (place - row) * (table[row + 1, column] - table[row, column])


@numba.njit(nogil=True, cache=True)
def add_echoes(waves, arrival, carry, grid, strength, sums, groups):
    """Add the echoes of some scatterers: u_i u_j times their strength, u being the sum of the waves of an element.

    Those of a harmonic are u_i v_j^2 + v_i^2 u_j, v being the sum of the waves of half the frequency.

    Parameters
    ----------
    waves, arrival
        As :func:`send` writes them; the waves in front of each other, of u and, for a harmonic, of v.
    carry
        Weights of the frequencies of the waves in those of the sum, shape (groups, nodes, GROUP), float32.
    grid
        First frequency and step, Hz.
    strength
        Shape (frequencies, blocks BLOCK), float32.
    sums
        Added to: shape (frequencies, 2, elements or more, width), float32. The real parts of pairs i <= j, and what
        makes the negative of the imaginary part with its transpose.
    groups
        First of the groups of frequencies, and the one after the last.
    """
    ways, count, width = len(waves), arrival.shape[2], sums.shape[3]
    carried = np.empty((ways, WAVES, 2, GROUP, count), np.float32)
    left, right = np.empty((2, ways, BLOCK, width), np.float32), np.empty((2, ways, BLOCK, width), np.float32)
    left_rows, right_rows = left.reshape(2 * ways * BLOCK, width), right.reshape(2 * ways * BLOCK, width)
    phase, turn = np.empty((ways, WAVES, 2, count), np.float32), np.empty((ways, WAVES, 2, count), np.float32)
    for block in range(len(arrival)):
        turn_phases(arrival[block], grid[1], turn)
        for group in range(*groups):
            first = group * GROUP
            turn_phases(arrival[block], grid[0] + first * grid[1], phase)
            for way in range(ways):
                for wave in range(WAVES):
                    for part in range(2):
                        product(carry[group], waves[way, block, wave, part], carried[way, wave, part])
            for f in range(first, min(first + GROUP, len(sums))):
                add_waves(carried, f - first, phase, turn, left)
                multiply_rows(left, strength[f, block * BLOCK : (block + 1) * BLOCK], right)
                product(left_rows, right_rows, sums[f, 0], True, True)
                product(left_rows[: ways * BLOCK], right_rows[ways * BLOCK :], sums[f, 1], False, True)


@numba.njit(cache=True)
def add_waves(carried, n, phase, turn, total):
    """Write the sums of the waves at the n-th frequency of a group, and turn the phases to the next.

    The total (2, ways, BLOCK, width), real parts before imaginary ones, has the square of the second sum.
    """
    for way in range(len(carried)):
        real, imaginary = total[0, way].ravel(), total[1, way].ravel()
        real[:], imaginary[:] = np.float32(0), np.float32(0)
        for wave in range(WAVES):
            c, s = phase[way, wave, 0], phase[way, wave, 1]
            add_turned(carried[way, wave, 0, n], carried[way, wave, 1, n], c, s, real, imaginary)
            turn_on(c, s, turn[way, wave, 0], turn[way, wave, 1])
        if way == 1:
            square(real, imaginary)


@numba.njit(cache=True)
def square(real, imaginary):
    """Square numbers of real and imaginary parts (n,), float32."""
    for n in range(len(real)):
        x, y = real[n], imaginary[n]
        real[n], imaginary[n] = x * x - y * y, x * y + x * y


@numba.njit(cache=True)
def turn_phases(time, frequency, phase):
    """Write :func:`turn_phase` of times (WAVES, n), s, at a frequency, and at half of it: (ways, WAVES, 2, n)."""
    for way in range(len(phase)):
        for wave in range(WAVES):
            turn_phase(time[wave], frequency / (1 + way), phase[way, wave, 0], phase[way, wave, 1])


@numba.njit(cache=True)
def turn_phase(time, frequency, c, s):
    """Write exp(-2 pi i f t) of a frequency and times (n,) as c + i s, float32.

    By the Taylor polynomials of half the phase, which compilers vectorise.
    """
    two = np.float32(2)
    for n in range(len(time)):
        cycles = frequency * time[n]
        x = np.float32(np.pi * (cycles - np.floor(cycles + 0.5)))
        y = x * x
        sine = x * (SINE[0] + y * (SINE[1] + y * (SINE[2] + y * (SINE[3] + y * (SINE[4] + y * SINE[5])))))
        cosine = COSINE[1] + y * (COSINE[2] + y * (COSINE[3] + y * (COSINE[4] + y * (COSINE[5] + y * COSINE[6]))))
        cosine = COSINE[0] + y * cosine
        c[n], s[n] = COSINE[0] - two * sine * sine, -two * sine * cosine


@numba.njit(cache=True)
def add_turned(a, b, c, s, real, imaginary):
    """Add (a + i b) (c + i s) to real + i imaginary, all of shape (n,), float32."""
    for n in range(len(a)):
        real[n] += a[n] * c[n] - b[n] * s[n]
        imaginary[n] += a[n] * s[n] + b[n] * c[n]


@numba.njit(cache=True)
def turn_on(c, s, p, q):
    """Multiply c + i s by p + i q, all of shape (n,), float32."""
    for n in range(len(c)):
        x = c[n]
        c[n] = x * p[n] - s[n] * q[n]
        s[n] = x * q[n] + s[n] * p[n]


@numba.njit(cache=True)
def multiply_rows(waves, strength, out):
    """Write real parts times the strength (BLOCK,) of their scatterer, and imaginary ones times minus that.

    Both of shape (2, ways, BLOCK, width); the two ways change places.
    """
    for way in range(waves.shape[1]):
        other = waves.shape[1] - 1 - way
        for k in range(BLOCK):
            factor = strength[k]
            for n in range(waves.shape[3]):
                out[0, other, k, n] = factor * waves[0, way, k, n]
            for n in range(waves.shape[3]):
                out[1, other, k, n] = -factor * waves[1, way, k, n]
