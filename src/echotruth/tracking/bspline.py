"""Two-dimensional cubic B-spline fields, with knots only where they affect the wall.

A field is u(x, y) = sum_kl c_kl B(x - x_l) B(y - y_k) on a square lattice of knots; a point in one cell of the lattice
depends on the 4 x 4 knots around it. One thread takes all sums in one order, so the bytes are reproducible.
"""

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from echotruth.tracking import cubic

Lines = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Arrays of :attr:`Cells.lines`."""


@dataclass(frozen=True)
class Cells:
    """Points sorted by the cell of the lattice that contains them, and in a cell by line.

    A line are points of a cell that follow one another at the same axial place, as pixels do. They share the basis
    functions of the rows of knots, so that sums are taken along each line first, and then over the lines.

    Attributes
    ----------
    knots : ndarray of shape (cell, 16)
        Index of the knots around each cell, lateral fastest; -1 for unused knots.
    offsets : ndarray of shape (cell + 1,)
        First point of each cell; the last entry is the number of points.
    fraction : ndarray of shape (point, 2)
        Position within the cell, lateral and axial, 0 to 1.
    """

    knots: np.ndarray
    offsets: np.ndarray
    fraction: np.ndarray

    @cached_property
    def lines(self) -> Lines:
        """What compiled sums need: `knots`, and

        - the first line of each cell, (cell + 1,), and the first point of each line, (line + 1,); the last entries are
          the numbers of lines and of points;
        - basis functions of the four columns of knots at each point, (point, 4), and of the four rows at each line,
          (line, 4).
        """
        axial = self.fraction[:, 1]
        begins = np.ones(len(axial), bool)
        begins[1:] = axial[1:] != axial[:-1]
        begins[self.offsets[:-1]] = True
        first_point = np.append(np.flatnonzero(begins), len(axial))
        weight_x, weight_y = (
            np.stack(cubic.bspline_weights(u), -1) for u in (self.fraction[:, 0], axial[first_point[:-1]])
        )
        return self.knots, np.searchsorted(first_point, self.offsets), first_point, weight_x, weight_y

    def evaluate(self, coefficients: np.ndarray) -> np.ndarray:
        """Values (point, field) of fields with coefficients (knot, field); all knots must be in use."""
        values = np.empty((len(self.fraction), coefficients.shape[1]))
        _evaluate(self.lines, np.ascontiguousarray(coefficients), values)
        return values

    def adjoint(self, values: np.ndarray, size: int) -> np.ndarray:
        """Transpose of :meth:`evaluate`: sums (knot, field) of values (point, field) times basis functions."""
        sums = np.zeros((size, values.shape[1]))
        _adjoint(self.lines, np.ascontiguousarray(values), sums)
        return sums


@dataclass(frozen=True)
class KnotLattice:
    """Knots of a field.

    Attributes
    ----------
    knot_spacing : float
        px.
    index : ndarray of shape (rows, columns)
        Index of each knot, counted along the shorter side; -1 for unused knots.
    origin : ndarray of shape (2,)
        Position of the first knot: lateral, axial, px.
    """

    knot_spacing: float
    index: np.ndarray
    origin: np.ndarray

    @property
    def size(self) -> int:
        """Number of knots in use."""
        return int(self.index.max()) + 1

    def cell_of(self, points: np.ndarray) -> np.ndarray:
        """Column and row (n, 2) of the cells that contain points (n, 2); the outermost cell for points outside."""
        cell = np.floor((points - self.origin) / self.knot_spacing)
        return np.clip(cell, 1, np.array(self.index.shape[::-1]) - 3).astype(int)

    def sort_points(self, points: np.ndarray) -> tuple[Cells, np.ndarray]:
        """Sort points by cell.

        Parameters
        ----------
        points : ndarray of shape (n, 2)
            Lateral, axial, px.

        Returns
        -------
        Cells
            The points in the new order.
        order : ndarray of shape (n,)
            Permutation that sorts the points.
        """
        column_row = self.cell_of(points)
        cell = column_row[:, 1] * self.index.shape[1] + column_row[:, 0]
        order = np.argsort(cell, kind="stable")
        cells, offsets = np.unique(cell[order], return_index=True)
        row, column = np.divmod(cells, self.index.shape[1])
        around = np.arange(-1, 3)
        knots = self.index[row[:, None, None] + around[:, None], column[:, None, None] + around]
        fraction = ((points - self.origin) / self.knot_spacing - column_row)[order]
        return Cells(knots.reshape(-1, 16), np.append(offsets, len(points)), fraction), order

    def affine_fields(self) -> np.ndarray:
        """Coefficients (2 size, 6) of six fields that span the affine ones: 1, x and y in either component.

        Unknown 2 k + c is component c of knot k. A B-spline whose coefficients are the coordinates of the knots is that
        coordinate; it is 0 in the middle of the lattice and 1 at half its longer side.
        """
        row, column = np.nonzero(self.index >= 0)
        position = np.empty((self.size, 2))
        position[self.index[row, column]] = np.stack([column, row], -1)
        position = (position - (np.array(self.index.shape[::-1]) - 1) / 2) / (max(self.index.shape) / 2)
        return np.kron(np.column_stack([np.ones(self.size), position]), np.eye(2))

    def evaluate(self, coefficients: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Evaluate fields at points.

        Parameters
        ----------
        coefficients : ndarray of shape (knot, field)
            Any unit.
        points : ndarray of shape (n, 2)
            Lateral, axial, px.

        Returns
        -------
        ndarray of shape (n, field)
            NaN where a knot around the point is unused or has a NaN coefficient.
        """
        extent = np.array(self.index.shape[::-1]) - 1
        middle = self.origin + extent * self.knot_spacing / 2
        inside = (np.abs(middle - points) <= (extent - 2) * self.knot_spacing / 2 + 1e-9).all(1)
        cells, order = self.sort_points(np.where(inside[:, None], points, middle))
        known = np.repeat((cells.knots >= 0).all(1), np.diff(cells.offsets)) & inside[order]
        result = np.full((len(points), coefficients.shape[1]), np.nan)
        # The index -1 of an unused knot takes the last knot, but that result is not kept.
        result[order[known]] = cells.evaluate(coefficients)[known]
        return result


