"""The beam in elevation: what a lens does to an echo from beside the plane of the image.

An element of height H with a lens of focus F responds to a point at elevation y and range r in the plane with the
Fresnel integral E(f) = 1/H int exp(-i k [h^2/2 (1/r - 1/F) - h y/r]) dh over its height, k = 2 pi f / c, relative to
the straight path to its centre (Goodman, Introduction to Fourier Optics, section 4.2). The echo of a pair has E_i E_j.
A second harmonic comes from a wave that is sent at f/2, and has its square: the echo has E(f/2)^2 of one element and
E(f) of the other, here the mean of both ways. These products are taken at the mean of the least and greatest 1/r of the
elements, their delay apart, and corrected for each of them to first order in 1/r. Where they see a scatterer at ranges
too different for that, echoes are summed frequency by frequency (:mod:`~echotruth.imaging.rf.frequency_sum`).
"""

from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.rf.kernel import Band, fit_kernel, stack_real_imaginary
from echotruth.units import MHz, mm, um

BEAM_TAIL_ENERGY = 1.3e-4
"""Energy of the echoes that are left out beside the beam, over that of all echoes from scatterers at the same range."""
MAX_BLOCKS = 4
"""Largest number of blocks of samples of an echo that is spread."""
MAX_ERROR_ENERGY = 7e-6
"""Energy of the error of a kernel, relative to that of an echo from the plane at the same range."""
CURVATURES = 192
MAX_SLOPE = 1.0
"""Greatest elevation over range."""
SLOPES_PER_BEAMWIDTH = 24
"""Slopes tabulated per wavelength over height."""
MAX_SECOND_ORDER = 0.063
"""All elements share the lens kernel of their mean where it errs by less than this: the square of the phase (rad^2) by
which the echo from the edge of an element differs from that of the mean, the path to its centre apart, weighted by the
echo over its value in the plane. Echoes of a heart then err by less than 1 % (L2, measured)."""


