"""The beam in elevation: what a lens does to an echo from beside the plane of the image.

An element of height H with a lens of focus F hears a point at elevation y and range r in the plane through the
Fresnel integral E(f) = 1/H int exp(-i k [h^2/2 (1/r - 1/F) - h y/r]) dh over its height, k = 2 pi f / c, relative to
the straight path to its centre (Goodman, Introduction to Fourier Optics, section 4.2). A pair hears E_i E_j. For each
element E is taken at the range from the centre of the array, its delay apart, and corrected to first order in 1/r. Near
the array, where its elements see a scatterer at ranges too different for that, it is taken at those from the centres of
a few parts of the array.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.rf.kernel import Band, fit, stacked

LEFT_OUT = 1.3e-4
"""Energy of the echoes that are left out beside the beam, over that of all echoes from scatterers at the same range."""
MOST_BLOCKS = 4
"""Blocks of samples that the longest echoes get; what is longer is cut."""
LEFT = 3e-5
"""Energy that a kernel may miss, over that of an echo from the plane at the same range."""
CURVATURES = 192
STEEPEST = 1.0
"""Greatest elevation over range."""
ENOUGH = 24
"""Slopes tabulated per wavelength over height."""
WIDEST_PART = 0.17
"""Greatest product of the Fresnel number H^2 / (4 lambda r) of an element and the square of half the width of a part
over the range r: what is left of E beyond the first order is then about 1 %."""
MOST_PARTS = 2
"""Of the array."""
CUT = 1e-2
"""What a kernel may miss, over the echo from the plane at the same range, where echoes count as accurate."""


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
    beam : ndarray of shape (CURVATURES, slopes, NODES), complex64
        E at the frequencies of the band, without its delay.
    delay : ndarray of shape (CURVATURES, slopes), s
        Taken out of it.
    change : ndarray of shape (CURVATURES, slopes, NODES), complex64, m
        Derivative of E with respect to 1/range, less what the growth makes of E, likewise.
    growth : ndarray of shape (CURVATURES, slopes), m
        g: real part that of the amplitude, imaginary part that of the phase.
    blocks : ndarray of shape (CURVATURES, slopes), uint8
        Blocks of samples that an echo needs.
    edge : ndarray of shape (CURVATURES,)
        Slope at which the beam ends: scatterers evenly spread beyond it together have the share `LEFT_OUT` of the
        energy of all at that range.
    accurate_from : float, m
        Range from which on no kernel is cut by more than `CUT`, and `MOST_PARTS` of the array are enough.
    """

    def __init__(self, probe: Probe, reach: float, band: Band) -> None:
        p = probe.si()
        slopes = int(ENOUGH * STEEPEST * p.height * p.frequency / p.sound_speed) + 2
        self.slope = np.linspace(0, STEEPEST, slopes)
        self.curvature = np.linspace(min(1 / reach, 1 / p.height), 2 / p.height, CURVATURES)
        beam, change = self._integrals(probe, band)
        turn = 2 * np.pi * p.frequency
        self.growth = _growth(beam, change, band, p.frequency)
        self.delay = _delays(beam**2, band) / 2
        # Traces will be damped by their time, and the loss goes by the way: so much the lens must not be damped.
        undamped = band.loss + 2j * np.pi * band.frequency
        turned = np.exp(np.multiply.outer(self.delay, undamped))
        change -= (self.growth.real[..., None] + np.multiply.outer(self.growth.imag, undamped / turn)) * beam
        self.change = (turned * change).astype(np.complex64)
        self.beam = (turned * beam).astype(np.complex64)
        self.blocks, missed = _blocks(self.beam**2, band)
        self.edge = _edge(self.beam**2, band, self.slope)
        self._elements, self._half = p.elements, p.elements * p.pitch / 2
        self._number = p.height**2 * p.frequency / (4 * p.sound_speed)
        longest = np.cbrt(self._number * self._half**2 / (WIDEST_PART * MOST_PARTS**2))
        self.accurate_from = float(max(longest, *1 / self.curvature[missed > CUT], 0.0))

    def places(self, position: Floats) -> Floats:
        """Rows and columns of scatterers (n, 3), m, in the tables: (n, 2), within them."""
        return self.lean(position, 1.0)[0][:, 0]

    def in_beam(self, position: Floats) -> NDArray[np.bool_]:
        """Which scatterers at positions (n, 3), m, are within the beam, (n,)."""
        curvature = 1 / np.hypot(position[:, 0], position[:, 1])
        return np.abs(position[:, 2]) * curvature <= np.interp(curvature, self.curvature, self.edge)

    def blocks_at(self, places: Floats) -> NDArray[np.int64]:
        """Blocks of samples that echoes at places (..., 2) in the tables need: (...)."""
        place = np.rint(places).astype(np.intp)
        return self.blocks[place[..., 0], place[..., 1]].astype(np.int64)

    def parts(self, reach: Floats) -> NDArray[np.int64]:
        """Parts of the array from which scatterers at ranges (n,), m, are looked up apart: (n,)."""
        needed = np.sqrt(self._number * self._half**2 / (WIDEST_PART * reach**3))
        return np.clip(np.ceil(needed), 1, min(MOST_PARTS, self._elements)).astype(np.int64)

    def lean(self, position: Floats, sound_speed: float, parts: int = 1) -> tuple[Floats, Floats]:
        """Places of scatterers (n, 3), m, in the tables, (n, parts, 2), from the centre of each part of the array, and
        what :func:`~echotruth.imaging.rf.spreading.one_way` wants to know of them, (n, parts, 4)."""
        places, told = np.empty((len(position), parts, 2)), np.empty((len(position), parts, 4))
        grid = self.curvature[0], self.curvature[1] - self.curvature[0], self.slope[1]
        first = bounds(self._elements, parts)
        middles = ((first[1:] + first[:-1]) / self._elements - 1) * self._half
        _look_up(position, middles, grid, self.growth, self.delay, sound_speed, places, told)
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


