"""The beam in elevation: what a lens does to an echo from beside the plane of the image.

An element of height H with a lens of focus F responds to a point at elevation y and range r in the plane with the
Fresnel integral E(f) = 1/H int exp(-i k [h^2/2 (1/r - 1/F) - h y/r]) dh over its height, k = 2 pi f / c, relative to
the straight path to its centre (Goodman, Introduction to Fourier Optics, section 4.2). The echo of a pair has E_i E_j.
For each element E is taken at the range from the centre of the array, its delay apart, and corrected to first order in
1/r. Near the array, where its elements see a scatterer at ranges too different for that, it is taken at those from the
centres of a few subapertures.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.rf.kernel import Band, fit_kernel, stack_real_imaginary

BEAM_TAIL_ENERGY = 1.3e-4
"""Energy of the echoes that are left out beside the beam, over that of all echoes from scatterers at the same range."""
MAX_BLOCKS = 4
"""Largest number of blocks of samples of an echo; longer echoes are truncated."""
MAX_ERROR_ENERGY = 3e-5
"""Energy of the error of a kernel, relative to that of an echo from the plane at the same range."""
CURVATURES = 192
MAX_SLOPE = 1.0
"""Greatest elevation over range."""
SLOPES_PER_BEAMWIDTH = 24
"""Slopes tabulated per wavelength over height."""
MAX_SUBAPERTURE = 0.17
"""Greatest product of the Fresnel number H^2 / (4 lambda r) of an element and the square of half the width of a
subaperture over the range r: the terms of E beyond the first order are then about 1 %."""
MAX_SUBAPERTURES = 2
ACCURATE_ERROR = 1e-2
"""Largest error of an accurate kernel (amplitude), relative to the echo from the plane at the same range."""


class Lens:
    """Tables over 1/range (rows) and elevation over range (columns), both evenly spaced.

    Parameters
    ----------
    probe : Probe
    max_range : float
        Greatest range, m.
    band : Band

    Attributes
    ----------
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
    blocks : ndarray of shape (CURVATURES, slopes), uint8
        Blocks of samples that an echo needs.
    edge_slope : ndarray of shape (CURVATURES,)
        Slope at which the beam ends: scatterers evenly spread beyond it together have `BEAM_TAIL_ENERGY` of the
        energy of all at that range.
    accurate_from : float, m
        Range from which on no kernel misses more than `ACCURATE_ERROR`, and `MAX_SUBAPERTURES` are enough.
    """

    def __init__(self, probe: Probe, max_range: float, band: Band) -> None:
        p = probe.si()
        slopes = int(SLOPES_PER_BEAMWIDTH * MAX_SLOPE * p.height * p.frequency / p.sound_speed) + 2
        self.slope = np.linspace(0, MAX_SLOPE, slopes)
        self.curvature = np.linspace(min(1 / max_range, 1 / p.height), 2 / p.height, CURVATURES)
        beam, derivative = self._fresnel_integrals(probe, band)
        angular_frequency = 2 * np.pi * p.frequency
        self.log_derivative = _log_derivative(beam, derivative, band, p.frequency)
        self.delay = _delays(beam**2, band) / 2
        # Traces are damped by arrival time, but attenuation depends on path length: compensate for the lens delay.
        undamped = band.loss + 2j * np.pi * band.frequency
        advance = np.exp(np.multiply.outer(self.delay, undamped))
        phase_slope = np.multiply.outer(self.log_derivative.imag, undamped / angular_frequency)
        derivative -= (self.log_derivative.real[..., None] + phase_slope) * beam
        self.derivative_residual = (advance * derivative).astype(np.complex64)
        self.beam = (advance * beam).astype(np.complex64)
        self.blocks, error = _blocks(self.beam**2, band)
        self.edge_slope = _edge_slope(self.beam**2, band, self.slope)
        self._elements, self._half_aperture = p.elements, p.elements * p.pitch / 2
        self._fresnel = p.height**2 * p.frequency / (4 * p.sound_speed)
        nearest = np.cbrt(self._fresnel * self._half_aperture**2 / (MAX_SUBAPERTURE * MAX_SUBAPERTURES**2))
        self.accurate_from = float(max(nearest, *1 / self.curvature[error > ACCURATE_ERROR], 0.0))

    def in_beam(self, position: Floats) -> NDArray[np.bool_]:
        """Which scatterers at positions (n, 3), m, are within the beam, (n,)."""
        curvature = 1 / np.hypot(position[:, 0], position[:, 1])
        return np.abs(position[:, 2]) * curvature <= np.interp(curvature, self.curvature, self.edge_slope)

    def blocks_at(self, index: Floats) -> NDArray[np.int64]:
        """Blocks of samples that echoes need at fractional indices (..., 2) of the tables: (...)."""
        nearest = np.rint(index).astype(np.intp)
        return self.blocks[nearest[..., 0], nearest[..., 1]].astype(np.int64)

    def subapertures(self, range_: Floats) -> NDArray[np.int64]:
        """Number of subapertures with a separate table lookup per scatterer, at ranges (n,), m: (n,)."""
        needed = np.sqrt(self._fresnel * self._half_aperture**2 / (MAX_SUBAPERTURE * range_**3))
        return np.clip(np.ceil(needed), 1, min(MAX_SUBAPERTURES, self._elements)).astype(np.int64)

    def lens_terms(self, position: Floats, sound_speed: float, subapertures: int = 1) -> tuple[Floats, Floats]:
        """Look up scatterers (n, 3), m, in the tables, at their ranges from the centre of each subaperture.

        Returns
        -------
        index : ndarray of shape (n, subapertures, 2)
            Fractional row and column in the tables, within them.
        terms : ndarray of shape (n, subapertures, 4)
            1/range (1/m), delay as range (m), real and imaginary part of the logarithmic derivative (m).
        """
        index, terms = np.empty((len(position), subapertures, 2)), np.empty((len(position), subapertures, 4))
        grid = self.curvature[0], self.curvature[1] - self.curvature[0], self.slope[1]
        first = subaperture_bounds(self._elements, subapertures)
        centres = ((first[1:] + first[:-1]) / self._elements - 1) * self._half_aperture
        _look_up(position, centres, grid, self.log_derivative, self.delay, sound_speed, index, terms)
        return index, terms

    def _fresnel_integrals(self, probe: Probe, band: Band) -> tuple[NDArray, NDArray]:
        """E, and its derivative with respect to 1/range at a fixed elevation, (CURVATURES, slopes, NODES)."""
        p = probe.si()
        wavenumber = 2 * np.pi * band.frequency / p.sound_speed
        defocus = self.curvature - 1 / p.elevation_focus
        phase = wavenumber.max() * p.height / 2 * (MAX_SLOPE + np.abs(defocus).max() * p.height / 4)
        node, weight = np.polynomial.legendre.leggauss(32 + int(phase))
        height = node * p.height / 2
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


def subaperture_bounds(elements: int, subapertures: int) -> NDArray[np.int64]:
    """First element of every subaperture, and the number of elements, (subapertures + 1,).

    Element e is in subaperture e subapertures // elements.
    """
    return -(-np.arange(subapertures + 1) * elements // subapertures)


@numba.njit(cache=True)
def _look_up(position, centres, grid, log_derivative, delay, sound_speed, index, terms):
    """Write index and terms as :meth:`Lens.lens_terms` returns them, by bilinear interpolation.

    The lateral coordinates of the centres of the subapertures (subapertures,) are in m. The grid is the first curvature
    and the step of curvatures, 1/m, and the step of slopes.
    """
    rows, columns = log_derivative.shape
    for n in range(len(position)):
        for part in range(len(centres)):
            range_ = np.sqrt((position[n, 0] - centres[part]) ** 2 + position[n, 1] ** 2)
            row = min(max((1 / range_ - grid[0]) / grid[1], 0.0), rows - 1.001)
            column = min(abs(position[n, 2]) / range_ / grid[2], columns - 1.001)
            i, j = int(row), int(column)
            down, right = row - i, column - j
            a, b = (1 - down) * (1 - right), down * (1 - right)
            c, d = (1 - down) * right, down * right
            g = a * log_derivative[i, j] + b * log_derivative[i + 1, j]
            g += c * log_derivative[i, j + 1] + d * log_derivative[i + 1, j + 1]
            late = a * delay[i, j] + b * delay[i + 1, j] + c * delay[i, j + 1] + d * delay[i + 1, j + 1]
            # Entry by entry, which compiles in half the time.
            index[n, part, 0], index[n, part, 1] = row, column
            terms[n, part, 0], terms[n, part, 1] = 1 / range_, late * sound_speed
            terms[n, part, 2], terms[n, part, 3] = g.real, g.imag


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


def _blocks(spectrum: NDArray, band: Band) -> tuple[NDArray[np.uint8], Floats]:
    """Blocks of samples that pulses (curvatures, slopes, NODES) need, and the greatest error of the longest kernel.

    The error, (curvatures,), is over the echo from the plane at the same range.
    """
    target = stack_real_imaginary(spectrum)
    energy = (target**2 @ np.concatenate([band.weight, band.weight])).astype(float)
    greatest = energy.max(axis=1, keepdims=True)
    needed = np.full(energy.shape, MAX_BLOCKS, np.uint8)
    residuals = [fit_kernel(band, blocks, 0.3)[1] for blocks in range(1, MAX_BLOCKS + 1)]
    error = [np.square(target @ residual.T).sum(axis=-1) for residual in residuals]
    for blocks in range(MAX_BLOCKS - 1, 0, -1):
        needed[error[blocks - 1] <= MAX_ERROR_ENERGY * greatest] = blocks
    return needed, np.sqrt((error[-1] / greatest).max(axis=1))


def _edge_slope(spectrum: NDArray, band: Band, slope: Floats) -> Floats:
    """Slope beyond which scatterers evenly spread over elevation have `BEAM_TAIL_ENERGY` of the energy of all.

    Takes pulses (curvatures, slopes, NODES); returns (curvatures,).
    """
    energy = (np.abs(spectrum) ** 2 * band.weight).sum(axis=-1)
    outside = energy[:, ::-1].cumsum(axis=1)[:, ::-1] / energy.sum(axis=1, keepdims=True)
    return slope[np.minimum((outside > BEAM_TAIL_ENERGY).sum(axis=1), len(slope) - 1)]
