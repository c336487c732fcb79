"""Kernels of Gauss-Newton image alignment with a B-spline field: image gradients, robust forces and normal matrices.

All run in one thread, release the GIL, and take their sums in one order.
"""

import numba
import numpy as np

from echotruth.imaging import spline

BLOCK = 64
"""Points that are interpolated at a time, to stay in the first-level cache."""
MEDIAN_STRIDE = 4
"""Every n-th residual is used for their median."""
MAD_TO_STD = 1.4826
"""Standard deviation of a Gaussian over its median absolute deviation."""
ONE, TWO, THREE = np.uintp(1), np.uintp(2), np.uintp(3)
PAIR = np.array([[0, 1, 3, 6], [1, 2, 4, 7], [3, 4, 5, 8], [6, 7, 8, 9]])
"""Number of each pair of four columns, or rows, of knots, in either order."""


@numba.njit(cache=True, nogil=True)
def sum_axially(flat, row_length, first, weights, sums):
    """Write the sums of 4 x 4 coefficients (first and three beside it, in four rows) times weights (4, n); (4 n,)."""
    # Unsigned indices: for signed ones the compiler would test whether they count from the end. Written out, the four
    # columns are loaded and summed as one vector.
    for k in range(len(first)):
        a, out = np.uintp(first[k]), np.uintp(4) * np.uintp(k)
        b, c, d = a + row_length, a + row_length + row_length, a + row_length + row_length + row_length
        p, q, r, s = weights[0, k], weights[1, k], weights[2, k], weights[3, k]
        e = p * flat[a] + q * flat[b] + r * flat[c] + s * flat[d]
        f = p * flat[a + ONE] + q * flat[b + ONE] + r * flat[c + ONE] + s * flat[d + ONE]
        g = p * flat[a + TWO] + q * flat[b + TWO] + r * flat[c + TWO] + s * flat[d + TWO]
        h = p * flat[a + THREE] + q * flat[b + THREE] + r * flat[c + THREE] + s * flat[d + THREE]
        sums[out], sums[out + ONE], sums[out + TWO], sums[out + THREE] = e, f, g, h


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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def geman_mcclure(residual, tolerance, seen):
    """Robust weights s / (1 + (r / (tolerance sigma))^2)^2 (Geman and McClure), sigma from the median of |r|.

    Parameters
    ----------
    residual
        Residuals r, shape (pixel,).
    tolerance
        Residual, in standard deviations, at which the weight is a quarter of s.
    seen
        How far a pixel shows tissue, s, from 0 to 1, shape (pixel,). Pixels of 0 have no part in the median.

    Returns
    -------
    Shape (pixel,).
    """
    sample, count, known = np.empty(len(residual) // MEDIAN_STRIDE + 1), 0, 0
    for pixel in range(len(residual)):
        if seen[pixel] > 0:
            if known % MEDIAN_STRIDE == 0:
                sample[count] = abs(residual[pixel])
                count += 1
            known += 1
    scale = tolerance * MAD_TO_STD * np.median(sample[:count]) if count > 0 else 0.0
    scale, weight = scale if scale > 0 else 1.0, np.empty(len(residual))
    for pixel in range(len(residual)):
        ratio = residual[pixel] / scale
        square = 1 + ratio * ratio
        weight[pixel] = seen[pixel] / (square * square)
    return weight


@numba.njit(cache=True, nogil=True)
def robust_match(warped, template, tolerance, seen):
    """Residuals of an image, their robust weights and their forces.

    Parameters
    ----------
    warped
        Image I and its derivatives g at the displaced pixels, of :func:`interpolate_with_gradient`.
    template
        Grey values T, shape (pixel,).
    tolerance, seen
        See :func:`geman_mcclure`.

    Returns
    -------
    residual, weight
        r = I - T and w, both of shape (pixel,).
    force
        w r g, shape (pixel, 2).
    """
    residual, force = warped[:, 0] - template, np.empty((len(template), warped.shape[1] - 1))
    weight = geman_mcclure(residual, tolerance, seen)
    for pixel in range(len(template)):
        product = weight[pixel] * residual[pixel]
        for axis in range(force.shape[1]):
            force[pixel, axis] = product * warped[pixel, axis + 1]
    return residual, weight, force


@numba.njit(cache=True, nogil=True)
def add_normal_matrix(lines, gradient, weight, stride, band):
    """Add the normal matrix sum w (N grad I)(N grad I)^T of every `stride`-th point to a banded matrix.

    Unknown 2 k + c is component c of knot k; band[a, b - a + width - 1] is the entry in row a and column b of the
    lower triangle. Its transpose is what LAPACK and BLAS take as the upper triangle of a banded matrix.

    Parameters
    ----------
    lines
        See :attr:`echotruth.tracking.bspline.Cells.lines`.
    gradient, weight
        Shapes (points, 2) and (points,).
    stride
        Number of points of a cell that each point used stands for.
    band
        Shape (unknowns, width); added to.
    """
    knots, first_line, first_point, weight_x, weight_y = lines
    along, sums, cell_matrices = np.empty(30), np.empty((10, 30)), np.empty((3, 16, 16))
    for cell in range(len(knots)):
        sums[:] = 0
        point = first_point[first_line[cell]]
        for line in range(first_line[cell], first_line[cell + 1]):
            along[:] = 0
            while point < first_point[line + 1]:
                _add_point(weight_x[point], gradient[point], stride * weight[point], along)
                point += stride
            _add_line(weight_y[line], along, sums)
        for k in range(16):
            for m in range(16):
                axial, lateral = PAIR[k // 4, m // 4], PAIR[k % 4, m % 4]
                for c in range(3):
                    cell_matrices[c, k, m] = sums[axial, 3 * lateral + c]
        add_cell_matrices(knots[cell], cell_matrices, band)


@numba.njit(cache=True, nogil=True)
def _add_point(weight_x, gradient, weight, along):
    """Add w g_c g_d N_i N_j of a point for all pairs of columns of knots, and of cd = xx, xy and yy for each; (30,)."""
    gx, gy = gradient
    xx, xy, yy, entry = weight * gx * gx, weight * gx * gy, weight * gy * gy, 0
    for i in range(4):
        for j in range(i + 1):
            product = weight_x[i] * weight_x[j]
            along[entry] += xx * product
            along[entry + 1] += xy * product
            along[entry + 2] += yy * product
            entry += 3


@numba.njit(cache=True, nogil=True)
def _add_line(weight_y, along, sums):
    """Add the sums (30,) along a line times N_i N_j for all pairs of rows of knots; (10, 30)."""
    pair = 0
    for i in range(4):
        for j in range(i + 1):
            product = weight_y[i] * weight_y[j]
            for k in range(30):
                sums[pair, k] += product * along[k]
            pair += 1


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
