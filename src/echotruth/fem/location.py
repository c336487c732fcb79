"""The finding of points in a mesh of curved tetrahedra: the inverse of interpolation.

A quadratic tetrahedron lies in the hull of its Bezier points: its corners, and for each edge twice the node in its
middle less the mean of its ends (Farin, Curves and Surfaces for Computer Aided Geometric Design). They tell how far it
reaches beyond each face of the straight tetrahedron with the same corners. That leaves a point few cells to be in, and
Newton's method decides.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.fem.tetrahedra import EDGES, Floats, Integers, MaterialPoints

_FINE = 4
"""Boxes along the mean width of a cell; in these boxes the cells near a point are looked up."""

_MOST = 64
"""Boxes along an axis at most."""

_TOLERANCE = 1e-10
"""By how much local coordinates may leave the tetrahedron: round-off at a face must lose no point."""

_MARGIN = 1e-9
"""By how much of its size a hull is widened, to hold what is within the tolerance."""

_BESIDE = np.array([(0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)])
"""Bezier points by the two vertices they stand between."""


def locate(positions: Floats, cells: Integers, points: Floats) -> MaterialPoints:
    """The material points that are at given places.

    Parameters
    ----------
    positions : ndarray of shape (n_nodes, 3), m
        Of the nodes in the state of interest.
    cells : ndarray of shape (n_cells, 10)
    points : ndarray of shape (n, 3), m

    Returns
    -------
    MaterialPoints of length n
        Their map by :func:`interpolate` is `points` to round-off; `cell` is -1 outside the mesh. A point that cells
        share is in the first of them.
    """
    points = np.ascontiguousarray(points, float)
    if not len(points):
        return MaterialPoints(np.empty(0, np.int32), np.empty((0, 3)))
    hull = _bezier_points(positions, cells)
    low, high = hull.min(axis=0), hull.max(axis=0)
    margin = _MARGIN * (high - low)
    low, high = low - margin, high + margin
    grid = _grid(low, high, points)
    near = np.flatnonzero(((low <= grid[1]) & (high >= grid[0])).all(axis=1)).astype(np.int32)
    start, members = _members(low[near], high[near], grid)
    shapes = _shapes(np.ascontiguousarray(np.swapaxes(hull[:, near], 0, 1)))
    found, xi = _locate(points, grid, start, members, *shapes)
    return MaterialPoints(np.append(near, np.int32(-1))[found], xi)


def _bezier_points(positions: Floats, cells: Integers) -> Floats:
    """Bezier points of the cells, (10, n_cells, 3), m."""
    hull = positions[cells.T]
    hull[4:] = 2 * hull[4:] - (hull[EDGES[:, 0]] + hull[EDGES[:, 1]]) / 2
    return hull


def _grid(low: Floats, high: Floats, points: Floats) -> Floats:
    """Boxes over what the cells, from `low` to `high`, and the points have in common.

    Returns
    -------
    ndarray of shape (4, 3)
        Lower and upper corner, m; boxes per metre; number of boxes.
    """
    # Numpy is slow to reduce along the first axis where the other is short: column by column.
    first = np.array([max(cell.min(), place.min()) for cell, place in zip(low.T, points.T, strict=True)])
    last = np.array([min(cell.max(), place.max()) for cell, place in zip(high.T, points.T, strict=True)])
    extent = np.maximum(last - first, 0)  # points may lie in a plane
    boxes = np.clip(np.ceil(_FINE * extent / (high - low).mean(axis=0)), 1, _MOST)
    return np.stack([first, last, np.divide(boxes, extent, out=np.zeros(3), where=extent > 0), boxes])


def _members(low: Floats, high: Floats, grid: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cells, from `low` to `high`, that meet each box, in rising order: where its list starts, and the lists.

    After the last box stands one without cells.
    """
    boxes = grid[3].astype(np.int64)
    first, last = (np.clip((each - grid[0]) * grid[2], 0, boxes - 1).astype(np.int64) for each in (low, high))
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