class Lens:
    """Tables over 1/range (rows) and elevation over range (columns), both evenly spaced.

    Parameters
    ----------
    probe : Probe
    max_range : float
        Greatest range, m.
    band : Band
    harmonic : bool
        Whether echoes are those of the second harmonic of what is sent.

    Attributes
    ----------
    power : int
        Power of `beam` that is the response of a pair: 2, and 1 for a harmonic, where `beam` is E(f) E(f/2)^2 without
        the delay of both ways, and the derivative half of that of a pair.
    curvature : ndarray of shape (CURVATURES,), 1/m
        1/range.
    slope : ndarray of shape (slopes,)
        Elevation over range.
    beam : ndarray of shape (CURVATURES, slopes, NODES), complex64
        E at the frequencies of the band, without its delay.
    delay : ndarray of shape (CURVATURES, slopes), s
        Delay removed from `beam`.
    log_derivative : ndarray of shape (CURVATURES, slopes), m
        g = (dE / d(1/r)) / E over the band: real part that of the amplitude, imaginary part that of the phase.
    derivative_residual : ndarray of shape (CURVATURES, slopes, NODES), complex64, m
        dE / d(1/r) less what g makes of E, without the delay.
    edge_slope : ndarray of shape (CURVATURES,)
        Slope at which the beam ends: scatterers evenly spread beyond it together have `BEAM_TAIL_ENERGY` of the
        energy of all at that range.
    """

    def __init__(self, probe: Probe, max_range: float, band: Band, harmonic: bool = False) -> None:
        height, centre = probe.height_mm * mm, probe.frequency_MHz * MHz
        slopes = int(SLOPES_PER_BEAMWIDTH * MAX_SLOPE * height * centre / probe.sound_speed_m_per_s) + 2
        self.slope = np.linspace(0, MAX_SLOPE, slopes)
        self.curvature = np.linspace(min(1 / max_range, 1 / height), 2 / height, CURVATURES)
        beam, derivative = self._fresnel_integrals(probe, band.frequency)
        if harmonic:
            sent, change = self._fresnel_integrals(probe, band.frequency / 2)
            derivative = sent * (sent * derivative / 2 + beam * change)
            beam = beam * sent**2
        self.power = 1 if harmonic else 2
        angular_frequency = 2 * np.pi * centre
        self.log_derivative = _log_derivative(beam, derivative, band, centre)
        self.delay = _delays(beam**self.power, band) / 2
        # Traces are damped by arrival time, but attenuation depends on path length: compensate for the lens delay.
        undamped = band.loss + 2j * np.pi * band.frequency
        advance = np.exp(np.multiply.outer(2 / self.power * self.delay, undamped))
        phase_slope = np.multiply.outer(self.log_derivative.imag, undamped / angular_frequency)
        derivative -= (self.log_derivative.real[..., None] + phase_slope) * beam
        self.derivative_residual = (advance * derivative).astype(np.complex64)
        self.beam = (advance * beam).astype(np.complex64)
        self.edge_slope = _edge_slope(self.beam**self.power, band, self.slope)
        self._band, self._response = band, _response(np.abs(self.beam) ** (self.power / 2), band)
        self._half_aperture, self._height = (probe.elements - 1) * (probe.pitch_um * um) / 2, height
        self._wavenumber = angular_frequency / probe.sound_speed_m_per_s

    @cached_property
    def blocks(self) -> NDArray[np.uint8]:
        """Blocks of samples that an echo needs, (CURVATURES, slopes); one more than `MAX_BLOCKS` if these are too few.

        They take a third of the time to set up the tables, and who only asks what is in the beam needs none.
        """
        return _blocks(self.beam**self.power, self._band)

    def in_beam(self, position: Floats) -> NDArray[np.bool_]:
        """Which scatterers at positions (n, 3), m, are within the beam, (n,)."""
        curvature = 1 / np.hypot(position[:, 0], position[:, 1])
        return np.abs(position[:, 2]) * curvature <= np.interp(curvature, self.curvature, self.edge_slope)

    def blocks_at(self, index: Floats) -> NDArray[np.int64]:
        """Blocks of samples that echoes need at fractional indices (n, 2) of the tables: (n,)."""
        nearest = np.rint(index).astype(np.intp)
        return self.blocks[nearest[:, 0], nearest[:, 1]].astype(np.int64)

    def spreads(self, position: Floats) -> NDArray[np.bool_]:
        """Whether the echoes of scatterers (n, 3), m, to all elements can be spread by kernels: (n,)."""
        least, greatest = self._curvatures(position)
        edge = self._height / 2 * (self._height / 4 + np.abs(position[:, 2]))
        turn = self._wavenumber * edge * (greatest - least) / 2
        row, column = np.rint(self.lens_terms(position, 1.0)[0]).astype(np.intp).T
        near = turn**2 * self._response[row, column] > MAX_SECOND_ORDER
        return ~near & (self.blocks[row, column] <= MAX_BLOCKS)

    def _curvatures(self, position: Floats) -> tuple[Floats, Floats]:
        """Least and greatest 1/range of scatterers (n, 3), m, from points of the array: (n,) each, 1/m."""
        beside, half = np.abs(position[:, 0]), self._half_aperture
        return 1 / np.hypot(beside + half, position[:, 1]), 1 / np.hypot(np.maximum(beside - half, 0), position[:, 1])

    def lens_terms(self, position: Floats, sound_speed: float) -> tuple[Floats, Floats]:
        """Look up scatterers (n, 3), m, in the tables, at the mean of their least and greatest 1/range.

        Returns
        -------
        index : ndarray of shape (n, 2)
            Fractional row and column in the tables, within them.
        terms : ndarray of shape (n, 4)
            1/range (1/m), delay as range (m), real and imaginary part of the logarithmic derivative (m).
        """
        index, terms = np.empty((len(position), 2)), np.empty((len(position), 4))
        grid = self.curvature[0], self.curvature[1] - self.curvature[0], self.slope[1]
        curvature, beside = np.add(*self._curvatures(position)) / 2, np.abs(position[:, 2])
        _look_up(curvature, beside, grid, self.log_derivative, self.delay, sound_speed, index, terms)
        return index, terms

    def _fresnel_integrals(self, probe: Probe, frequency: Floats) -> tuple[NDArray, NDArray]:
        """E, and its derivative with respect to 1/range at a fixed elevation, (CURVATURES, slopes, NODES)."""
        size, wavenumber = probe.height_mm * mm, 2 * np.pi * frequency / probe.sound_speed_m_per_s
        defocus = self.curvature - 1 / (probe.elevation_focus_mm * mm)
        phase = wavenumber.max() * size / 2 * (MAX_SLOPE + np.abs(defocus).max() * size / 4)
        node, weight = np.polynomial.legendre.leggauss(32 + int(phase))
        height = node * size / 2
        elevation = self.slope / self.curvature[:, None]
        shape = (len(self.curvature), len(self.slope), len(wavenumber))
        beam, derivative = np.empty(shape, complex), np.empty(shape, complex)
        for n, k in enumerate(wavenumber):
            curved = weight / 2 * np.exp(-1j * k * np.multiply.outer(defocus, height**2 / 2))
            tilted = np.exp(1j * k * np.multiply.outer(height, self.slope))
            zeroth, first, second = ((curved * height**power) @ tilted for power in range(3))
            beam[:, :, n] = zeroth
            derivative[:, :, n] = -1j * k * (second / 2 - elevation * first)
        return beam, derivative


