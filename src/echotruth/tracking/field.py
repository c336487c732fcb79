"""Motion at the centres of windows: what does not fit its neighbours, what is missing, and what lies between."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from echotruth.imaging import spline
from echotruth.tracking.windows import Windows

DOUBT = 2.0
"""Normalised residual above which a vector counts as an outlier (Westerweel and Scarano 2005)."""
NOISE = 0.1
"""Scatter of vectors that is there in any case, px (the same)."""


def validated(field: np.ndarray) -> np.ndarray:
    """A field whose outliers and missing vectors are replaced.

    Normalised median test of Westerweel and Scarano 2005 (Exp Fluids 39:1096), eight neighbours: an outlier becomes
    their median. What then is missing becomes the nearest vector there is.

    Parameters
    ----------
    field : ndarray of shape (rows, columns, 2)
        px; NaN where there is none.

    Returns
    -------
    ndarray of the same shape
        0 throughout if no vector is known.
    """
    rows, columns = field.shape[:2]
    padded = np.pad(field, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    near = [padded[i : i + rows, j : j + columns] for i, j in np.ndindex(3, 3) if (i, j) != (1, 1)]
    middle = _median(np.stack(near))
    scatter = _median(np.abs(near - middle))
    residual = np.linalg.norm((field - middle) / (scatter + NOISE), axis=-1)
    result = np.where((residual <= DOUBT)[..., None], field, middle)
    missing = np.isnan(result).any(-1)
    if missing.all():
        return np.zeros_like(field)
    nearest = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    return result[tuple(nearest)]


def _median(values: np.ndarray) -> np.ndarray:
    """Median along the first axis of what is not NaN; NaN where nothing is."""
    last = np.maximum(np.isfinite(values).sum(0, keepdims=True) - 1, 0)
    ranked = np.sort(values, axis=0)
    return sum(np.take_along_axis(ranked, k, axis=0)[0] for k in (last // 2, last - last // 2)) / 2


def smooth(field: np.ndarray) -> np.ndarray:
    """Each vector (rows, columns, 2) averaged with its eight neighbours, with weights of 1/4, 1/2, 1/4 either way."""
    for axis in (0, 1):
        field = ndimage.convolve1d(field, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
    return field


def dense(field: np.ndarray, windows: Windows, shape: tuple[int, int]) -> np.ndarray:
    """Cubic spline through the centres of windows at every pixel; beyond the outermost centres, theirs.

    Parameters
    ----------
    field : ndarray of shape (rows, columns, 2)
        px, all finite; two or more rows and columns.
    windows : Windows
    shape : tuple of int
        Axial and lateral size of the image, px.

    Returns
    -------
    ndarray of shape (axial, lateral, 2), float32
        px.
    """
    place = []
    for size, start in zip(shape, (windows.top, windows.left), strict=True):
        index = (np.arange(size) - start[0] - (windows.side - 1) / 2) / (start[1] - start[0])
        place.append(np.clip(index, 0, len(start) - 1))
    row, column = np.meshgrid(*place, indexing="ij")
    return np.stack([resample(each, row, column) for each in np.moveaxis(field, -1, 0)], -1)


def resample(samples: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Cubic spline through samples on an even grid, at places inside it.

    Parameters
    ----------
    samples : ndarray of shape (rows, columns)
        Two or more of both.
    row, column : ndarray of one shape
        From 0 to the last sample.

    Returns
    -------
    ndarray of that shape, float32
    """
    values = np.empty(row.size, np.float32)
    padded = spline.coefficients(np.ascontiguousarray(samples, np.float32))
    spline.at_points(padded, row.ravel().astype(np.float32), column.ravel().astype(np.float32), values)
    return values.reshape(row.shape)
