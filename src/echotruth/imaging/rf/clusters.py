"""Clusters of scatterers, whose echoes to all elements follow from those to a few.

Scatterers that an array sees at about one angle and range form a cluster. Apart from the delays of its middle, their
echoes change so smoothly from element to element that those to a few elements determine the others: an interpolative
decomposition (Cheng, Gimbutas, Martinsson, Rokhlin 2005, SIAM J Sci Comput 26:1389) of what echoes a cluster can have.
The full matrix is made for these elements, and carried to all pairs after all scatterers of the cluster are in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from echotruth.arrays import Floats
from echotruth.imaging.rf.kernel import Band
from echotruth.imaging.rf.product import HEIGHT, padded, product

SIZE = 3.0
"""Width of a cluster in the sine of the angle, in wavelengths over half the array; and its depth in 1/range, in
wavelengths over the square of that."""
MORE = 4
"""Elements taken beyond those that are needed, so that their errors level out."""
RIDGE = 4.0
"""Error of an element that its weights are to expect, over the tolerance."""
SAMPLES = 6
"""Angles, and ranges, at which the echoes of a cluster are sampled."""


@dataclass(frozen=True)
class Cluster:
    """A cluster, and how the echoes to all elements follow from those to a few.

    Attributes
    ----------
    elements : ndarray of shape (few,)
        Numbers of these elements, rising.
    weights : ndarray of shape (few, elements)
        Of each of them in every element.
    delay : ndarray of shape (elements,), s
        Of the middle of the cluster; taken out of the echoes before they are weighted.
    """

    elements: NDArray[np.int64]
    weights: Floats
    delay: Floats


class Clusters:
    """The clusters that an array sees.

    Parameters
    ----------
    centres : ndarray of shape (elements,), m
        Of the elements.
    sound_speed : float
        m/s.
    band : Band
        Of the pulse.
    reach : float
        Greatest range, m.
    tolerance : float
        Relative error (L2) of the echoes that follow from others.
    """

    def __init__(self, centres: Floats, sound_speed: float, band: Band, reach: float, tolerance: float) -> None:
        self._centres, self._speed, self._band, self._tolerance = centres, sound_speed, band, tolerance
        half = (centres[-1] - centres[0]) / 2
        size = SIZE * sound_speed / (band.frequency @ band.weight) / half
        self._step = np.array([size, size / half])
        self._farthest = 1 / reach
        # Nearer than half an array every element has echoes of its own.
        self._rows = int(np.ceil((1 / half - self._farthest) / self._step[1]))
        self._sectors = int(np.ceil(2 / size))
        self._known: dict[int, Cluster] = {}

    def numbers(self, position: Floats) -> NDArray[np.int64]:
        """Number of the cluster of each scatterer at a position (n, 3), m: (n,)."""
        reach = np.linalg.norm(position, axis=1)
        sector = np.clip((position[:, 0] / reach + 1) / 2 * self._sectors, 0, self._sectors - 1).astype(np.int64)
        row = np.maximum((1 / reach - self._farthest) / self._step[1], 0).astype(np.int64)
        return np.where(row < self._rows, row * self._sectors + sector, self._rows * self._sectors)

    def __getitem__(self, number: int) -> Cluster:
        """The cluster of a number; that of the greatest has all elements."""
        if number not in self._known:
            near = number == self._rows * self._sectors
            self._known[number] = self._whole() if near else self._decomposed(number)
        return self._known[number]

    def _whole(self) -> Cluster:
        elements = len(self._centres)
        return Cluster(np.arange(elements), np.eye(elements), np.zeros(elements))

    def _decomposed(self, number: int) -> Cluster:
        row, sector = divmod(number, self._sectors)
        node = -np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
        near, sine = np.meshgrid(
            self._farthest + (row + 0.5 + node / 2) * self._step[1], ((sector + 0.5 + node / 2) / self._sectors) * 2 - 1
        )
        middle = np.array([self._farthest + (row + 0.5) * self._step[1], (sector + 0.5) / self._sectors * 2 - 1])
        delay = self._delays(*middle[:, None])
        late = self._delays(near.ravel(), sine.ravel()) - delay
        turn = np.multiply.outer(late, 2 * np.pi * self._band.frequency)
        echoes = (np.exp(1j * turn) * np.sqrt(self._band.weight / near.size)).reshape(len(delay), -1)
        elements, weights = _decomposition(np.concatenate([echoes.real, echoes.imag], axis=1), self._tolerance)
        return Cluster(elements, weights, delay[:, 0])

    def _delays(self, curvature: Floats, sine: Floats) -> Floats:
        """Of echoes on one way, less that to the centre of the array, (elements, n), s; of 1/range (n,) and sine (n,).

        Worked out so that no difference of like numbers is taken far away.
        """
        reach = 1 / curvature
        longer = self._centres[:, None] ** 2 - 2 * np.multiply.outer(self._centres, reach * sine)
        return longer / (np.sqrt(reach**2 + longer) + reach) / self._speed


def _decomposition(echoes: Floats, tolerance: float) -> tuple[NDArray[np.int64], Floats]:
    """Rows of a matrix (n, samples), rising, and their weights (few, n) in all rows, for a mean error of a row.

    The rows are those of a QR decomposition with pivoting, and `MORE`. The weights fit all rows by least squares and
    are held small (ridge), so that they do not raise what the rows err by themselves.
    """
    triangle, order = linalg.qr(echoes.T, mode="r", pivoting=True)
    left = np.sqrt(np.square(triangle[: len(order)]).sum(axis=1)[::-1].cumsum()[::-1] / len(order))
    rows = np.sort(order[: (left > tolerance).sum() + MORE])
    product = echoes @ echoes.T
    ridge = (RIDGE * tolerance) ** 2 * np.eye(len(rows))
    return rows, linalg.solve(product[np.ix_(rows, rows)] + ridge, product[rows], assume_a="pos")


class Spread:
    """Carries the echoes of some clusters to all pairs of elements.

    Parameters
    ----------
    clusters : list of Cluster
    frequency : ndarray of shape (bins,), Hz
    """

    def __init__(self, clusters: list[Cluster], frequency: Floats) -> None:
        sizes = [padded(len(each.elements), HEIGHT) for each in clusters]
        self._count = len(clusters[0].delay)
        self._first = np.concatenate([[0], np.cumsum(sizes)])
        self._weights = np.zeros((self._first[-1], padded(self._count)), np.float32)
        self._elements = np.full(self._first[-1], -1)
        for first, each in zip(self._first, clusters, strict=False):
            rows = slice(first, first + len(each.elements))
            self._weights[rows, : self._count], self._elements[rows] = each.weights, each.elements
        delay = np.stack([each.delay for each in clusters])
        turn = -2 * np.pi * np.multiply.outer(frequency, delay)
        self._turn = np.zeros((len(frequency), len(clusters), 2, padded(self._count)), np.float32)
        self._turn[..., : self._count] = np.stack([np.cos(turn), np.sin(turn)], axis=2)

    def __call__(self, spectra: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Spectra of the echoes of all pairs (bins, elements, elements).

        Parameters
        ----------
        spectra : ndarray of shape (bins, pairs), complex64
            Of the pairs of elements of every cluster, one after the other.
        """
        matrix = np.empty((len(spectra), self._count, self._count), np.complex64)
        spread(spectra, self._first, self._elements, self._weights, self._turn, matrix)
        return matrix


