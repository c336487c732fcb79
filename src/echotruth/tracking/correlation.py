"""Zero-normalised cross-correlation of windows of two images over a range of whole-pixel lags.

Lags are summed side by side, so that the order of no sum changes with the machine or the number of threads.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.tracking.grey import FAINTEST
from echotruth.tracking.windows import Windows


def match(first: np.ndarray, second: np.ndarray, windows: Windows, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Where the texture under each window of one image is in another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral), float32
        Grey values from 0 to 1; NaN where there are none.
    windows : Windows
        Where to look.
    reach : int
        Largest lag, px.

    Returns
    -------
    shift : ndarray of shape (rows, columns, 2)
        Lateral, axial, px; NaN where a window has no texture, and where no lag within reach is the best.
    peak : ndarray of shape (rows, columns)
        Largest correlation, from -1 to 1; NaN where a window has no texture.
    """
    side = windows.side
    wide = np.pad(second, reach, mode="edge")
    deviation = np.sqrt(np.maximum(_variance(wide, side), 0))
    template = windows.cut(first)
    template -= template.mean((-2, -1), keepdims=True)
    norm = np.sqrt((template**2).sum((-2, -1)))
    norm[~(norm > FAINTEST * side)] = np.nan
    plane = np.empty((*norm.shape, 2 * reach + 1, 2 * reach + 1), np.float32)
    correlate(template.astype(np.float32), norm, np.nan_to_num(wide), windows.top, windows.left, plane)
    lag = np.arange(2 * reach + 1)
    spread = deviation[
        windows.top[:, None, None, None] + lag[:, None], windows.left[None, :, None, None] + lag[None, None, None, :]
    ]
    plane = plane / (norm[..., None, None] * side * np.where(spread > FAINTEST, spread, np.nan))
    return peaks(plane)


def _variance(image: np.ndarray, side: int) -> np.ndarray:
    """Variance of the window that starts at each pixel; NaN where it holds a pixel without a value."""
    known = np.isfinite(image)
    value = np.where(known, image, 0).astype(float)
    sums = []
    for each in (value, value**2, 1.0 - known):
        corner = np.pad(each, ((1, 0), (1, 0))).cumsum(0).cumsum(1)
        sums.append(corner[side:, side:] - corner[:-side, side:] - corner[side:, :-side] + corner[:-side, :-side])
    mean = sums[0] / side**2
    return np.where(sums[2] > 0.5, np.nan, sums[1] / side**2 - mean**2)


@numba.njit(parallel=True, cache=True)
def correlate(template, norm, image, top, left, plane):
    """Sums of products of windows and an image at all lags.

    Parameters
    ----------
    template
        Windows less their means, shape (rows, columns, side, side), float32.
    norm
        Root of the sum of their squares, shape (rows, columns); NaN where a window is left out.
    image
        float32; window (i, j) at lag (0, 0) starts at its pixel (top[i], left[j]).
    plane
        Written, NaN for windows left out: shape (rows, columns, lags, lags), float32, axial lag first.
    """
    rows, columns, side, _ = template.shape
    lags = plane.shape[2]
    for window in numba.prange(rows * columns):
        i, j = window // columns, window % columns
        if np.isnan(norm[i, j]):
            plane[i, j] = np.nan
            continue
        plane[i, j] = 0
        for y in range(side):
            for down in range(lags):
                line = image[top[i] + y + down, left[j] : left[j] + side + lags - 1]
                total = plane[i, j, down]
                for x in range(side):
                    grey = template[i, j, y, x]
                    for across in range(lags):
                        total[across] += grey * line[x + across]


def peaks(plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and heights of the largest of each plane of correlations.

    A Gaussian through three neighbours along each axis (Willert and Gharib 1991, Exp Fluids 10:181).

    Parameters
    ----------
    plane : ndarray of shape (rows, columns, lags, lags)
        Axial lag first; the middle is no lag.

    Returns
    -------
    shift : ndarray of shape (rows, columns, 2)
        Lateral, axial, px; NaN where the largest lies on the border or a neighbour is not above 0.
    peak : ndarray of shape (rows, columns)
    """
    rows, columns, lags = plane.shape[:3]
    flat = np.where(np.isnan(plane), -1, plane).reshape(rows, columns, -1)
    place = np.stack(np.divmod(flat.argmax(-1), lags), -1)
    row, column = np.ogrid[:rows, :columns]
    inner = np.clip(place, 1, lags - 2)
    shift = []
    for axis in (1, 0):
        near = [inner + k * (np.arange(2) == axis) for k in (-1, 0, 1)]
        value = np.stack([plane[row, column, each[..., 0], each[..., 1]] for each in near])
        before, middle, after = np.log(np.where(value > 0, value, np.nan))
        bend = before - 2 * middle + after
        shift.append(inner[..., axis] - lags // 2 + (before - after) / 2 / np.where(bend < 0, bend, np.nan))
    shift = np.stack(shift, -1)
    shift[(inner != place).any(-1)] = np.nan
    return shift, np.where(np.isnan(plane).all((-2, -1)), np.nan, flat.max(-1))
