"""Clusters of scatterers, whose echoes between all elements follow from those between a few, the skeleton.

Scatterers that an array sees at about one angle and range form a cluster. Apart from the delays of its centre, their
echoes change so smoothly from element to element that those of a few skeleton elements determine the others: an
interpolative decomposition (Cheng, Gimbutas, Martinsson, Rokhlin 2005, SIAM J Sci Comput 26:1389) of what echoes a
cluster can have, those in the shadow of a rib included. The full matrix is made between skeleton elements, and
expanded to all pairs after all scatterers of the cluster are in it. Few scatterers are not worth that: their echoes
are made between all elements.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import partial

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from echotruth.arrays import Floats
from echotruth.imaging.rf.kernel import Band
from echotruth.imaging.rf.product import HEIGHT, ROW_PADDING, WIDTH, padded, product
from echotruth.imaging.rf.shadow import Rib
from echotruth.threads import share

SIZE, MIN_SIZE = 0.12, 3.0
"""Width of a cluster in the sine of the angle, in wavelengths over the pitch; at least so many wavelengths over half
the array. Wider clusters are fewer, which saves time in expanding them, and have larger skeletons, which cost time for
every scatterer."""
ELONGATION = 2.0
"""Depth of a cluster in 1/range, in its width over half the array: at the ends of the array, delays then change as much
over its depth as over its width."""
NEAREST = 4.0
"""Half the array over the least range of a cluster; nearer, amplitudes too change much from element to element."""
EXTRA_ELEMENTS = 4
"""Skeleton elements in addition to those that the tolerance requires; their errors average out."""
RIDGE = 4.0
"""Assumed error of an element, over the tolerance; it regularises the interpolation weights."""
FEWEST = 12800
"""Scatterers of a cluster, times elements, from which on its expansion takes less time than their echoes between all
elements."""
SAMPLES, SHADOW_SAMPLES = (4, 1.5), (10, 1.5)
"""Angles, and ranges, at which the echoes of a cluster are sampled, and more of them for each cycle by which its delays
differ at the ends of the array; without and with a rib. The edge of the shadow falls on another part of the array for
each."""
SHADOW_DEPTH = 2.0
"""Range, in depths of the rib, from which on the edge of the shadow moves slower over the array than the scatterers
do; nearer, every element is its own skeleton."""


@dataclass(frozen=True)
class Cluster:
    """A cluster, and how the echoes of all elements follow from those of its skeleton.

    Attributes
    ----------
    skeleton : ndarray of shape (few,)
        Numbers of the skeleton elements, rising.
    weights : ndarray of shape (few, elements)
        Interpolation weights of each of them in every element.
    delay : ndarray of shape (elements,), s
        Delay of the centre of the cluster; removed from the echoes before they are interpolated.
    """

    skeleton: NDArray[np.int64]
    weights: Floats
    delay: Floats

    def remove_delay(self, spectra: NDArray[np.complex64], frequency: Floats) -> None:
        """Take the delays of both elements out of spectra (bins, pairs i <= j of the skeleton) at frequencies, Hz."""
        phase = 2 * np.pi * np.multiply.outer(frequency, self.delay[self.skeleton])
        phasor = (np.cos(phase) + 1j * np.sin(phase)).astype(np.complex64)
        i, j = np.triu_indices(len(self.skeleton))
        spectra *= phasor[:, i] * phasor[:, j]


class Clusters:
    """The clusters that an array sees.

    Parameters
    ----------
    centres : ndarray of shape (elements,), m
        Lateral coordinates of the elements.
    sound_speed : float
        m/s.
    band : Band
        Band of the pulse.
    max_range : float
        Greatest range, m.
    tolerance : float
        Relative error (L2) of the echoes that are interpolated.
    """

    _rib: Rib | None = None

    def __init__(self, centres: Floats, sound_speed: float, band: Band, max_range: float, tolerance: float) -> None:
        self._centres, self._speed, self._band, self._tolerance = centres, sound_speed, band, tolerance
        half_aperture = (centres[-1] - centres[0]) / 2
        wavelength = sound_speed / (band.frequency @ band.weight)
        size = wavelength * max(SIZE / (centres[1] - centres[0]), MIN_SIZE / half_aperture)
        self._step, self._cycles = (
            np.array([size, ELONGATION * size / half_aperture]),
            size * half_aperture / wavelength,
        )
        self._min_curvature = 1 / max_range
        # Nearer than that every element is its own skeleton.
        self._rows = int(np.ceil((NEAREST / half_aperture - self._min_curvature) / self._step[1]))
        self._sectors = int(np.ceil(2 / size))
        self._clusters: dict[int, Cluster] = {}

    def behind(self, rib: Rib) -> Clusters:
        """The clusters that the array sees behind a rib."""
        clusters = copy(self)
        clusters._rib, clusters._clusters = rib, {}
        return clusters

    def numbers(self, position: Floats) -> NDArray[np.int64]:
        """Number of the cluster of each scatterer at a position (n, 3), m: (n,)."""
        range_ = np.linalg.norm(position, axis=1)
        sector = np.clip((position[:, 0] / range_ + 1) / 2 * self._sectors, 0, self._sectors - 1).astype(np.int64)
        row = np.maximum((1 / range_ - self._min_curvature) / self._step[1], 0).astype(np.int64)
        far = row < self._rows
        if self._rib:
            far &= position[:, 1] > SHADOW_DEPTH * self._rib.depth
        return np.where(far, row * self._sectors + sector, self._rows * self._sectors)

    def worth_expanding(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of the clusters of all scatterers (n,), the greatest in place of those that have too few."""
        found, cluster, count = np.unique(numbers, return_inverse=True, return_counts=True)
        return np.where(count * len(self._centres) < FEWEST, self._rows * self._sectors, found)[cluster]

    def __getitem__(self, number: int) -> Cluster:
        """The cluster of a number; the skeleton of the greatest are all elements."""
        if number not in self._clusters:
            self._clusters[number] = self._decomposed(number)
        return self._clusters[number]

    def _decomposed(self, number: int) -> Cluster:
        if number == self._rows * self._sectors:
            elements = len(self._centres)
            return Cluster(np.arange(elements), np.eye(elements), np.zeros(elements))
        row, sector = divmod(number, self._sectors)
        least, more = SHADOW_SAMPLES if self._rib else SAMPLES
        samples = int(least + more * self._cycles)
        node = -np.cos(np.pi * (np.arange(samples) + 0.5) / samples)
        curvature, sine = np.meshgrid(
            self._min_curvature + (row + 0.5 + node / 2) * self._step[1],
            ((sector + 0.5 + node / 2) / self._sectors) * 2 - 1,
        )
        centre = np.array([self._min_curvature + (row + 0.5) * self._step[1], (sector + 0.5) / self._sectors * 2 - 1])
        delay = self._delays(*centre[:, None])
        late = self._delays(curvature.ravel(), sine.ravel()) - delay
        phase = np.multiply.outer(late, 2 * np.pi * self._band.frequency)
        echoes = np.exp(1j * phase) * np.sqrt(self._band.weight / curvature.size)
        if self._rib:
            position = np.stack([sine, np.sqrt(1 - sine**2), np.zeros_like(sine)], axis=-1) / curvature[..., None]
            echoes *= self._rib.transmission(position.reshape(-1, 3), self._centres).T[..., None]
        echoes = echoes.reshape(len(delay), -1)
        skeleton, weights = _decomposition(np.concatenate([echoes.real, echoes.imag], axis=1), self._tolerance)
        return Cluster(skeleton, weights, delay[:, 0])

    def _delays(self, curvature: Floats, sine: Floats) -> Floats:
        """One-way delays relative to the array centre, (elements, n), s, for 1/range (n,) and sine of the angle (n,).

        Written to avoid cancellation at large range.
        """
        range_ = 1 / curvature
        longer = self._centres[:, None] ** 2 - 2 * np.multiply.outer(self._centres, range_ * sine)
        return longer / (np.sqrt(range_**2 + longer) + range_) / self._speed


