"""Loops over material points, compiled; :mod:`.vectorised` gives the same bits without Numba."""

import numba
import numpy as np

from echotruth.fem.location import TOLERANCE
from echotruth.fem.tetrahedra import EDGES


@numba.njit(cache=True)
def interpolate(values, cells, cell, xi):  # pragma: no cover - compiled
    result, corner, weight = np.empty((len(cell), values.shape[1])), np.empty(4), np.empty(10)
    for p in range(len(cell)):
        _corners(xi[p], corner)
        for a in range(4):
            weight[a] = corner[a] * (2 * corner[a] - 1)
        for e in range(6):
            weight[4 + e] = 4 * corner[EDGES[e, 0]] * corner[EDGES[e, 1]]
        for k in range(values.shape[1]):
            total = 0.0
            for a in range(10):
                total += weight[a] * values[cells[cell[p], a], k]
            result[p, k] = total
    return result


@numba.njit(cache=True, error_model="numpy")
def gradient(values, positions, cells, cell, xi):  # pragma: no cover - compiled
    result, corner, dN_dxi = np.empty((len(cell), values.shape[1], 3)), np.empty(4), np.empty((3, 10))
    dx_dxi, inverse, dv_dxi = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for p in range(len(cell)):
        nodes = cells[cell[p]]
        _corners(xi[p], corner)
        _shape_gradient(corner, dN_dxi)
        for i in range(3):
            _derivative(dN_dxi, positions, nodes, i, dv_dxi)
            for m in range(3):
                dx_dxi[m, i] = dv_dxi[m]
        _invert(dx_dxi, inverse)
        for k in range(values.shape[1]):
            _derivative(dN_dxi, values, nodes, k, dv_dxi)
            for j in range(3):
                result[p, k, j] = dv_dxi[0] * inverse[0, j] + dv_dxi[1] * inverse[1, j] + dv_dxi[2] * inverse[2, j]
    return result


@numba.njit(cache=True)
def _corners(xi, corner):  # pragma: no cover - compiled
    """Fill the barycentric coordinates (4,)."""
    corner[0] = 1 - (xi[0] + xi[1] + xi[2])
    for k in range(3):
        corner[1 + k] = xi[k]


@numba.njit(cache=True)
def _shape_gradient(corner, dN_dxi):  # pragma: no cover - compiled
    """Fill the derivatives of the shape functions by the local coordinates, (3, 10)."""
    for m in range(3):
        for a in range(4):
            dN_dxi[m, a] = (4 * corner[a] - 1) * ((a == m + 1) - (a == 0))
        for e in range(6):
            a, b = EDGES[e, 0], EDGES[e, 1]
            dN_dxi[m, 4 + e] = 4 * (corner[b] * ((a == m + 1) - (a == 0)) + corner[a] * ((b == m + 1) - (b == 0)))


@numba.njit(cache=True)
def _derivative(dN_dxi, values, nodes, column, dv_dxi):  # pragma: no cover - compiled
    """Fill the derivatives of a column of nodal values by the local coordinates, (3,)."""
    for m in range(3):
        dv_dxi[m] = 0.0
        for a in range(10):
            dv_dxi[m] += dN_dxi[m, a] * values[nodes[a], column]


@numba.njit(cache=True, error_model="numpy")
def _invert(matrix, inverse):  # pragma: no cover - compiled
    """Fill the inverse of the transpose of a matrix (3, 3), by its cofactors."""
    for m in range(3):
        a, b = (m + 1) % 3, (m + 2) % 3
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            inverse[m, i] = matrix[a, j] * matrix[b, k] - matrix[a, k] * matrix[b, j]
    determinant = matrix[0, 0] * inverse[0, 0] + matrix[0, 1] * inverse[0, 1] + matrix[0, 2] * inverse[0, 2]
    for m in range(3):
        for i in range(3):
            inverse[m, i] /= determinant


@numba.njit(cache=True, error_model="numpy")
def locate(points, grid, start, candidates, straight, least, derivatives):  # pragma: no cover - compiled
    cells, xi = np.full(len(points), -1, np.int64), np.zeros((len(points), 3))
    local, work = np.empty(3), np.empty((4, 3))
    for p in range(len(points)):
        box = _box(grid, points[p])
        for slot in range(start[box], start[box + 1]):
            cell = candidates[slot]
            near = _near(straight[cell], least[cell], points[p], local)
            if near and _find(straight[cell, 0], derivatives[cell], points[p], local, work):
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
def _find(corner, derivatives, point, xi, work):  # pragma: no cover - compiled
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
    inside = min(xi[0], xi[1], xi[2]) >= -TOLERANCE and xi[0] + xi[1] + xi[2] <= 1 + TOLERANCE
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
