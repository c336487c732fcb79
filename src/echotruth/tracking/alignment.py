"""Gauss-Newton alignment of an image with a template through a B-spline field.

Everything here runs in one thread that lets others run, and takes its sums in one order.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.tracking.cubic import shares, slopes


@numba.njit(cache=True, nogil=True)
def grey_at(padded, place):
    """Grey values and their slopes at places in an image.

    Parameters
    ----------
    padded
        Spline coefficients of the image with their margin, see :func:`echotruth.imaging.spline.coefficients`.
    place
        Lateral, axial, px, shape (points, 2); beyond the border, the border's is taken.

    Returns
    -------
    Grey value and its lateral and axial slope per px, shape (points, 3).
    """
    rows, columns = padded.shape[0] - 3, padded.shape[1] - 3
    result = np.zeros((len(place), 3))
    for k in range(len(place)):
        x = min(max(place[k, 0], 0.0), columns - 1.0)
        y = min(max(place[k, 1], 0.0), rows - 1.0)
        j, i = min(int(x), columns - 2), min(int(y), rows - 2)
        across, right = shares(x - j), slopes(x - j)
        down, below = shares(y - i), slopes(y - i)
        for a in range(4):
            value, slope = 0.0, 0.0
            for b in range(4):
                grey = padded[i + a, j + b]
                value += across[b] * grey
                slope += right[b] * grey
            result[k, 0] += down[a] * value
            result[k, 1] += down[a] * slope
            result[k, 2] += below[a] * value
    return result


@numba.njit(cache=True, nogil=True)
def add_matrix(knots, first, across, down, slope, weight, every, band):
    """Add the normal matrix of every so many points to a band.

    Unknown 2 k + c is component c of knot k; band[a, b - a + width - 1] is the entry in row a and column b of the
    lower triangle.

    Parameters
    ----------
    knots, first, across, down
        See :class:`echotruth.tracking.bspline.Cells`.
    slope, weight
        Shapes (points, 2) and (points,).
    every
        How many points one stands for.
    band
        Shape (unknowns, width); added to.
    """
    local = np.empty((3, 16, 16))
    for cell in range(len(knots)):
        local[:] = 0
        for point in range(first[cell], first[cell + 1], every):
            _add_point(across[point], down[point], slope[point], every * weight[point], local)
        add_cell(knots[cell], local, band)


@numba.njit(cache=True, nogil=True)
def _add_point(across, down, slope, weight, local):
    """Add the products of all pairs of shares of a point to the matrices (3, 16, 16) of its cell: xx, xy and yy."""
    gx, gy = slope
    xx, xy, yy = weight * gx * gx, weight * gx * gy, weight * gy * gy
    share = np.empty(16)
    for k in range(16):
        share[k] = down[k // 4] * across[k % 4]
    for k in range(16):
        a, b, c = share[k] * xx, share[k] * xy, share[k] * yy
        for m in range(16):
            local[0, k, m] += a * share[m]
            local[1, k, m] += b * share[m]
            local[2, k, m] += c * share[m]


@numba.njit(cache=True, nogil=True)
def add_cell(knots, local, band):
    """Add the matrices xx, xy and yy (3, 16, 16) of a cell that sees 16 knots to a band."""
    last = band.shape[1] - 1
    for k in range(16):
        for m in range(16):
            a, b = knots[k], knots[m]
            if b < 0 or b > a:
                continue
            d = last - 2 * (a - b)
            band[2 * a, d] += local[0, k, m]
            band[2 * a + 1, d] += local[2, k, m]
            band[2 * a + 1, d - 1] += local[1, m, k]
            if b < a:
                band[2 * a, d + 1] += local[1, k, m]


@numba.njit(cache=True, nogil=True)
def factorise(band):
    """Cholesky factor of a symmetric positive definite band, in place; layout as of :func:`add_matrix`."""
    n, width = band.shape
    last = width - 1
    column = np.empty(width)
    for j in range(n):
        reach = min(width, n - j)
        pivot = np.sqrt(band[j, last])
        for d in range(reach):
            column[d] = band[j + d, last - d] / pivot
            band[j + d, last - d] = column[d]
        # Row by row, so that the compiler need not reorder a sum to be fast.
        for d in range(1, reach):
            row = band[j + d]
            for e in range(1, d + 1):
                row[last - d + e] -= column[d] * column[e]


@numba.njit(cache=True, nogil=True)
def solve(factor, right):
    """Solve for a right side (unknowns,), in place, with the factor of :func:`factorise`."""
    n, width = factor.shape
    last = width - 1
    for j in range(n):
        right[j] /= factor[j, last]
        for d in range(1, min(width, n - j)):
            right[j + d] -= factor[j + d, last - d] * right[j]
    for j in range(n - 1, -1, -1):
        for d in range(1, min(width, n - j)):
            right[j] -= factor[j + d, last - d] * right[j + d]
        right[j] /= factor[j, last]


@numba.njit(cache=True, nogil=True)
def product(band, x):
    """A symmetric band, laid out as of :func:`add_matrix`, times a vector (unknowns,)."""
    n, width = band.shape
    last = width - 1
    result = np.zeros(n)
    for a in range(n):
        result[a] += band[a, last] * x[a]
        for b in range(max(0, a - last), a):
            entry = band[a, b - a + last]
            result[a] += entry * x[b]
            result[b] += entry * x[a]
    return result