def _decomposition(echoes: Floats, tolerance: float) -> tuple[NDArray[np.int64], Floats]:
    """Skeleton rows of a matrix (n, samples), rising, and their weights (few, n), for a mean error of all rows.

    The rows are those of a QR decomposition with pivoting, and `EXTRA_ELEMENTS`. The weights fit all rows by least
    squares and are held small (ridge), so that they do not raise what the rows err by themselves.
    """
    triangle, order = linalg.qr(echoes.T, mode="r", pivoting=True)
    error = np.sqrt(np.square(triangle[: len(order)]).sum(axis=1)[::-1].cumsum()[::-1] / len(order))
    rows = np.sort(order[: (error > tolerance).sum() + EXTRA_ELEMENTS])
    product = echoes @ echoes.T
    ridge = (RIDGE * tolerance) ** 2 * np.eye(len(rows))
    return rows, linalg.solve(product[np.ix_(rows, rows)] + ridge, product[rows], assume_a="pos")


def add_expanded(
    matrix: NDArray[np.complex64], clusters: list[Cluster], frequency: Floats, spectra: NDArray[np.complex64]
) -> None:
    """Add the echoes of all pairs of elements, from those between the skeleton elements of some clusters.

    Parameters
    ----------
    matrix : ndarray of shape (bins, elements, elements), complex64
        Added to.
    clusters : list of Cluster
    frequency : ndarray of shape (bins,), Hz
    spectra : ndarray of shape (bins, pairs), complex64
        Spectra of the pairs of skeleton elements without their delays, cluster by cluster.
    """
    sizes, elements = np.array([len(cluster.skeleton) for cluster in clusters]), matrix.shape[1]
    rows = padded(sizes, HEIGHT)
    weights = np.zeros((rows.sum(), padded(elements) + ROW_PADDING), np.float32)
    for cluster, size, start in zip(clusters, sizes, np.cumsum(rows) - rows, strict=True):
        weights[start : start + size, :elements] = cluster.weights
    phase = -2 * np.pi * np.multiply.outer(frequency, np.stack([cluster.delay for cluster in clusters]))
    phasor = np.zeros((len(frequency), len(clusters), 2, padded(elements)), np.float32)
    phasor[..., :elements] = np.stack([np.cos(phase), np.sin(phase)], axis=2)
    share(partial(expand, spectra, sizes, weights, phasor, matrix), len(spectra))


