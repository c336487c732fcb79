"""Zero-normalised cross-correlation of windows of two images over a range of whole-pixel lags.

Lags are summed side by side, so that the order of no sum changes with the machine or the number of threads.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.tracking.grey import FAINTEST
from echotruth.tracking.windows import Windows

LANES = 8
"""Lags that are summed side by side."""


def textured(image: np.ndarray, windows: Windows) -> np.ndarray:
    """Which windows of an image (axial, lateral) have texture and no pixel without a value: (rows, columns), bool."""
    seen = np.empty((len(windows.top), len(windows.left)), bool)
    _textured(image, windows.top, windows.left, windows.side, seen)
    return seen


def match(
    first: np.ndarray, second: np.ndarray, windows: Windows, seen: np.ndarray, reach: int
) -> tuple[np.ndarray, np.ndarray]:
    """Where the texture under each window of one image is in another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral), float32
        Grey values from 0 to 1; NaN where there are none. Beyond the border, the border's are taken.
    windows : Windows
        Where to look.
    seen : ndarray of shape (rows, columns), bool
        Windows that are looked for, all of them :func:`textured`.
    reach : int
        Largest lag, px.

    Returns
    -------
    shift : ndarray of shape (rows, columns, 2)
        Lateral, axial, px; NaN where a window is not looked for, and where no lag within reach is the best.
    peak : ndarray of shape (rows, columns)
        Largest correlation, from -1 to 1; NaN where a window is not looked for, or has no texture at any lag.
    """
    row, column = np.nonzero(seen)
    plane = np.empty((len(row), 2 * reach + 1, 2 * reach + 1), np.float32)
    correlate(first, second, np.stack([windows.top[row], windows.left[column]], -1), windows.side, plane)
    shift, peak = np.full((*seen.shape, 2), np.nan), np.full(seen.shape, np.nan)
    shift[seen], peak[seen] = peaks(plane)
    return shift, peak


@numba.njit(cache=True, nogil=True)
def _textured(image, top, left, side, seen):
    for i in range(len(top)):
        for j in range(len(left)):
            total, square = 0.0, 0.0
            for y in range(top[i], top[i] + side):
                for x in range(left[j], left[j] + side):
                    total += image[y, x]
                    square += image[y, x] * image[y, x]
            seen[i, j] = square / side**2 - (total / side**2) ** 2 > FAINTEST**2


@numba.njit(cache=True, nogil=True)
def correlate(first, second, corners, side, plane):
    """Correlations of windows of one image with another at all lags.

    Parameters
    ----------
    first, second
        See :func:`match`.
    corners
        First row and column of every window, shape (n, 2).
    side
        Of a window, px.
    plane
        Written, NaN where either image has no texture or lacks a value: shape (n, lags, lags), axial lag first.
    """
    lags = plane.shape[1]
    reach, lanes = lags // 2, LANES * ((lags + LANES - 1) // LANES)
    template, wide = np.empty((side, side), np.float32), np.zeros((side + lags - 1, side + lanes), np.float32)
    products = np.empty((lags, lanes), np.float32)
    for window in range(len(corners)):
        top, left = corners[window]
        norm = cut(first, top, left, template)
        for y in range(side + lags - 1):
            for x in range(side + lags - 1):
                row, column = top - reach + y, left - reach + x
                row, column = min(max(row, 0), second.shape[0] - 1), min(max(column, 0), second.shape[1] - 1)
                wide[y, x] = second[row, column]
        multiply(template, wide, products)
        normalise(products, norm, wide, side, plane[window])


@numba.njit(cache=True, nogil=True)
def cut(image, top, left, template):
    """Write the grey values of a window less their mean; the root of the sum of their squares."""
    side = len(template)
    mean, square = 0.0, 0.0
    for y in range(side):
        for x in range(side):
            mean += image[top + y, left + x]
    mean /= side**2
    for y in range(side):
        for x in range(side):
            template[y, x] = image[top + y, left + x] - mean
            square += template[y, x] * template[y, x]
    return np.sqrt(square)


@numba.njit(cache=True, nogil=True)
def multiply(template, wide, products):
    """Write the sums of products of a window and a wider one at all lags (lags, lanes), and at more than are wanted."""
    side = len(template)
    lags, lanes = products.shape
    fours = side - side % 4
    for down in range(lags):
        total = products[down]
        for lane in range(lanes):
            total[lane] = 0
        for y in range(side):
            line = wide[y + down]
            # Four at a time, so that the totals are not fetched and stored for each.
            for x in range(0, fours, 4):
                a, b, c, d = template[y, x], template[y, x + 1], template[y, x + 2], template[y, x + 3]
                near = line[x : x + lanes + 3]
                for lane in range(lanes):
                    total[lane] += (a * near[lane] + b * near[lane + 1]) + (c * near[lane + 2] + d * near[lane + 3])
            for x in range(fours, side):
                a, near = template[y, x], line[x : x + lanes]
                for lane in range(lanes):
                    total[lane] += a * near[lane]


@numba.njit(cache=True, nogil=True)
def normalise(products, norm, wide, side, plane):
    """Divide sums of products by the norms of the window and of what it was compared with, at every lag."""
    size = side + len(plane) - 1
    value, square = np.zeros(size), np.zeros(size)
    for y in range(size):
        # What comes in at the bottom and what goes out at the top; the sum of a pixel without a value is NaN already.
        for x in range(size):
            new = np.float64(wide[y, x]) if wide[y, x] == wide[y, x] else 0.0
            gone = np.float64(wide[y - side, x]) if y >= side and wide[y - side, x] == wide[y - side, x] else 0.0
            value[x] += new - gone
            square[x] += new * new - gone * gone
        if y < side - 1:
            continue
        total, power = 0.0, 0.0
        for x in range(size):
            total += value[x]
            power += square[x]
            if x >= side:
                total -= value[x - side]
                power -= square[x - side]
            if x >= side - 1:
                down, across = y - side + 1, x - side + 1
                variance = power / side**2 - (total / side**2) ** 2
                known = variance > FAINTEST**2 and norm > FAINTEST * side
                plane[down, across] = products[down, across] / (norm * side * np.sqrt(variance)) if known else np.nan


def peaks(plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and heights of the largest of each plane of correlations.

    A Gaussian through three neighbours along each axis (Willert and Gharib 1991, Exp Fluids 10:181).

    Parameters
    ----------
    plane : ndarray of shape (n, lags, lags)
        Axial lag first; the middle is no lag.

    Returns
    -------
    shift : ndarray of shape (n, 2)
        Lateral, axial, px; NaN where the largest lies on the border or a neighbour is not above 0.
    peak : ndarray of shape (n,)
    """
    number, lags = plane.shape[:2]
    flat = np.where(np.isnan(plane), -1, plane).reshape(number, lags**2)
    place = np.stack(np.divmod(flat.argmax(-1), lags), -1)
    every = np.arange(number)
    inner = np.clip(place, 1, lags - 2)
    shift = []
    for axis in (1, 0):
        near = [inner + k * (np.arange(2) == axis) for k in (-1, 0, 1)]
        value = np.stack([plane[every, each[:, 0], each[:, 1]] for each in near])
        before, middle, after = np.log(np.where(value > 0, value, np.nan))
        bend = before - 2 * middle + after
        shift.append(inner[:, axis] - lags // 2 + (before - after) / 2 / np.where(bend < 0, bend, np.nan))
    shift = np.stack(shift, -1)
    shift[(inner != place).any(-1)] = np.nan
    return shift, np.where(np.isnan(plane).all((-2, -1)), np.nan, flat.max(-1))