def bounds(elements: int, parts: int) -> NDArray[np.int64]:
    """First element of every part of an array, and the number of elements, (parts + 1,): part e parts // elements."""
    return -(-np.arange(parts + 1) * elements // parts)


@numba.njit(parallel=True, cache=True)
def _look_up(position, middles, grid, growth, delay, speed, places, told):
    """Fill the places in the tables, and what they say there by bilinear interpolation.

    Parameters
    ----------
    position : ndarray of shape (n, 3), m
    middles : ndarray of shape (parts,), m
        Lateral coordinates of the centres of the parts of the array.
    grid : (float, float, float)
        First curvature and step of curvatures, 1/m, and step of slopes.
    growth, delay : ndarray of shape (CURVATURES, slopes), m and s
    speed : float
        m/s.
    places : ndarray of shape (n, parts, 2)
        Written: row and column.
    told : ndarray of shape (n, parts, 4)
        Written: 1/range (1/m), delay as range (m), real and imaginary part of the growth (m).
    """
    rows, columns = growth.shape
    for n in numba.prange(len(position)):
        for part in range(len(middles)):
            reach = np.sqrt((position[n, 0] - middles[part]) ** 2 + position[n, 1] ** 2)
            row = min(max((1 / reach - grid[0]) / grid[1], 0.0), rows - 1.001)
            column = min(abs(position[n, 2]) / reach / grid[2], columns - 1.001)
            i, j = int(row), int(column)
            down, right = row - i, column - j
            near, far = (1 - down) * (1 - right), down * (1 - right)
            beside, across = (1 - down) * right, down * right
            slope = near * growth[i, j] + far * growth[i + 1, j]
            slope += beside * growth[i, j + 1] + across * growth[i + 1, j + 1]
            late = near * delay[i, j] + far * delay[i + 1, j] + beside * delay[i, j + 1] + across * delay[i + 1, j + 1]
            places[n, part] = row, column
            told[n, part] = 1 / reach, late * speed, slope.real, slope.imag


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


def _blocks(spectrum: NDArray, band: Band) -> tuple[NDArray[np.uint8], Floats]:
    """Blocks of samples that pulses (curvatures, slopes, NODES) need; and what the longest kernel misses of those at a
    curvature, at most, over the echo from the plane there: (curvatures,)."""
    asked = stacked(spectrum)
    energy = (asked**2 @ np.concatenate([band.weight, band.weight])).astype(float)
    greatest = energy.max(axis=1, keepdims=True)
    needed = np.full(energy.shape, MOST_BLOCKS, np.uint8)
    left = [np.square(asked @ fit(band, blocks, 0.3)[1].T).sum(axis=-1) for blocks in range(1, MOST_BLOCKS + 1)]
    for blocks in range(MOST_BLOCKS - 1, 0, -1):
        needed[left[blocks - 1] <= LEFT * greatest] = blocks
    return needed, np.sqrt((left[-1] / greatest).max(axis=1))


def _edge(spectrum: NDArray, band: Band, slope: Floats) -> Floats:
    """Slope beyond which scatterers evenly spread over elevation have the share `LEFT_OUT` of the energy of all.

    Of pulses (curvatures, slopes, NODES): (curvatures,).
    """
    energy = (np.abs(spectrum) ** 2 * band.weight).sum(axis=-1)
    outside = energy[:, ::-1].cumsum(axis=1)[:, ::-1] / energy.sum(axis=1, keepdims=True)
    return slope[np.minimum((outside > LEFT_OUT).sum(axis=1), len(slope) - 1)]