def lattice_around(positions: np.ndarray, knot_spacing: float) -> KnotLattice:
    """Lattice of all knots whose basis functions are not 0 at some of the positions, centred on these.

    Parameters
    ----------
    positions : ndarray of shape (n, 2)
        Lateral, axial, px; at least one.
    knot_spacing : float
        px.

    Returns
    -------
    KnotLattice
    """
    low, high = positions.min(0), positions.max(0)
    intervals = np.maximum(np.ceil((high - low) / knot_spacing).astype(int), 1)
    shape = tuple(intervals[::-1] + 3)
    full = KnotLattice(knot_spacing, np.zeros(shape, int), (low + high) / 2 - (intervals / 2 + 1) * knot_spacing)
    cell = full.cell_of(positions)
    used = np.zeros(shape, bool)
    for i, j in np.ndindex(4, 4):
        used[cell[:, 1] + i - 1, cell[:, 0] + j - 1] = True
    # Counted along the shorter side, so that the matrices of neighbouring knots have a narrow band.
    index = np.where(used, np.cumsum(used).reshape(shape), 0) - 1
    if shape[0] < shape[1]:
        index = np.where(used, np.cumsum(used.T).reshape(shape[::-1]).T, 0) - 1
    return KnotLattice(knot_spacing, index, full.origin)


@numba.njit(cache=True, nogil=True)
def _evaluate(lines, coefficients, values):
    knots, first_line, first_point, weight_x, weight_y = lines
    local = np.empty((4, 4))
    for cell in range(len(knots)):
        for field in range(values.shape[1]):
            for k in range(16):
                local[k // 4, k % 4] = coefficients[knots[cell, k], field]
            for line in range(first_line[cell], first_line[cell + 1]):
                # Four numbers and not an array, so that they are not fetched for each point.
                a, b, c, d = _columns(weight_y[line], local)
                for point in range(first_point[line], first_point[line + 1]):
                    p, q, r, s = weight_x[point]
                    values[point, field] = (a * p + b * q) + (c * r + d * s)


@numba.njit(cache=True, nogil=True)
def _columns(weights, local):
    """Sum of the rows of coefficients (4, 4) times their weights (4,)."""
    p, q, r, s = weights
    return (
        (p * local[0, 0] + q * local[1, 0]) + (r * local[2, 0] + s * local[3, 0]),
        (p * local[0, 1] + q * local[1, 1]) + (r * local[2, 1] + s * local[3, 1]),
        (p * local[0, 2] + q * local[1, 2]) + (r * local[2, 2] + s * local[3, 2]),
        (p * local[0, 3] + q * local[1, 3]) + (r * local[2, 3] + s * local[3, 3]),
    )


@numba.njit(cache=True, nogil=True)
def _adjoint(lines, values, sums):
    knots, first_line, first_point, weight_x, weight_y = lines
    local = np.empty((4, 4))
    for cell in range(len(knots)):
        for field in range(values.shape[1]):
            local[:] = 0
            for line in range(first_line[cell], first_line[cell + 1]):
                a = b = c = d = 0.0
                for point in range(first_point[line], first_point[line + 1]):
                    (p, q, r, s), value = weight_x[point], values[point, field]
                    a, b, c, d = a + p * value, b + q * value, c + r * value, d + s * value
                for i in range(4):
                    weight = weight_y[line, i]
                    local[i, 0] += weight * a
                    local[i, 1] += weight * b
                    local[i, 2] += weight * c
                    local[i, 3] += weight * d
            for k in range(16):
                sums[knots[cell, k], field] += local[k // 4, k % 4]
