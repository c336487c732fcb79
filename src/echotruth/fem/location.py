"""Location of points in a mesh of curved tetrahedra: the inverse of interpolation.

A quadratic tetrahedron lies in the convex hull of its Bezier points: its corners, and for each edge twice its mid-edge
node less the mean of its ends (Farin, Curves and Surfaces for Computer Aided Geometric Design). They bound how far it
reaches beyond each face of the straight tetrahedron with the same corners. That leaves few cells for a point, which
Newton's method on x(xi) = x tests.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import EDGES, Integers, MaterialPoints

_BOXES_PER_CELL = 4
"""Boxes of the search grid along the mean width of a cell."""

_MAX_BOXES = 64
"""Boxes along an axis at most."""

_TOLERANCE = 1e-10
"""Distance by which local coordinates may leave the tetrahedron, so that round-off at a face loses no point."""

_MARGIN = 1e-9
"""Margin of a hull, over its size, which holds the tolerance."""

_BEZIER_INDEX = np.array([(0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)])
"""Index of the Bezier point between two vertices."""


def locate(positions: Floats, cells: Integers, points: Floats) -> MaterialPoints:
    """Material points at given positions.

    Parameters
    ----------
    positions : ndarray of shape (n_nodes, 3), m
        Of the nodes in the state of interest.
    cells : ndarray of shape (n_cells, 10)
    points : ndarray of shape (n, 3), m

    Returns
    -------
    MaterialPoints of length n
        Their map by :func:`.tetrahedra.interpolate` is `points` to round-off; `cell` is -1 outside the mesh. A point on
        the faces of several cells is in the first of them.
    """
    points = np.ascontiguousarray(points, float)
    if not len(points):
        return MaterialPoints(np.empty(0, np.int32), np.empty((0, 3)))
    bezier = _bezier_points(positions, cells)
    low, high = bezier.min(axis=0), bezier.max(axis=0)
    margin = _MARGIN * (high - low)
    low, high = low - margin, high + margin
    grid = _grid(low, high, points)
    near = np.flatnonzero(((low <= grid[1]) & (high >= grid[0])).all(axis=1)).astype(np.int32)
    start, candidates = _candidates(low[near], high[near], grid)
    shapes = _shapes(np.ascontiguousarray(np.swapaxes(bezier[:, near], 0, 1)))
    cell, xi = _locate(points, grid, start, candidates, *shapes)
    return MaterialPoints(np.append(near, np.int32(-1))[cell], xi)


def _bezier_points(positions: Floats, cells: Integers) -> Floats:
    """Bezier points of the cells, (10, n_cells, 3), m."""
    bezier = positions[cells.T]
    bezier[4:] = 2 * bezier[4:] - (bezier[EDGES[:, 0]] + bezier[EDGES[:, 1]]) / 2
    return bezier


def _grid(low: Floats, high: Floats, points: Floats) -> Floats:
    """Boxes over the region common to the points and to the cells, whose bounds are `low` and `high`.

    Rows of shape (4, 3): lower and upper corner, m; boxes per metre; number of boxes.
    """
    # Numpy is slow to reduce along the first axis where the other is short: column by column.
    first = np.array([max(bound.min(), x.min()) for bound, x in zip(low.T, points.T, strict=True)])
    last = np.array([min(bound.max(), x.max()) for bound, x in zip(high.T, points.T, strict=True)])
    extent = np.maximum(last - first, 0)  # points may lie in a plane
    boxes = np.clip(np.ceil(_BOXES_PER_CELL * extent / (high - low).mean(axis=0)), 1, _MAX_BOXES)
    return np.stack([first, last, np.divide(boxes, extent, out=np.zeros(3), where=extent > 0), boxes])


def _candidates(low: Floats, high: Floats, grid: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cells that meet each box, in rising order: the start of the list of each box, and all lists.

    `low` and `high` are the bounds of the cells. The last box has no cells, and stands for all outside of the grid.
    """
    boxes = grid[3].astype(np.int64)
    first, last = (np.clip((bound - grid[0]) * grid[2], 0, boxes - 1).astype(np.int64) for bound in (low, high))
    span = last - first + 1
    count = span.prod(axis=1)
    cell = np.repeat(np.arange(len(low)), count)
    number = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    step = np.stack(
        [number // (span[cell, 1] * span[cell, 2]), number // span[cell, 2] % span[cell, 1], number % span[cell, 2]]
    )
    box = np.ravel_multi_index(tuple(first[cell].T + step), tuple(boxes))
    start = np.concatenate([[0], np.cumsum(np.bincount(box, minlength=boxes.prod() + 1))])
    return start, cell[np.argsort(box, kind="stable")]


def _shapes(bezier: Floats) -> tuple[Floats, Floats, Floats]:
    """Coefficients of the tests whether a point is in a cell, from Bezier points (n_cells, 10, 3), m.

    The first corner, m, and the inverse of the edges from it, 1/m, (n_cells, 4, 3); the least barycentric coordinates,
    those of the straight tetrahedron with the same corners, in the cell, (n_cells, 4); dx/dxi_k at the first corner and
    d2x/dxi_m dxi_k, m, (n_cells, 4, 3, 3), all of x(xi), which is of second degree. The last axis is that of position.
    """
    edges = bezier[:, 1:4] - bezier[:, :1]
    inverse = np.linalg.inv(np.swapaxes(edges, 1, 2))
    local = (bezier - bezier[:, :1]) @ np.swapaxes(inverse, 1, 2)
    least = np.minimum(np.concatenate([1 - local.sum(axis=2, keepdims=True), local], axis=2).min(axis=1), 0) - _MARGIN
    first = bezier[:, _BEZIER_INDEX] - bezier[:, _BEZIER_INDEX[:, :1]]
    derivatives = np.concatenate([first[:, :1], first[:, 1:] - first[:, :1]], axis=1)[:, :, 1:]
    return np.concatenate([bezier[:, :1], inverse], axis=1), least, np.ascontiguousarray(2 * derivatives)


@numba.njit(cache=True, error_model="numpy")
def _locate(points, grid, start, candidates, straight, least, derivatives):  # pragma: no cover - compiled
    cells, xi = np.full(len(points), -1, np.int64), np.zeros((len(points), 3))
    local, work = np.empty(3), np.empty((4, 3))
    for p in range(len(points)):
        box = _box(grid, points[p])
        for slot in range(start[box], start[box + 1]):
            cell = candidates[slot]
            near = _near(straight[cell], least[cell], points[p], local)
            if near and _invert(straight[cell, 0], derivatives[cell], points[p], local, work):
                cells[p] = cell
                for i in range(3):
                    xi[p, i] = local[i]
                break
    return cells, xi


@numba.njit(cache=True, error_model="numpy")
def _box(grid, point):  # pragma: no cover - compiled
    """Number of the box that holds a point; outside of the grid that of the box without cells."""
    box = 0
    for i in range(3):
        if not grid[0, i] <= point[i] <= grid[1, i]:
            return int(grid[3, 0] * grid[3, 1] * grid[3, 2])
        box = box * int(grid[3, i]) + int(min((point[i] - grid[0, i]) * grid[2, i], grid[3, i] - 1))
    return box


@numba.njit(cache=True, error_model="numpy")
def _near(straight, least, point, local):  # pragma: no cover - compiled
    """Whether a cell may hold a point; fills its local coordinates in the straight tetrahedron."""
    first = 1.0
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += straight[1 + i, j] * (point[j] - straight[0, j])
        if not local[i] >= least[1 + i]:
            return False
        first -= local[i]
    return first >= least[0]


@numba.njit(cache=True, error_model="numpy")
def _invert(corner, derivatives, point, xi, work):  # pragma: no cover - compiled
    """Newton's method for x(xi) = point, in place: dx/dxi delta = point - x(xi); returns if xi is in the cell.

    x(xi) is the corner plus sum_k xi_k (dx/dxi_k at the corner + dx/dxi_k at xi) / 2, exactly.
    """
    dx_dxi, residual = work[:3], work[3]
    change = np.inf
    for _ in range(30):
        for i in range(3):
            residual[i] = point[i] - corner[i]
            for k in range(3):
                dx_dxi[k, i] = derivatives[0, k, i]
                for m in range(3):
                    dx_dxi[k, i] += derivatives[1 + m, k, i] * xi[m]
                residual[i] -= (derivatives[0, k, i] + dx_dxi[k, i]) / 2 * xi[k]
        change = _newton_step(dx_dxi, residual, xi)
        if change < 1e-12 or change > 10:  # the next step would be round-off, or the method diverges
            break
    inside = min(xi[0], xi[1], xi[2]) >= -_TOLERANCE and xi[0] + xi[1] + xi[2] <= 1 + _TOLERANCE
    return inside and change < 1e-9


@numba.njit(cache=True, error_model="numpy")
def _newton_step(dx_dxi, residual, xi):  # pragma: no cover - compiled
    """Take a step by Cramer's rule, faster than LAPACK on three unknowns; returns the largest change."""
    determinant, largest = _triple(dx_dxi[0], dx_dxi[1], dx_dxi[2]), 0.0
    for k in range(3):
        change = _triple(residual, dx_dxi[(k + 1) % 3], dx_dxi[(k + 2) % 3]) / determinant
        xi[k] += change
        largest = max(largest, abs(change))
    return largest


@numba.njit(cache=True, error_model="numpy")
def _triple(a, b, c):  # pragma: no cover - compiled
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
