"""The finding of points in a mesh of curved tetrahedra: the inverse of interpolation."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.tetrahedra import EDGES, Floats, Integers, MaterialPoints

_BINS = 48
"""Boxes along each axis into which points are sorted: of the size of a cell."""

_TOLERANCE = 1e-10
"""By how much local coordinates may leave the tetrahedron: round-off at a face must lose no point."""

_FAR = 0.6
"""A point that the straight tetrahedron puts further outside than this is not in the curved one."""


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
        Their map by :func:`interpolate` is `points` to round-off; `cell` is -1 outside the mesh.
    """
    near, start, order = _bins(positions, points)
    cell, xi = _locate(positions, cells, points, near, start, order)
    return MaterialPoints(cell, xi)


def _bins(positions: Floats, points: Floats) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Sort points into boxes: (lower corner and boxes per metre), start of each box, order of points."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    margin = 0.05 * (high - low) + 1e-12  # curved faces bulge beyond the nodes
    low, high = low - margin, high + margin
    near = np.vstack([low, _BINS / (high - low)])
    box = np.floor((points - low) * near[1]).astype(np.int64)
    inside = ((box >= 0) & (box < _BINS)).all(axis=1)
    flat = np.where(inside, (box[:, 0] * _BINS + box[:, 1]) * _BINS + box[:, 2], _BINS**3)
    order = np.argsort(flat, kind="stable")
    return near, np.searchsorted(flat[order], np.arange(_BINS**3 + 1)), order


@numba.njit(cache=True)
def _locate(positions, cells, points, near, start, order):  # pragma: no cover - compiled
    found = np.full(len(points), -1, np.int32)
    xi = np.zeros((len(points), 3))
    nodes = np.empty((10, 3))
    place = np.empty(3)
    for cell in range(len(cells)):
        for a in range(10):
            nodes[a] = positions[cells[cell, a]]
        low, high = _box(nodes)
        first = np.clip(np.floor((low - near[0]) * near[1]), 0, _BINS - 1).astype(np.int64)
        last = np.clip(np.floor((high - near[0]) * near[1]), 0, _BINS - 1).astype(np.int64)
        straight = np.linalg.inv((nodes[1:4] - nodes[0]).T)
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                row = (i * _BINS + j) * _BINS
                for slot in range(start[row + first[2]], start[row + last[2] + 1]):
                    point = order[slot]
                    near_by = found[point] < 0 and _guess(nodes[0], straight, points[point], place)
                    if near_by and _invert(nodes, points[point], place):
                        found[point] = cell
                        xi[point] = place
    return found, xi


@numba.njit(cache=True)
def _box(nodes):  # pragma: no cover - compiled
    """Box around a quadratic tetrahedron, which bulges beyond its nodes by less than it is wide."""
    low, high = np.empty(3), np.empty(3)
    for k in range(3):
        lowest, highest = nodes[:, k].min(), nodes[:, k].max()
        low[k], high[k] = lowest - 0.15 * (highest - lowest), highest + 0.15 * (highest - lowest)
    return low, high


@numba.njit(cache=True)
def _guess(corner, straight, point, place):  # pragma: no cover - compiled
    """Local coordinates in the straight tetrahedron; whether the point may be in the curved one."""
    total = 0.0
    near = True
    for i in range(3):
        place[i] = 0.0
        for j in range(3):
            place[i] += straight[i, j] * (point[j] - corner[j])
        total += place[i]
        near = near and place[i] > -_FAR
    return near and total < 1 + _FAR


@numba.njit(cache=True)
def _invert(nodes, point, xi):  # pragma: no cover - compiled
    """Newton's method for the local coordinates of a place, in place; whether they lie in the tetrahedron."""
    corner = np.empty(4)
    for _ in range(30):
        corner[0] = 1 - xi[0] - xi[1] - xi[2]
        corner[1:] = xi
        change = _newton_step(nodes, point, corner)
        xi += change
        largest = np.abs(change).max()
        if largest < 1e-14 or largest > 10:
            break
    return largest < 1e-9 and xi.min() >= -_TOLERANCE and xi.sum() <= 1 + _TOLERANCE


@numba.njit(cache=True)
def _newton_step(nodes, point, corner):  # pragma: no cover - compiled
    rest = point.copy()
    slope = np.zeros((4, 3))  # of position by the four barycentric coordinates
    for a in range(4):
        for i in range(3):
            rest[i] -= corner[a] * (2 * corner[a] - 1) * nodes[a, i]
            slope[a, i] += (4 * corner[a] - 1) * nodes[a, i]
    for e in range(6):
        a, b = EDGES[e, 0], EDGES[e, 1]
        for i in range(3):
            rest[i] -= 4 * corner[a] * corner[b] * nodes[4 + e, i]
            slope[a, i] += 4 * corner[b] * nodes[4 + e, i]
            slope[b, i] += 4 * corner[a] * nodes[4 + e, i]
    return _solve(slope[1] - slope[0], slope[2] - slope[0], slope[3] - slope[0], rest)


@numba.njit(cache=True)
def _solve(a, b, c, right):  # pragma: no cover - compiled
    """Cramer's rule for the system of columns a, b, c: faster than LAPACK on three unknowns."""
    result = np.empty(3)
    whole = _triple(a, b, c)
    result[0] = _triple(right, b, c) / whole
    result[1] = _triple(a, right, c) / whole
    result[2] = _triple(a, b, right) / whole
    return result


@numba.njit(cache=True)
def _triple(a, b, c):  # pragma: no cover - compiled
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