@numba.njit(nogil=True, cache=True)
def expand(spectra, sizes, weights, phasor, matrix, bins):
    """Add the echoes of all pairs of elements, summed over clusters.

    A cluster of skeleton echoes M without their delays, weights W and phasors z = exp(-2 pi i f delay) adds
    diag(z) W^T M W diag(z).

    Parameters
    ----------
    spectra
        Shape (bins, pairs), complex64: of the pairs i <= j of the skeleton of every cluster, one after the other.
    sizes
        Elements of the skeleton of each cluster, shape (clusters,).
    weights
        Shape (rows, width + ROW_PADDING), float32; the rows of a cluster are filled up to a multiple of HEIGHT.
    phasor
        Real and imaginary part of z for each cluster, shape (bins, clusters, 2, width), float32; as many columns as
        elements or more.
    matrix
        Added to: shape (bins, elements, elements), complex64.
    bins
        First bin to be added to, and the one after the last.
    """
    width, count = phasor.shape[3], matrix.shape[1]
    echoes = np.empty((2, width, width), np.float32)
    for f in range(*bins):
        total, row, pair = np.zeros((2, width, width), np.float32), 0, 0
        for k in range(len(sizes)):
            rows = -(-sizes[k] // HEIGHT) * HEIGHT
            own, few = weights[row : row + rows], np.zeros((2, rows, rows), np.float32)
            half = np.empty((rows, width), np.float32)
            for i in range(sizes[k]):
                for j in range(i, sizes[k]):
                    few[0, i, j] = few[0, j, i] = spectra[f, pair].real
                    few[1, i, j] = few[1, j, i] = spectra[f, pair].imag
                    pair += 1
            for part in range(2):
                product(few[part], own, half)
                product(own, half, echoes[part], True)
            add_delayed(echoes, phasor[f, k, 0], phasor[f, k, 1], total)
            row += rows
        for i in range(count):
            for j in range(i, count):
                matrix[f, i, j] += np.complex64(complex(total[0, i, j], total[1, i, j]))
                matrix[f, j, i] = matrix[f, i, j]


@numba.njit(cache=True)
def add_delayed(echoes, c, s, total):
    """Add E_ij z_i z_j, z = c + i s, to the upper triangle of a total; E and it (2, n, n): real and imaginary parts."""
    for i in range(len(c)):
        # From the tile on in which the diagonal is, as compilers vectorise whole ones.
        n = i // WIDTH * WIDTH
        real, imaginary = total[0, i, n:], total[1, i, n:]
        add_turned(echoes[0, i, n:], echoes[1, i, n:], c[n:], s[n:], c[i], s[i], real, imaginary)


@numba.njit(cache=True)
def add_turned(a, b, c, s, p, q, real, imaginary):
    """Add (a + i b) (c + i s) (p + i q), p and q being numbers, to real + i imaginary."""
    for j in range(len(c)):
        cosine, sine = c[j] * p - s[j] * q, c[j] * q + s[j] * p
        real[j] += a[j] * cosine - b[j] * sine
        imaginary[j] += a[j] * sine + b[j] * cosine