@numba.njit(parallel=True, cache=True)
def spread(spectra, first, elements, weights, turn, matrix):
    """Write the echoes of all pairs of elements, summed over clusters.

    Parameters
    ----------
    spectra
        Shape (bins, pairs), complex64: of the pairs i <= j of the elements of every cluster, one after the other.
    first
        Row of the weights where each cluster begins, and their number: shape (clusters + 1,).
    elements
        Number of the element of every row, -1 where it is only there to fill, shape (rows,).
    weights
        Shape (rows, width), float32, as many columns as elements or more.
    turn
        By the delays of the middle of each cluster, real and imaginary part, shape (bins, clusters, 2, width), float32.
    matrix
        Written: shape (bins, elements, elements), complex64.
    """
    width, count = weights.shape[1], matrix.shape[1]
    for f in numba.prange(len(spectra)):
        real, imaginary = np.empty((width, width), np.float32), np.empty((width, width), np.float32)
        pair = 0
        for k in range(len(first) - 1):
            some, size = weights[first[k] : first[k + 1]], first[k + 1] - first[k]
            c, s = turn[f, k]
            a, b = np.zeros((size, size), np.float32), np.zeros((size, size), np.float32)
            pair += align(spectra[f, pair:], elements[first[k] : first[k + 1]], c, s, a, b)
            between, carry = np.empty((2, size, width), np.float32), np.empty((2 * size, width), np.float32)
            product(a, some, between[0])
            product(b, some, between[1])
            # What carries them from the few elements to all, and is summed over these for real and imaginary part.
            echoes = np.empty((2, 2 * size, width), np.float32)
            for n in range(size):
                weigh(some[n], c, s, carry[n], carry[size + n])
                delay(between[0, n], between[1, n], c, s, echoes[0, n], echoes[1, n])
                turn_back(echoes[0, n], echoes[1, n], echoes[1, size + n], echoes[0, size + n])
            product(carry, echoes[0], real, True, k > 0)
            product(carry, echoes[1], imaginary, True, k > 0)
        for i in range(count):
            for j in range(i, count):
                matrix[f, i, j] = complex(real[i, j], imaginary[i, j])
                matrix[f, j, i] = matrix[f, i, j]


@numba.njit(cache=True)
def align(spectra, elements, c, s, real, imaginary):
    """Take the delays of a cluster out of the echoes of its pairs (pairs,): (elements, elements). Returns the pairs."""
    pair = 0
    for i in range(len(elements)):
        if elements[i] < 0:
            break
        for j in range(i, len(elements)):
            if elements[j] < 0:
                break
            m, n = elements[i], elements[j]
            p, q = c[m] * c[n] - s[m] * s[n], c[m] * s[n] + s[m] * c[n]
            value = spectra[pair]
            real[i, j] = real[j, i] = value.real * p + value.imag * q
            imaginary[i, j] = imaginary[j, i] = value.imag * p - value.real * q
            pair += 1
    return pair


@numba.njit(cache=True)
def weigh(weights, c, s, real, imaginary):
    """Write the products of weights with c and with s."""
    for j in range(len(c)):
        real[j] = weights[j] * c[j]
    for j in range(len(c)):
        imaginary[j] = weights[j] * s[j]


@numba.njit(cache=True)
def delay(one, other, c, s, real, imaginary):
    """Put the delays of a cluster back into the echoes of an element with all others: (one + i other) (c + i s)."""
    for j in range(len(c)):
        real[j] = one[j] * c[j] - other[j] * s[j]
    for j in range(len(c)):
        imaginary[j] = one[j] * s[j] + other[j] * c[j]


@numba.njit(cache=True)
def turn_back(real, imaginary, one, other):
    """Write i times a number: its imaginary part is the real one, its real part the imaginary one with another sign."""
    for j in range(len(real)):
        one[j], other[j] = real[j], -imaginary[j]
