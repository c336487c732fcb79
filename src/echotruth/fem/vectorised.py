"""Loops over material points in NumPy: the operations of :mod:`.compiled`, in the same order, on all points at once.

The points are the last axis of all arrays inside.
"""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.location import TOLERANCE
from echotruth.fem.tetrahedra import Integers, shape, shape_gradient


def interpolate(values: Floats, cells: Integers, cell: Integers, xi: Floats) -> Floats:
    """Nodal values (n_nodes, m) at material points, (n, m)."""
    nodes, result = cells[cell].T, np.zeros((len(cell), values.shape[1]))
    for weight, node in zip(shape(xi).T, nodes, strict=True):
        result += weight[:, None] * values[node]
    return result


def gradient(values: Floats, positions: Floats, cells: Integers, cell: Integers, xi: Floats) -> Floats:
    """Gradient of nodal values (n_nodes, m) by position at material points, (n, m, 3)."""
    both, nodes = np.hstack([positions, values]).T, cells[cell].T
    by_xi = np.zeros((len(both), 3, len(cell)))
    for derivative, node in zip(shape_gradient(xi).transpose(1, 2, 0), nodes, strict=True):
        by_xi += derivative * both[:, node][:, None]
    dx_dxi, dv_dxi = by_xi[:3].swapaxes(0, 1), by_xi[3:]
    inverse = np.empty_like(dx_dxi)
    for m, (a, b) in enumerate(_CYCLE):
        for i, (j, k) in enumerate(_CYCLE):
            inverse[m, i] = dx_dxi[a, j] * dx_dxi[b, k] - dx_dxi[a, k] * dx_dxi[b, j]
    inverse /= _dot(dx_dxi[0], inverse[0])
    result = dv_dxi[:, 0, None] * inverse[0] + dv_dxi[:, 1, None] * inverse[1] + dv_dxi[:, 2, None] * inverse[2]
    return np.ascontiguousarray(np.moveaxis(result, -1, 0))


def locate(
    points: Floats,
    grid: Floats,
    start: NDArray[np.int64],
    candidates: NDArray[np.int64],
    straight: Floats,
    least: Floats,
    derivatives: Floats,
) -> tuple[NDArray[np.int64], Floats]:
    """Cell and local coordinates of points (n, 3), m: the first of the candidates of its box that holds a point."""
    cells, xi, box = np.full(len(points), -1, np.int64), np.zeros((len(points), 3)), _box(grid, points)
    slot, end = start[box], start[box + 1]
    left = np.flatnonzero(slot < end)
    while len(left):
        cell = candidates[slot[left]]
        local, near = _near(straight[cell], least[cell], points[left])
        point, cell = left[near], cell[near]
        local, found = _find(straight[cell, 0], derivatives[cell], points[point], local[:, near])
        cells[point[found]], xi[point[found]] = cell[found], local[:, found].T
        slot[left] += 1
        left = left[(cells[left] < 0) & (slot[left] < end[left])]
    return cells, xi


_CYCLE = ((1, 2), (2, 0), (0, 1))
"""The other two of three axes, in cyclic order."""


def _box(grid: Floats, points: Floats) -> NDArray[np.int64]:
    """Number of the box that holds each point; outside of the grid that of the box without cells."""
    low, high, per_metre, count = grid
    inside = ((low <= points) & (points <= high)).all(axis=1)
    place = np.minimum((points[inside] - low) * per_metre, count - 1).astype(np.int64)
    box = np.full(len(points), int(count.prod()))
    box[inside] = np.ravel_multi_index(tuple(place.T), tuple(count.astype(int)))
    return box


def _near(straight: Floats, least: Floats, points: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Local coordinates (3, n) in the straight tetrahedra, and whether the cells may hold the points."""
    offset, inverse = (points - straight[:, 0]).T, straight[:, 1:].transpose(1, 2, 0)
    local = np.stack([_dot(row, offset) for row in inverse])
    first = 1 - local[0] - local[1] - local[2]
    return local, (local >= least[:, 1:].T).all(axis=0) & (first >= least[:, 0])


def _find(corner: Floats, derivatives: Floats, points: Floats, xi: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Newton's method for x(xi) = point, from xi (3, n) on; returns xi, and whether it is in the cell."""
    xi, change, left = xi.copy(), np.full(len(points), np.inf), np.arange(len(points))
    derivatives, offset = np.ascontiguousarray(derivatives.transpose(1, 2, 3, 0)), (points - corner).T
    for _ in range(30):
        d, x = derivatives[..., left], xi[:, left]
        dx_dxi = d[0] + d[1] * x[0] + d[2] * x[1] + d[3] * x[2]
        mean = (d[0] + dx_dxi) / 2
        residual = offset[:, left] - mean[0] * x[0] - mean[1] * x[1] - mean[2] * x[2]
        determinant = triple_product(*dx_dxi)
        step = np.stack([triple_product(residual, dx_dxi[a], dx_dxi[b]) / determinant for a, b in _CYCLE])
        xi[:, left], change[left] = x + step, np.abs(step).max(axis=0)
        # As compiled: the next step would be round-off, or the method diverges.
        left = left[(change[left] >= 1e-12) & (change[left] <= 10)]
        if not len(left):
            break
    inside = (xi.min(axis=0) >= -TOLERANCE) & (xi[0] + xi[1] + xi[2] <= 1 + TOLERANCE)
    return xi, inside & (change < 1e-9)


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def triple_product(a: Floats, b: Floats, c: Floats) -> Floats:
    """Determinants (...) of matrices whose rows, of shape (3, ...), are given."""
    product: Floats = (
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    return product