@numba.njit(cache=True)
def _look_up(curvature, beside, grid, log_derivative, delay, sound_speed, index, terms):
    """Write index and terms as :meth:`Lens.lens_terms` returns them, by bilinear interpolation.

    The curvature, 1/m, and the distance from the plane, m, have the shape (n,); the grid is the first curvature and the
    step of curvatures, 1/m, and the step of slopes.
    """
    rows, columns = log_derivative.shape
    for n in range(len(curvature)):
        row = min(max((curvature[n] - grid[0]) / grid[1], 0.0), rows - 1.001)
        column = min(beside[n] * curvature[n] / grid[2], columns - 1.001)
        i, j = int(row), int(column)
        down, right = row - i, column - j
        a, b = (1 - down) * (1 - right), down * (1 - right)
        c, d = (1 - down) * right, down * right
        g = a * log_derivative[i, j] + b * log_derivative[i + 1, j]
        g += c * log_derivative[i, j + 1] + d * log_derivative[i + 1, j + 1]
        late = a * delay[i, j] + b * delay[i + 1, j] + c * delay[i, j + 1] + d * delay[i + 1, j + 1]
        # Entry by entry, which compiles in half the time.
        index[n, 0], index[n, 1] = row, column
        terms[n, 0], terms[n, 1], terms[n, 2], terms[n, 3] = curvature[n], late * sound_speed, g.real, g.imag


def _log_derivative(beam: NDArray, derivative: NDArray, band: Band, centre: float) -> NDArray:
    """Logarithmic derivative: of the amplitude, and of a phase proportional to frequency at the centre, (...)."""
    ratio = band.frequency / centre
    inner = derivative * beam.conj() * band.weight
    energy = np.abs(beam) ** 2 * band.weight
    amplitude = inner.real.sum(axis=-1) / np.maximum(energy.sum(axis=-1), 1e-12)
    phase = (inner.imag * ratio).sum(axis=-1) / np.maximum((energy * ratio**2).sum(axis=-1), 1e-12)
    return amplitude + 1j * phase


def _delays(pulse: NDArray, band: Band) -> Floats:
    """Mean delay of pulses (..., NODES) by their energy: minus the slope of the phase, s."""
    step = np.diff(band.frequency)
    turn = np.angle(pulse[..., 1:] * pulse[..., :-1].conj())
    energy = np.abs(pulse[..., 1:] * pulse[..., :-1]) * np.sqrt(band.weight[1:] * band.weight[:-1])
    return -(energy * turn).sum(axis=-1) / np.maximum((energy * step).sum(axis=-1), 1e-300) / (2 * np.pi)


def _blocks(spectrum: NDArray, band: Band) -> NDArray[np.uint8]:
    """Blocks of samples that pulses (curvatures, slopes, NODES) need; one more than there may be if that is too few."""
    target = stack_real_imaginary(spectrum)
    energy = (target**2 @ np.concatenate([band.weight, band.weight])).astype(float)
    greatest = energy.max(axis=1, keepdims=True)
    needed = np.full(energy.shape, MAX_BLOCKS + 1, np.uint8)
    for blocks in range(MAX_BLOCKS, 0, -1):
        error = np.square(target @ fit_kernel(band, blocks, 0.3)[1].T).sum(axis=-1)
        needed[error <= MAX_ERROR_ENERGY * greatest] = blocks
    return needed


def _edge_slope(spectrum: NDArray, band: Band, slope: Floats) -> Floats:
    """Slope beyond which scatterers evenly spread over elevation have `BEAM_TAIL_ENERGY` of the energy of all.

    Takes pulses (curvatures, slopes, NODES); returns (curvatures,).
    """
    energy = (np.abs(spectrum) ** 2 * band.weight).sum(axis=-1)
    outside = energy[:, ::-1].cumsum(axis=1)[:, ::-1] / energy.sum(axis=1, keepdims=True)
    return slope[np.minimum((outside > BEAM_TAIL_ENERGY).sum(axis=1), len(slope) - 1)]


def _response(magnitude: Floats, band: Band) -> Floats:
    """Greatest |E| (curvatures, slopes, NODES) at a slope and beyond, over the greatest of all: (curvatures, slopes).

    Where E is 0 it differs between elements all the same.
    """
    amplitude = np.sqrt((magnitude**2 * band.weight).sum(axis=-1))
    envelope = np.maximum.accumulate(amplitude[:, ::-1], axis=1)[:, ::-1]
    return envelope / envelope[:, :1]
