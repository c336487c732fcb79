"""Cubic splines through samples on an even grid (Unser, Aldroubi, Eden 1993, IEEE Trans Signal Process 41:821).

Beyond the first and last sample the data are mirrored about it. One thread makes a row, a part of the columns or a
point, so the bytes do not depend on the number of threads.
"""

from __future__ import annotations

import numba
import numpy as np

POLE = np.float32(np.sqrt(3) - 2)
"""Pole of the filter that turns samples into coefficients; its gain is 6."""
MEMORY = 14
"""Samples after which the filter has forgotten: POLE^14 is 1e-8."""
COLUMNS = 64
"""Columns, or rows, that one thread filters at a time."""


@numba.njit(cache=True)
def filter_rows(values):
    """Turn samples along the first axis into spline coefficients, in place; (n, columns), float32, n of 2 or more."""
    n, columns = values.shape
    start = np.zeros(columns, np.float32)
    power = np.float32(1)
    for k in range(min(n, MEMORY)):
        start += power * values[k]
        power *= POLE
    values[0] = start
    for k in range(1, n):
        for column in range(columns):
            values[k, column] += POLE * values[k - 1, column]
    scale = POLE / (POLE * POLE - np.float32(1))
    for column in range(columns):
        values[n - 1, column] = scale * (values[n - 1, column] + POLE * values[n - 2, column])
    for k in range(n - 2, -1, -1):
        for column in range(columns):
            values[k, column] = POLE * (values[k + 1, column] - values[k, column])
    values *= np.float32(6)


@numba.njit(parallel=True, cache=True)
def coefficients(samples):
    """Spline coefficients of samples (rows, columns), float32, with a mirrored margin: (rows + 3, columns + 3)."""
    rows, columns = samples.shape
    padded = np.empty((rows + 3, columns + 3), np.float32)
    for block in numba.prange((columns + COLUMNS - 1) // COLUMNS):
        part = slice(block * COLUMNS, min((block + 1) * COLUMNS, columns))
        padded[1 : rows + 1, 1 + part.start : 1 + part.stop] = samples[:, part]
        filter_rows(padded[1 : rows + 1, 1 + part.start : 1 + part.stop])
    for block in numba.prange((rows + COLUMNS - 1) // COLUMNS):
        part = padded[1 + block * COLUMNS : 1 + min((block + 1) * COLUMNS, rows)]
        # Turned, so that many rows go through the recursion at a time.
        turned = part[:, 1 : columns + 1].T.copy()
        filter_rows(turned)
        part[:, 1 : columns + 1] = turned.T
        part[:, 0], part[:, columns + 1], part[:, columns + 2] = part[:, 2], part[:, columns - 1], part[:, columns - 2]
    padded[0], padded[rows + 1], padded[rows + 2] = padded[2], padded[rows - 1], padded[rows - 2]
    return padded


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
        i = min(np.int32(row[k]), padded.shape[0] - 5)
        j = min(np.int32(column[k]), padded.shape[1] - 5)
        down, across = shares(row[k] - np.float32(i)), shares(column[k] - np.float32(j))
        total = np.float32(0)
        for a in range(4):
            line = padded[i + a]
            part = np.float32(0)
            for b in range(4):
                part += across[b] * line[j + b]
            total += down[a] * part
        values[k] = total
