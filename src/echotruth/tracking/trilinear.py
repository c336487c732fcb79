"""Trilinear fields on a cubic lattice, with knots only where they affect the wall of a volume.

A field is u(x) = sum_k c_k h(x - x_k), with the product h of a hat function along each axis: a B-spline of first order.
It has the methods of :mod:`.bspline`, and 8 knots around a point in place of the 64 of a cubic one.
"""

from dataclasses import dataclass
from itertools import product

import numba
import numpy as np
from scipy import sparse

CORNERS = np.array(list(product((0, 1), repeat=3)))
"""Knots around a cell, as steps along the three axes; (8, 3)."""


@dataclass(frozen=True)
class TrilinearCells:
    """Points sorted by the cell of the lattice that contains them.

    Attributes
    ----------
    knots : ndarray of shape (cell, 8)
        Index of the knots around each cell; -1 for unused knots.
    offsets : ndarray of shape (cell + 1,)
        First point of each cell; the last entry is the number of points.
    weights : ndarray of shape (point, 8)
        Basis functions of the knots around each point.
    """

    knots: np.ndarray
    offsets: np.ndarray
    weights: np.ndarray

    def evaluate(self, coefficients: np.ndarray) -> np.ndarray:
        """Values (point, field) of fields with coefficients (knot, field); all knots must be in use."""
        values = np.empty((len(self.weights), coefficients.shape[1]))
        _evaluate(self.knots, self.offsets, self.weights, np.ascontiguousarray(coefficients), values)
        return values

    def adjoint(self, values: np.ndarray, size: int) -> np.ndarray:
        """Transpose of :meth:`evaluate`: sums (knot, field) of values (point, field) times basis functions."""
        sums = np.zeros((size, values.shape[1]))
        _adjoint(self.knots, self.offsets, self.weights, np.ascontiguousarray(values), sums)
        return sums

    def normal_matrix(self, gradient: np.ndarray, weight: np.ndarray, size: int) -> sparse.csr_array:
        """Sparse matrix sum w (N g)(N g)^T, (3 knot, 3 knot), of gradients g (point, 3) and weights w (point,).

        Unknown 3 k + c is component c of knot k.
        """
        blocks = np.zeros((len(self.knots), 8, 8, 3, 3))
        _add_normal(self.offsets, self.weights, np.ascontiguousarray(gradient), weight, blocks)
        unknown = 3 * self.knots[..., None] + np.arange(3)
        row, column = np.broadcast_arrays(unknown[:, :, None, :, None], unknown[:, None, :, None, :])
        return sparse.coo_array((blocks.ravel(), (row.ravel(), column.ravel())), (3 * size, 3 * size)).tocsr()


@dataclass(frozen=True)
class TrilinearLattice:
    """Knots of a field in three dimensions.

    Attributes
    ----------
    knot_spacing : float
        Any unit of length, which all positions have.
    index : ndarray of three axes
        Index of each knot along lateral, elevation, depth; -1 for unused knots.
    origin : ndarray of shape (3,)
        Position of the first knot.
    """

    knot_spacing: float
    index: np.ndarray
    origin: np.ndarray

    @property
    def size(self) -> int:
        """Number of knots in use."""
        return int(self.index.max()) + 1

    @property
    def steps(self) -> np.ndarray:
        """Steps (knot, 3) of the knots in use from the first knot of the lattice, along the three axes."""
        return np.argwhere(self.index >= 0)

    def sort_points(self, points: np.ndarray) -> tuple[TrilinearCells, np.ndarray]:
        """Points (n, 3) sorted by cell, and the permutation (n,) that sorts them; outside, the outermost cell."""
        place = (points - self.origin) / self.knot_spacing
        cell = np.clip(np.floor(place), 0, np.array(self.index.shape) - 2).astype(int)
        number = np.ravel_multi_index(tuple(cell.T), self.index.shape)
        order = np.argsort(number, kind="stable")
        cells, offsets = np.unique(number[order], return_index=True)
        corner = np.stack(np.unravel_index(cells, self.index.shape), -1)
        knots = self.index[tuple(np.moveaxis(corner[:, None] + CORNERS, -1, 0))]
        fraction = (place - cell)[order][:, None]
        weights = np.where(CORNERS, fraction, 1 - fraction).prod(-1)
        return TrilinearCells(knots, np.append(offsets, len(points)), weights), order

    def evaluate(self, coefficients: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Values (n, field) of fields at points (n, 3); NaN where a knot around is unused or has a NaN coefficient."""
        place = (points - self.origin) / self.knot_spacing
        inside = ((place >= -1e-9) & (place <= np.array(self.index.shape) - 1 + 1e-9)).all(1)
        cells, order = self.sort_points(np.where(inside[:, None], points, self.origin))
        known = np.repeat((cells.knots >= 0).all(1), np.diff(cells.offsets)) & inside[order]
        result = np.full((len(points), coefficients.shape[1]), np.nan)
        result[order[known]] = cells.evaluate(coefficients)[known]
        return result


def trilinear_lattice(positions: np.ndarray, knot_spacing: float) -> TrilinearLattice:
    """Lattice of all knots whose basis functions are not 0 at some of the positions (n, 3), centred on these."""
    low, high = positions.min(0), positions.max(0)
    cells = np.maximum(np.ceil((high - low) / knot_spacing).astype(int), 1)
    full = TrilinearLattice(knot_spacing, np.zeros(cells + 1, int), (low + high) / 2 - cells / 2 * knot_spacing)
    place = np.floor((positions - full.origin) / knot_spacing).astype(int)
    occupied, used = np.zeros(cells, bool), np.zeros(cells + 1, bool)
    occupied[tuple(np.clip(place, 0, cells - 1).T)] = True
    used[tuple(np.moveaxis(np.argwhere(occupied)[:, None] + CORNERS, -1, 0))] = True
    return TrilinearLattice(knot_spacing, np.where(used, np.cumsum(used).reshape(used.shape), 0) - 1, full.origin)


@numba.njit(cache=True, nogil=True)
def _evaluate(knots, offsets, weights, coefficients, values):
    for cell in range(len(knots)):
        for point in range(offsets[cell], offsets[cell + 1]):
            for field in range(values.shape[1]):
                total = 0.0
                for k in range(8):
                    total += weights[point, k] * coefficients[knots[cell, k], field]
                values[point, field] = total


@numba.njit(cache=True, nogil=True)
def _adjoint(knots, offsets, weights, values, sums):
    for cell in range(len(knots)):
        for point in range(offsets[cell], offsets[cell + 1]):
            for k in range(8):
                for field in range(values.shape[1]):
                    sums[knots[cell, k], field] += weights[point, k] * values[point, field]


@numba.njit(cache=True, nogil=True)
def _add_normal(offsets, weights, gradient, weight, blocks):
    for cell in range(len(blocks)):
        for point in range(offsets[cell], offsets[cell + 1]):
            _add_point(weights[point], gradient[point], weight[point], blocks[cell])
        for i in range(8):
            for j in range(i):
                blocks[cell, j, i] = blocks[cell, i, j]


@numba.njit(cache=True, nogil=True)
def _add_point(weights, gradient, weight, block):
    """Add w g g^T N_i N_j of a point for all pairs j <= i of knots; (8, 8, 3, 3)."""
    for i in range(8):
        for j in range(i + 1):
            product = weight * weights[i] * weights[j]
            for c in range(3):
                for d in range(3):
                    block[i, j, c, d] += product * gradient[c] * gradient[d]
