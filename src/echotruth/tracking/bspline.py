"""Cubic B-splines in the plane, with knots only where they reach the wall.

A field is the sum of coefficients times products of cubic B-splines, one along each axis, on a square lattice of knots.
A point lies in one cell of the lattice and sees the 4 x 4 knots around it. One thread takes all sums, in one order, so
the bytes are the same wherever they are made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from echotruth.tracking import cubic


@dataclass(frozen=True)
class Cells:
    """Points sorted by the cell of the lattice they lie in.

    Attributes
    ----------
    knots : ndarray of shape (cell, 16)
        Numbers of the knots that a cell sees, lateral fastest; -1 where there is none.
    first : ndarray of shape (cell + 1,)
        First point of every cell; the last entry is the number of points.
    fraction : ndarray of shape (point, 2)
        Of the way through the cell: lateral, axial.
    across, down : ndarray of shape (point, 4), float64
        Shares of the four columns and rows of knots at every point.
    """

    knots: np.ndarray
    first: np.ndarray
    fraction: np.ndarray
    across: np.ndarray
    down: np.ndarray

    def evaluate(self, coefficients: np.ndarray) -> np.ndarray:
        """Fields at the points: coefficients (knot, field) to values (point, field); all knots must be there."""
        values = np.empty((len(self.across), coefficients.shape[1]))
        _evaluate(self.knots, self.first, self.across, self.down, np.ascontiguousarray(coefficients), values)
        return values

    def gather(self, values: np.ndarray, size: int) -> np.ndarray:
        """Sums over the points weighted by the splines: values (point, field) to sums (knot, field) of all knots."""
        sums = np.zeros((size, values.shape[1]))
        _gather(self.knots, self.first, self.across, self.down, np.ascontiguousarray(values), sums)
        return sums


@dataclass(frozen=True)
class Lattice:
    """Knots of a field.

    Attributes
    ----------
    step : float
        Distance of the knots, px.
    number : ndarray of shape (rows, columns)
        Number of every knot, counted along the shorter side; -1 where the knot is not wanted.
    origin : ndarray of shape (2,)
        Place of the first knot: lateral, axial, px.
    """

    step: float
    number: np.ndarray
    origin: np.ndarray

    @property
    def size(self) -> int:
        """Number of wanted knots."""
        return int(self.number.max()) + 1

    def corners(self, points: np.ndarray) -> np.ndarray:
        """Column and row of the knot before each of the points (n, 2); the outermost cell beyond the lattice."""
        cell = np.floor((points - self.origin) / self.step)
        return np.clip(cell, 1, np.array(self.number.shape[::-1]) - 3).astype(int)

    def cells(self, points: np.ndarray) -> tuple[Cells, np.ndarray]:
        """Points by the cell they lie in.

        Parameters
        ----------
        points : ndarray of shape (n, 2)
            Lateral, axial, px.

        Returns
        -------
        Cells
            Of the points in their new order.
        order : ndarray of shape (n,)
            Which point comes where.
        """
        corner = self.corners(points)
        cell = corner[:, 1] * self.number.shape[1] + corner[:, 0]
        order = np.argsort(cell, kind="stable")
        every, first = np.unique(cell[order], return_index=True)
        row, column = np.divmod(every, self.number.shape[1])
        around = np.arange(-1, 3)
        knots = self.number[row[:, None, None] + around[:, None], column[:, None, None] + around]
        fraction = ((points - self.origin) / self.step - corner)[order]
        across, down = (np.stack(cubic.shares(each), -1) for each in fraction.T)
        return Cells(knots.reshape(-1, 16), np.append(first, len(points)), fraction, across, down), order

    def affine(self) -> np.ndarray:
        """Coefficients, shape (2 size, 6), of the two shifts and of the four motions in proportion to the place.

        Unknown 2 k + c is component c of knot k; the place of a knot, the middle of the lattice being 0 and half its
        longer side 1, is itself the coefficient of such a motion.
        """
        row, column = np.nonzero(self.number >= 0)
        place = np.empty((self.size, 2))
        place[self.number[row, column]] = np.stack([column, row], -1)
        place = (place - (np.array(self.number.shape[::-1]) - 1) / 2) / (max(self.number.shape) / 2)
        motions = np.column_stack([np.ones(self.size), place])
        return np.kron(motions, np.eye(2))

    def at(self, coefficients: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Fields at points.

        Parameters
        ----------
        coefficients : ndarray of shape (knot, field)
            Of any unit.
        points : ndarray of shape (n, 2)
            Lateral, axial, px.

        Returns
        -------
        ndarray of shape (n, field)
            NaN where the fields do not reach: a knot that the point sees is not there, or NaN.
        """
        inside = (np.abs(self._middle - points) <= self._half).all(1)
        cells, order = self.cells(np.where(inside[:, None], points, self._middle))
        known = np.repeat((cells.knots >= 0).all(1), np.diff(cells.first)) & inside[order]
        result = np.full((len(points), coefficients.shape[1]), np.nan)
        # Where a knot is not there another takes its place, but the result is not kept.
        result[order[known]] = cells.evaluate(coefficients)[known]
        return result

    @property
    def _half(self) -> np.ndarray:
        return (np.array(self.number.shape[::-1]) - 3) * self.step / 2 + 1e-9

    @property
    def _middle(self) -> np.ndarray:
        return self.origin + (np.array(self.number.shape[::-1]) - 1) * self.step / 2


def lattice(places: np.ndarray, step: float) -> Lattice:
    """Knots whose splines reach some places, centred on these.

    Parameters
    ----------
    places : ndarray of shape (n, 2)
        Lateral, axial, px; one at least.
    step : float
        Distance of the knots, px.

    Returns
    -------
    Lattice
    """
    low, high = places.min(0), places.max(0)
    spans = np.maximum(np.ceil((high - low) / step).astype(int), 1)
    shape = tuple(spans[::-1] + 3)
    every = Lattice(step, np.zeros(shape, int), (low + high) / 2 - (spans / 2 + 1) * step)
    corner = every.corners(places)
    wanted = np.zeros(shape, bool)
    for i, j in np.ndindex(4, 4):
        wanted[corner[:, 1] + i - 1, corner[:, 0] + j - 1] = True
    # Counted along the shorter side, so that knots which see each other have numbers close together.
    number = np.where(wanted, np.cumsum(wanted).reshape(shape), 0) - 1
    if shape[0] < shape[1]:
        number = np.where(wanted, np.cumsum(wanted.T).reshape(shape[::-1]).T, 0) - 1
    return Lattice(step, number, every.origin)


@numba.njit(cache=True, nogil=True)
def _evaluate(knots, first, across, down, coefficients, values):
    own = np.empty((4, 4))
    for cell in range(len(knots)):
        for field in range(values.shape[1]):
            for k in range(16):
                own[k // 4, k % 4] = coefficients[knots[cell, k], field]
            for point in range(first[cell], first[cell + 1]):
                total = 0.0
                for i in range(4):
                    row = 0.0
                    for j in range(4):
                        row += across[point, j] * own[i, j]
                    total += down[point, i] * row
                values[point, field] = total


@numba.njit(cache=True, nogil=True)
def _gather(knots, first, across, down, values, sums):
    own = np.empty((4, 4))
    for cell in range(len(knots)):
        for field in range(values.shape[1]):
            own[:] = 0
            for point in range(first[cell], first[cell + 1]):
                for i in range(4):
                    share = down[point, i] * values[point, field]
                    for j in range(4):
                        own[i, j] += share * across[point, j]
            for k in range(16):
                sums[knots[cell, k], field] += own[k // 4, k % 4]
