"""The beam in elevation: what a lens does to an echo from beside the plane of the image.

An element of height H with a lens of focus F hears a point at elevation y and range r in the plane through the
Fresnel integral E(f) = 1/H int exp(-i k [h^2/2 (1/r - 1/F) - h y/r]) dh over its height, k = 2 pi f / c, relative to
the straight path to its centre (Goodman, Introduction to Fourier Optics, section 4.2). A pair hears E_i E_j. That is
taken as E^2 at the range from the centre of the array, its delay apart, and corrected for each element by the
logarithmic derivative with respect to 1/r.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.config import Probe
from echotruth.imaging.kernel import Band, fit, stacked

Floats = NDArray[np.float64]

FAINT = 1e-3
"""Scatterers whose echo is fainter than this because of their elevation are left out; in the focus it is 1."""
MOST_BLOCKS = 3
"""Blocks of samples that the longest echoes get; what is longer is cut."""
LEFT = 3e-5
"""Energy that a kernel may miss, over that of an echo from the plane at the same range."""
CURVATURES = 192
STEEPEST = 1.0
"""Greatest elevation over range."""
ENOUGH = 24
"""Slopes tabulated per wavelength over height."""


class Lens:
    """Tables over 1/range (rows) and elevation over range (columns), both evenly spaced.

    Parameters
    ----------
    probe : Probe
    reach : float
        Greatest range, m.
    band : Band

    Attributes
    ----------
    curvature : ndarray of shape (CURVATURES,), 1/m
    slope : ndarray of shape (slopes,)
    spectrum : ndarray of shape (CURVATURES, slopes, NODES), complex64
        E^2 at the frequencies of the band, without its delay.
    delay : ndarray of shape (CURVATURES, slopes), s
        Taken out of it.
    change : ndarray of shape (CURVATURES, slopes, NODES), complex64, m
        E R, likewise.
    growth : ndarray of shape (CURVATURES, slopes), m
        g: real part that of the amplitude, imaginary part that of the phase.
    blocks : ndarray of shape (CURVATURES, slopes), uint8
        Blocks of samples that an echo needs; 0 where it is fainter than `FAINT`.
    """

    def __init__(self, probe: Probe, reach: float, band: Band) -> None:
        p = probe.si()
        slopes = int(ENOUGH * STEEPEST * p.height * p.frequency / p.sound_speed) + 2
        self.slope = np.linspace(0, STEEPEST, slopes)
        self.curvature = np.linspace(min(1 / reach, 1 / p.height), 2 / p.height, CURVATURES)
        beam, change = self._integrals(probe, band)
        self.growth = _growth(beam, change, band, p.frequency)
        self.delay = _delays(beam**2, band)
        turned = beam * np.exp(2j * np.pi * np.multiply.outer(self.delay, band.frequency))
        ratio = band.frequency / p.frequency
        change -= (self.growth.real[..., None] + 1j * np.multiply.outer(self.growth.imag, ratio)) * beam
        self.change = (turned * change).astype(np.complex64)
        self.spectrum = (turned * beam).astype(np.complex64)
        self.blocks = _blocks(self.spectrum, band)

    def places(self, position: Floats) -> Floats:
        """Rows and columns of scatterers (n, 3), m, in the tables: (n, 2), within them."""
        return self.lean(position, 1.0)[0]

    def blocks_of(self, position: Floats) -> NDArray[np.int64]:
        """Blocks of samples that the echoes of scatterers (n, 3), m, need: (n,); 0 where they are too faint."""
        steep = np.abs(position[:, 2]) > STEEPEST * np.hypot(position[:, 0], position[:, 1])
        return np.where(steep, 0, self.blocks_at(self.places(position)))

    def blocks_at(self, places: Floats) -> NDArray[np.int64]:
        """The same at places (n, 2) in the tables."""
        row, column = np.rint(places).astype(np.intp).T
        return self.blocks[row, column].astype(np.int64)

    def lean(self, position: Floats, sound_speed: float) -> tuple[Floats, Floats]:
        """Places of scatterers (n, 3), m, in the tables, (n, 2), and what
        :func:`~echotruth.imaging.deposit.one_way` wants to know of them, (n, 4)."""
        places, told = np.empty((len(position), 2)), np.empty((len(position), 4))
        grid = self.curvature[0], self.curvature[1] - self.curvature[0], self.slope[1]
        _look_up(position, grid, self.growth, self.delay, sound_speed / 2, places, told)
        return places, told

    def _integrals(self, probe: Probe, band: Band) -> tuple[NDArray, NDArray]:
        """E, and its derivative with respect to 1/range at a fixed elevation, (CURVATURES, slopes, NODES)."""
        p = probe.si()
        wavenumber = 2 * np.pi * band.frequency / p.sound_speed
        defocus = self.curvature - 1 / p.elevation_focus
        turn = wavenumber.max() * p.height / 2 * (STEEPEST + np.abs(defocus).max() * p.height / 4)
        node, share = np.polynomial.legendre.leggauss(32 + int(turn))
        height = node * p.height / 2
        elevation = self.slope / self.curvature[:, None]
        shape = (len(self.curvature), len(self.slope), len(wavenumber))
        beam, change = np.empty(shape, complex), np.empty(shape, complex)
        for k, number in enumerate(wavenumber):
            bent = share / 2 * np.exp(-1j * number * np.multiply.outer(defocus, height**2 / 2))
            tilted = np.exp(1j * number * np.multiply.outer(height, self.slope))
            zeroth, first, second = ((bent * height**power) @ tilted for power in range(3))
            beam[:, :, k] = zeroth
            change[:, :, k] = -1j * number * (second / 2 - elevation * first)
        return beam, change


@numba.njit(parallel=True, cache=True)
def _look_up(position, grid, growth, delay, half_speed, places, told):
    """Fill the places in the tables, and what they say there by bilinear interpolation.

    Parameters
    ----------
    position : ndarray of shape (n, 3), m
    grid : (float, float, float)
        First curvature and step of curvatures, 1/m, and step of slopes.
    growth, delay : ndarray of shape (CURVATURES, slopes), m and s
    half_speed : float
        m/s.
    places : ndarray of shape (n, 2)
        Written: row and column.
    told : ndarray of shape (n, 4)
        Written: 1/range (1/m), delay as range (m), real and imaginary part of the growth (m).
    """
    rows, columns = growth.shape
    for n in numba.prange(len(position)):
        reach = np.sqrt(position[n, 0] ** 2 + position[n, 1] ** 2)
        row = min(max((1 / reach - grid[0]) / grid[1], 0.0), rows - 1.001)
        column = min(abs(position[n, 2]) / reach / grid[2], columns - 1.001)
        i, j = int(row), int(column)
        down, right = row - i, column - j
        near, far = (1 - down) * (1 - right), down * (1 - right)
        beside, across = (1 - down) * right, down * right
        slope = near * growth[i, j] + far * growth[i + 1, j] + beside * growth[i, j + 1] + across * growth[i + 1, j + 1]
        late = near * delay[i, j] + far * delay[i + 1, j] + beside * delay[i, j + 1] + across * delay[i + 1, j + 1]
        places[n] = row, column
        told[n] = 1 / reach, late * half_speed, slope.real, slope.imag


def _growth(beam: NDArray, change: NDArray, band: Band, centre: float) -> NDArray:
    """Logarithmic derivative: of the amplitude, and of a phase proportional to frequency at the centre, (...)."""
    ratio = band.frequency / centre
    inner = change * beam.conj() * band.weight
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
    """Blocks of samples that pulses (curvatures, slopes, NODES) need."""
    asked = stacked(spectrum)
    energy = (asked**2 @ np.concatenate([band.weight, band.weight])).astype(float)
    allowed = LEFT * energy.max(axis=1, keepdims=True)
    needed = np.full(energy.shape, MOST_BLOCKS, np.uint8)
    for blocks in range(MOST_BLOCKS - 1, 0, -1):
        missed = np.square(asked @ fit(band, blocks, 0.3)[1].T).sum(axis=-1)
        needed[missed <= allowed] = blocks
    needed[energy < FAINT**2] = 0
    return needed