def _shapes(hull: Floats) -> tuple[Floats, Floats, Floats]:
    """What decides whether a point is in a cell.

    Parameters
    ----------
    hull : ndarray of shape (n_cells, 10, 3), m
        Bezier points.

    Returns
    -------
    straight : ndarray of shape (n_cells, 4, 3)
        The first corner, m, and the inverse of the edges from it, 1/m.
    reach : ndarray of shape (n_cells, 4)
        Least barycentric coordinates, those of the straight tetrahedron with the same corners, in the cell.
    curve : ndarray of shape (n_cells, 4, 3, 3), m
        Slopes of position by local coordinates at the first corner, and the slopes of these: as position is of second
        degree, that is all of it. The last axis is that of position.
    """
    edges = hull[:, 1:4] - hull[:, :1]
    inverse = np.linalg.inv(np.swapaxes(edges, 1, 2))
    place = (hull - hull[:, :1]) @ np.swapaxes(inverse, 1, 2)
    reach = np.minimum(np.concatenate([1 - place.sum(axis=2, keepdims=True), place], axis=2).min(axis=1), 0) - _MARGIN
    slope = hull[:, _BESIDE] - hull[:, _BESIDE[:, :1]]
    curve = np.concatenate([slope[:, :1], slope[:, 1:] - slope[:, :1]], axis=1)[:, :, 1:]
    return np.concatenate([hull[:, :1], inverse], axis=1), reach, np.ascontiguousarray(2 * curve)


@numba.njit(cache=True, error_model="numpy")
def _locate(points, grid, start, members, straight, reach, curve):  # pragma: no cover - compiled
    found, xi = np.full(len(points), -1, np.int64), np.zeros((len(points), 3))
    place, room = np.empty(3), np.empty((4, 3))
    for p in range(len(points)):
        box = _box(grid, points[p])
        for slot in range(start[box], start[box + 1]):
            cell = members[slot]
            near = _near(straight[cell], reach[cell], points[p], place)
            if near and _invert(straight[cell, 0], curve[cell], points[p], place, room):
                found[p] = cell
                xi[p, 0], xi[p, 1], xi[p, 2] = place
                break
    return found, xi


@numba.njit(cache=True, error_model="numpy")
def _box(grid, point):  # pragma: no cover - compiled
    """Number of the box that holds a point; outside of the grid that of the one without cells."""
    box = 0
    for i in range(3):
        if not grid[0, i] <= point[i] <= grid[1, i]:
            return int(grid[3, 0] * grid[3, 1] * grid[3, 2])
        box = box * int(grid[3, i]) + int(min((point[i] - grid[0, i]) * grid[2, i], grid[3, i] - 1))
    return box


@numba.njit(cache=True, error_model="numpy")
def _near(straight, reach, point, place):  # pragma: no cover - compiled
    """Whether a cell may reach a point; the point's place in the straight tetrahedron, in place."""
    rest = 1.0
    for i in range(3):
        place[i] = 0.0
        for j in range(3):
            place[i] += straight[1 + i, j] * (point[j] - straight[0, j])
        if not place[i] >= reach[1 + i]:
            return False
        rest -= place[i]
    return rest >= reach[0]


@numba.njit(cache=True, error_model="numpy")
def _invert(corner, curve, point, xi, room):  # pragma: no cover - compiled
    """Newton's method for the local coordinates of a point, in place; whether they lie in the cell."""
    slope, rest = room[:3], room[3]
    change = np.inf
    for _ in range(30):
        for i in range(3):
            rest[i] = point[i] - corner[i]
            for k in range(3):
                slope[k, i] = curve[0, k, i]
                for m in range(3):
                    slope[k, i] += curve[1 + m, k, i] * xi[m]
                rest[i] -= (curve[0, k, i] + slope[k, i]) / 2 * xi[k]
        change = _advance(slope, rest, xi)
        if change < 1e-12 or change > 10:  # the next step would be round-off, or there is none
            break
    inside = min(xi[0], xi[1], xi[2]) >= -_TOLERANCE and xi[0] + xi[1] + xi[2] <= 1 + _TOLERANCE
    return inside and change < 1e-9


@numba.njit(cache=True, error_model="numpy")
def _advance(slope, rest, xi):  # pragma: no cover - compiled
    """Take a step, solved for by Cramer's rule: faster than LAPACK on three unknowns. The largest change."""
    whole, largest = _triple(slope[0], slope[1], slope[2]), 0.0
    for k in range(3):
        change = _triple(rest, slope[(k + 1) % 3], slope[(k + 2) % 3]) / whole
        xi[k] += change
        largest = max(largest, abs(change))
    return largest


@numba.njit(cache=True, error_model="numpy")
def _triple(a, b, c):  # pragma: no cover - compiled
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
