"""Location of points in a mesh of curved tetrahedra: the inverse of interpolation.

A quadratic tetrahedron lies in the convex hull of its Bezier points: its corners, and for each edge twice its mid-edge
node less the mean of its ends (Farin, Curves and Surfaces for Computer Aided Geometric Design). They bound how far it
reaches beyond each face of the straight tetrahedron with the same corners. That leaves few cells for a point, which
Newton's method on x(xi) = x tests.
"""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.kernels import kernels
from echotruth.fem.tetrahedra import EDGES, Integers, MaterialPoints

_BOXES_PER_CELL = 4
"""Boxes of the search grid along the mean width of a cell."""

_MAX_BOXES = 64
"""Boxes along an axis at most."""

TOLERANCE = 1e-10
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
    cell, xi = kernels().locate(points, grid, start, candidates, *shapes)
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
