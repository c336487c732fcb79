"""Cubic splines through samples on an even grid (Unser, Aldroubi, Eden 1993, IEEE Trans Signal Process 41:821).

Beyond the first and last sample the data are mirrored about it. The bytes do not depend on the number of threads.
"""

import numba
import numpy as np

POLE = np.float32(np.sqrt(3) - 2)
"""Pole z of the recursive filter 6 / (z^-1 + 4 + z) that turns samples into coefficients; its gain is 6."""
HORIZON = 14
"""Samples after which the impulse response of the filter is negligible: POLE^14 is 1e-8."""
TRANSPOSE_BLOCK = 32
"""Side of the square blocks that are transposed at a time, samples."""


@numba.njit(cache=True, nogil=True)
def prefilter(values):
    """Turn samples along the first axis into spline coefficients, in place; (n, columns), float32, n of 2 or more."""
    n, columns = values.shape
    power = POLE
    for k in range(1, min(n, HORIZON)):
        for column in range(columns):
            values[0, column] += power * values[k, column]
        power *= POLE
    for k in range(1, n):
        for column in range(columns):
            values[k, column] += POLE * values[k - 1, column]
    scale = POLE / (POLE * POLE - np.float32(1))
    for column in range(columns):
        values[n - 1, column] = scale * (values[n - 1, column] + POLE * values[n - 2, column])
    for k in range(n - 2, -1, -1):
        for column in range(columns):
            values[k, column] = POLE * (values[k + 1, column] - values[k, column])


@numba.njit(cache=True, nogil=True)
def scaled_transpose(values, factor):
    """Transpose of values (n, m) times a factor, (m, n), block by block to stay in the cache."""
    rows, columns = values.shape
    result = np.empty((columns, rows), np.float32)
    for top in range(0, rows, TRANSPOSE_BLOCK):
        for left in range(0, columns, TRANSPOSE_BLOCK):
            for i in range(top, min(top + TRANSPOSE_BLOCK, rows)):
                for j in range(left, min(left + TRANSPOSE_BLOCK, columns)):
                    result[j, i] = factor * values[i, j]
    return result


@numba.njit(cache=True, nogil=True)
def coefficients(samples):
    """Spline coefficients of samples (rows, columns), float32, with a mirrored margin: (rows + 3, columns + 3)."""
    rows, columns = samples.shape
    gain = np.float32(6)
    values = samples.copy()
    prefilter(values)
    # Transposed, so that the recursion runs over many rows at a time.
    transposed = scaled_transpose(values, gain)
    prefilter(transposed)
    values = scaled_transpose(transposed, gain)
    padded = np.empty((rows + 3, columns + 3), np.float32)
    for i in range(rows + 3):
        row = values[mirrored_index(i - 1, rows)]
        for j in range(columns + 3):
            padded[i, j] = row[mirrored_index(j - 1, columns)]
    return padded


@numba.njit(cache=True, nogil=True)
def mirrored_index(index, size):
    """Index of the sample whose mirror image is at an index up to two samples outside."""
    return size - 1 - abs(size - 1 - abs(index))


@numba.njit(cache=True)
def bspline_weights(u):
    """Cubic B-spline: weights of four neighbouring coefficients at a fraction u (float32) between the middle two."""
    one, sixth = np.float32(1), np.float32(1 / 6)
    v = one - u
    return (
        v * v * v * sixth,
        np.float32(2 / 3) - u * u * (one - u * np.float32(0.5)),
        np.float32(2 / 3) - v * v * (one - v * np.float32(0.5)),
        u * u * u * sixth,
    )


@numba.njit(cache=True)
def bspline_slopes(u):
    """Derivatives of :func:`bspline_weights` by the fraction u (float32)."""
    half, three_halves, two = np.float32(0.5), np.float32(1.5), np.float32(2)
    v = np.float32(1) - u
    return -v * v * half, u * (three_halves * u - two), v * (two - three_halves * v), u * u * half


@numba.njit(cache=True, nogil=True)
def value(padded, row, column):
    """Value of a spline, from its :func:`coefficients`, at one point (float32), from 0 to the last sample."""
    i = min(np.int32(row), padded.shape[0] - 5)
    j = min(np.int32(column), padded.shape[1] - 5)
    row_weights, column_weights = bspline_weights(row - np.float32(i)), bspline_weights(column - np.float32(j))
    total = np.float32(0)
    for a in range(4):
        line = padded[i + a]
        row_sum = np.float32(0)
        for b in range(4):
            row_sum += column_weights[b] * line[j + b]
        total += row_weights[a] * row_sum
    return total


@numba.njit(cache=True)
def evaluate(padded, row, column, values):
    """Values of a spline at points.

    Parameters
    ----------
    padded
        The :func:`coefficients`.
    row, column
        Coordinates of the points, shape (points,), float32, from 0 to the last sample.
    values
        Written: shape (points,), float32.
    """
    for k in range(len(row)):
        values[k] = value(padded, row[k], column[k])
