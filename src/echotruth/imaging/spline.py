"""Cubic splines through samples on an even grid (Unser, Aldroubi, Eden 1993, IEEE Trans Signal Process 41:821).

Beyond the first and last sample the data are mirrored about it. One thread makes all coefficients, and one a point, so
the bytes do not depend on the number of threads.
"""

from __future__ import annotations

import numba
import numpy as np

POLE = np.float32(np.sqrt(3) - 2)
"""Pole of the filter that turns samples into coefficients; its gain is 6."""
MEMORY = 14
"""Samples after which the filter has forgotten: POLE^14 is 1e-8."""
SQUARE = 32
"""Samples along a side of what is turned at a time."""


@numba.njit(cache=True, nogil=True)
def filter_rows(values):
    """Turn samples along the first axis into spline coefficients, in place; (n, columns), float32, n of 2 or more."""
    n, columns = values.shape
    power = POLE
    for k in range(1, min(n, MEMORY)):
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
def turned(values, factor):
    """Values (n, m) times a factor as (m, n), square by square, for a processor holds no more of lines far apart."""
    rows, columns = values.shape
    result = np.empty((columns, rows), np.float32)
    for top in range(0, rows, SQUARE):
        for left in range(0, columns, SQUARE):
            for i in range(top, min(top + SQUARE, rows)):
                for j in range(left, min(left + SQUARE, columns)):
                    result[j, i] = factor * values[i, j]
    return result


@numba.njit(cache=True, nogil=True)
def coefficients(samples):
    """Spline coefficients of samples (rows, columns), float32, with a mirrored margin: (rows + 3, columns + 3)."""
    rows, columns = samples.shape
    gain = np.float32(6)
    values = samples.copy()
    filter_rows(values)
    # Turned, so that many rows go through the recursion at a time.
    across = turned(values, gain)
    filter_rows(across)
    values = turned(across, gain)
    padded = np.empty((rows + 3, columns + 3), np.float32)
    for i in range(rows + 3):
        line = values[mirrored(i - 1, rows)]
        for j in range(columns + 3):
            padded[i, j] = line[mirrored(j - 1, columns)]
    return padded


@numba.njit(cache=True, nogil=True)
def mirrored(index, size):
    """Index of the sample that stands at a place up to two samples outside."""
    return size - 1 - abs(size - 1 - abs(index))


@numba.njit(cache=True)
def shares(u):
    """Shares of four neighbouring coefficients at a fraction u (float32) between the middle two: the cubic B-spline."""
    one, sixth = np.float32(1), np.float32(1 / 6)
    v = one - u
    return (
        v * v * v * sixth,
        np.float32(2 / 3) - u * u * (one - u * np.float32(0.5)),
        np.float32(2 / 3) - v * v * (one - v * np.float32(0.5)),
        u * u * u * sixth,
    )


@numba.njit(cache=True, nogil=True)
def value(padded, row, column):
    """Value of a spline, as :func:`coefficients` makes it, at one point (float32), from 0 to the last sample."""
    i = min(np.int32(row), padded.shape[0] - 5)
    j = min(np.int32(column), padded.shape[1] - 5)
    down, across = shares(row - np.float32(i)), shares(column - np.float32(j))
    total = np.float32(0)
    for a in range(4):
        line = padded[i + a]
        part = np.float32(0)
        for b in range(4):
            part += across[b] * line[j + b]
        total += down[a] * part
    return total


@numba.njit(parallel=True, cache=True)
def at_points(padded, row, column, values):
    """Values of a spline at points.

    Parameters
    ----------
    padded
        As :func:`coefficients` makes it.
    row, column
        Of the points, shape (points,), float32, from 0 to the last sample.
    values
        Written: shape (points,), float32.
    """
    for k in numba.prange(len(row)):
        values[k] = value(padded, row[k], column[k])
