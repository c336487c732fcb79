"""Zero-normalised cross-correlation of windows of two images over a range of whole-pixel lags.

Lags are summed side by side, so that the order of no sum changes with the machine or the number of threads.
"""

import numba
import numpy as np

from echotruth.tracking.grey import MIN_STD
from echotruth.tracking.windows import Windows

LANES = 8
"""Lags that are summed side by side."""


def has_texture(image: np.ndarray, windows: Windows) -> np.ndarray:
    """Windows (rows, columns), bool, of an image (axial, lateral) that have texture and no pixel without a value."""
    textured = np.empty((len(windows.top), len(windows.left)), bool)
    _has_texture(image, windows.top, windows.left, windows.side, textured)
    return textured


def match_windows(
    first: np.ndarray, second: np.ndarray, windows: Windows, textured: np.ndarray, max_lag: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shift of the texture of each window from one image to another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral), float32
        Grey values from 0 to 1; NaN where unknown. Outside the image its border is taken.
    windows : Windows
    textured : ndarray of shape (rows, columns), bool
        Windows to be matched, all of which :func:`has_texture`.
    max_lag : int
        Largest lag, px.

    Returns
    -------
    shift : ndarray of shape (rows, columns, 2)
        Lateral, axial, px; NaN for the other windows, and where the maximum is at the largest lag.
    peak : ndarray of shape (rows, columns)
        Largest correlation, from -1 to 1; NaN for the other windows, and where the second image has no texture.
    """
    row, column = np.nonzero(textured)
    ncc = np.empty((len(row), 2 * max_lag + 1, 2 * max_lag + 1), np.float32)
    correlate(first, second, np.stack([windows.top[row], windows.left[column]], -1), windows.side, ncc)
    shift, peak = np.full((*textured.shape, 2), np.nan), np.full(textured.shape, np.nan)
    shift[textured], peak[textured] = subpixel_peaks(ncc)
    return shift, peak


@numba.njit(cache=True, nogil=True)
def _has_texture(image, top, left, side, textured):
    for i in range(len(top)):
        for j in range(len(left)):
            total, square = 0.0, 0.0
            for y in range(top[i], top[i] + side):
                for x in range(left[j], left[j] + side):
                    total += image[y, x]
                    square += image[y, x] * image[y, x]
            textured[i, j] = square / side**2 - (total / side**2) ** 2 > MIN_STD**2


@numba.njit(cache=True, nogil=True)
def correlate(first, second, corners, side, ncc):
    """Correlate windows of one image with another at all lags.

    Parameters
    ----------
    first, second
        See :func:`match_windows`.
    corners
        First row and column of each window, shape (n, 2).
    side
        Of a window, px.
    ncc
        Output, shape (n, lags, lags), axial lag first; NaN where either image has no texture or lacks a value.
    """
    lags = ncc.shape[1]
    max_lag, lanes = lags // 2, LANES * ((lags + LANES - 1) // LANES)
    template, search = np.empty((side, side), np.float32), np.zeros((side + lags - 1, side + lanes), np.float32)
    products = np.empty((lags, lanes), np.float32)
    for window in range(len(corners)):
        top, left = corners[window, 0], corners[window, 1]
        norm = extract_zero_mean(first, top, left, template)
        for y in range(side + lags - 1):
            for x in range(side + lags - 1):
                row, column = top - max_lag + y, left - max_lag + x
                row, column = min(max(row, 0), second.shape[0] - 1), min(max(column, 0), second.shape[1] - 1)
                search[y, x] = second[row, column]
        sum_products(template, search, products)
        normalise(products, norm, search, side, ncc[window])


@numba.njit(cache=True, nogil=True)
def extract_zero_mean(image, top, left, template):
    """Write the grey values of a window less their mean; return the root of the sum of their squares."""
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
def sum_products(template, search, products):
    """Write the sums of products of a template and a search area at all lags (lags, lanes); lanes beyond are unused."""
    side = len(template)
    lags, lanes = products.shape
    fours = side - side % 4
    for axial_lag in range(lags):
        total = products[axial_lag]
        for lane in range(lanes):
            total[lane] = 0
        for y in range(side):
            line = search[y + axial_lag]
            # Four at a time, so that the totals are not fetched and stored for each.
            for x in range(0, fours, 4):
                a, b, c, d = template[y, x], template[y, x + 1], template[y, x + 2], template[y, x + 3]
                part = line[x : x + lanes + 3]
                for lane in range(lanes):
                    total[lane] += (a * part[lane] + b * part[lane + 1]) + (c * part[lane + 2] + d * part[lane + 3])
            for x in range(fours, side):
                a, part = template[y, x], line[x : x + lanes]
                for lane in range(lanes):
                    total[lane] += a * part[lane]


@numba.njit(cache=True, nogil=True)
def normalise(products, norm, search, side, ncc):
    """Divide sums of products by the norms of the template and of the part of the search area, at every lag."""
    size = side + len(ncc) - 1
    value, square = np.zeros(size), np.zeros(size)
    for y in range(size):
        # Running sums over rows: one enters, one leaves. The products of a pixel without a value are NaN already.
        for x in range(size):
            new = np.float64(search[y, x]) if search[y, x] == search[y, x] else 0.0
            old = np.float64(search[y - side, x]) if y >= side and search[y - side, x] == search[y - side, x] else 0.0
            value[x] += new - old
            square[x] += new * new - old * old
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
                i, j = y - side + 1, x - side + 1
                variance = power / side**2 - (total / side**2) ** 2
                textured = variance > MIN_STD**2 and norm > MIN_STD * side
                ncc[i, j] = products[i, j] / (norm * side * np.sqrt(variance)) if textured else np.nan


def subpixel_peaks(ncc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and height of the largest value of each correlation map.

    Three-point Gaussian fit along each axis, with c the correlation (Willert and Gharib 1991, Exp Fluids 10:181):
    (ln c_-1 - ln c_+1) / (2 (ln c_-1 - 2 ln c_0 + ln c_+1)).

    Parameters
    ----------
    ncc : ndarray of shape (n, lags, lags)
        Axial lag first; lag 0 is in the middle.

    Returns
    -------
    shift : ndarray of shape (n, 2)
        Lateral, axial, px; NaN where the largest value is on the border or a neighbour is not above 0.
    peak : ndarray of shape (n,)
    """
    count, lags = ncc.shape[:2]
    flat = np.where(np.isnan(ncc), -1, ncc).reshape(count, lags**2)
    largest = np.stack(np.divmod(flat.argmax(-1), lags), -1)
    maps = np.arange(count)
    inner = np.clip(largest, 1, lags - 2)
    shifts = []
    for axis in (1, 0):
        indices = [inner + k * (np.arange(2) == axis) for k in (-1, 0, 1)]
        value = np.stack([ncc[maps, index[:, 0], index[:, 1]] for index in indices])
        before, middle, after = np.log(np.where(value > 0, value, np.nan))
        curvature = before - 2 * middle + after
        offset = (before - after) / 2 / np.where(curvature < 0, curvature, np.nan)
        shifts.append(inner[:, axis] - lags // 2 + offset)
    shift = np.stack(shifts, -1)
    shift[(inner != largest).any(-1)] = np.nan
    return shift, np.where(np.isnan(ncc).all((-2, -1)), np.nan, flat.max(-1))
