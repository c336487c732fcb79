"""Kernels of Gauss-Newton image alignment with a B-spline field: image gradients and banded normal matrices.

All run in one thread, release the GIL, and take their sums in one order.
"""

import numba
import numpy as np

from echotruth.imaging import spline
from echotruth.tracking.subset import sum_axially

BLOCK = 64
"""Points that are interpolated at a time, to stay in the first-level cache."""


@numba.njit(cache=True, nogil=True)
def interpolate_with_gradient(padded, position):
    """Interpolate an image and its gradient by cubic splines.

    Parameters
    ----------
    padded
        Spline coefficients of the image with their margin, see :func:`echotruth.imaging.spline.coefficients`.
    position
        Lateral, axial, px, shape (points, 2); outside the image its border is taken.

    Returns
    -------
    Grey value and its lateral and axial derivative per px, shape (points, 3).
    """
    rows, columns = padded.shape[0] - 3, padded.shape[1] - 3
    flat, row_length = padded.reshape(-1), np.int32(padded.shape[1])
    result, first = np.empty((len(position), 3)), np.empty(BLOCK, np.int32)
    lateral, axial = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    weights, slopes = np.empty((4, BLOCK), np.float32), np.empty((4, BLOCK), np.float32)
    values, derivatives = np.empty(4 * BLOCK, np.float32), np.empty(4 * BLOCK, np.float32)
    for start in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - start)
        for k in range(count):
            x = min(max(position[start + k, 0], 0.0), columns - 1.0)
            y = min(max(position[start + k, 1], 0.0), rows - 1.0)
            j, i = min(np.int32(x), columns - 2), min(np.int32(y), rows - 2)
            first[k], lateral[k], axial[k] = i * row_length + j, x - j, y - i
        for k in range(count):
            weights[0, k], weights[1, k], weights[2, k], weights[3, k] = spline.bspline_weights(axial[k])
            slopes[0, k], slopes[1, k], slopes[2, k], slopes[3, k] = spline.bspline_slopes(axial[k])
        sum_axially(flat, np.uintp(row_length), first[:count], weights, values)
        sum_axially(flat, np.uintp(row_length), first[:count], slopes, derivatives)
        for k in range(count):
            a, b, c, d = spline.bspline_weights(lateral[k])
            p, q, r, s = spline.bspline_slopes(lateral[k])
            n = 4 * k
            result[start + k, 0] = a * values[n] + b * values[n + 1] + c * values[n + 2] + d * values[n + 3]
            result[start + k, 1] = p * values[n] + q * values[n + 1] + r * values[n + 2] + s * values[n + 3]
            result[start + k, 2] = (
                a * derivatives[n] + b * derivatives[n + 1] + c * derivatives[n + 2] + d * derivatives[n + 3]
            )
    return result


@numba.njit(cache=True, nogil=True)
def add_normal_matrix(knots, offsets, weight_x, weight_y, gradient, weight, stride, band):
    """Add the normal matrix sum w (N grad I)(N grad I)^T of every `stride`-th point to a banded matrix.

    Unknown 2 k + c is component c of knot k; band[a, b - a + width - 1] is the entry in row a and column b of the
    lower triangle. Its transpose is what LAPACK and BLAS take as the upper triangle of a banded matrix.

    Parameters
    ----------
    knots, offsets, weight_x, weight_y
        See :class:`echotruth.tracking.bspline.Cells`.
    gradient, weight
        Shapes (points, 2) and (points,).
    stride
        Number of points that each point used stands for.
    band
        Shape (unknowns, width); added to.
    """
    cell_matrices = np.empty((3, 16, 16))
    for cell in range(len(knots)):
        cell_matrices[:] = 0
        for point in range(offsets[cell], offsets[cell + 1], stride):
            _add_point(weight_x[point], weight_y[point], gradient[point], stride * weight[point], cell_matrices)
        add_cell_matrices(knots[cell], cell_matrices, band)


@numba.njit(cache=True, nogil=True)
def _add_point(weight_x, weight_y, gradient, weight, cell_matrices):
    """Add w g_c g_d N_k N_m of one point to the matrices (3, 16, 16) of its cell for cd = xx, xy and yy."""
    gx, gy = gradient
    xx, xy, yy = weight * gx * gx, weight * gx * gy, weight * gy * gy
    product = np.empty(16)
    for k in range(16):
        product[k] = weight_y[k // 4] * weight_x[k % 4]
    for k in range(16):
        a, b, c = product[k] * xx, product[k] * xy, product[k] * yy
        for m in range(16):
            cell_matrices[0, k, m] += a * product[m]
            cell_matrices[1, k, m] += b * product[m]
            cell_matrices[2, k, m] += c * product[m]


@numba.njit(cache=True, nogil=True)
def add_cell_matrices(knots, cell_matrices, band):
    """Add the matrices xx, xy and yy (3, 16, 16) of a cell with 16 knots to a banded matrix."""
    last = band.shape[1] - 1
    for k in range(16):
        for m in range(16):
            a, b = knots[k], knots[m]
            if b < 0 or b > a:
                continue
            d = last - 2 * (a - b)
            band[2 * a, d] += cell_matrices[0, k, m]
            band[2 * a + 1, d] += cell_matrices[2, k, m]
            band[2 * a + 1, d - 1] += cell_matrices[1, m, k]
            if b < a:
                band[2 * a, d + 1] += cell_matrices[1, k, m]
