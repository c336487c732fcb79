"""Motion at the centres of windows: what does not fit its neighbours, what is missing, and what lies between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.imaging import spline
from echotruth.tracking import cubic
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


@dataclass(frozen=True)
class Motion:
    """Cubic spline through the motion at the centres of windows; beyond the outermost centres, theirs.

    Attributes
    ----------
    coefficients : ndarray of shape (rows + 3, columns + 3, 2), float32
        Of the spline, with a margin: lateral, axial, px.
    windows : Windows
        Two or more rows and columns.
    shape : tuple of int
        Axial and lateral size of the image, px.
    """

    coefficients: np.ndarray
    windows: Windows
    shape: tuple[int, int]

    def at(self, points: np.ndarray) -> np.ndarray:
        """Motion (n, 2) at points (n, 2): lateral, axial, px; NaN outside the image."""
        inside = ((points >= 0) & (points <= np.array(self.shape[::-1]) - 1)).all(1)
        (column, across), (row, down) = self.cells(*np.where(inside[:, None], points, 0).T)
        around = np.arange(4)
        near = self.coefficients[row[:, None, None] + around[:, None], column[:, None, None] + around]
        return np.where(inside[:, None], np.einsum("na,nb,nabk->nk", down, across, near), np.nan)

    def mean(self, windows: Windows) -> np.ndarray:
        """Mean over the pixels of other windows, shape (rows, columns, 2)."""
        result = self.coefficients
        for corners, (first, shares) in zip((windows.left, windows.top), self.pixels, strict=True):
            each = np.zeros((len(first), result.shape[1]))
            each[np.arange(len(first))[:, None], first[:, None] + np.arange(4)] = shares
            part = each[corners[:, None] + np.arange(windows.side)].mean(1)
            # The axis that is done goes to the front, so that the other one comes next.
            result = np.einsum("jb,abk->jak", part, result)
        return result

    @property
    def pixels(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """:meth:`cells` of all columns and rows of the image."""
        return self.cells(*(np.arange(size, dtype=float) for size in self.shape[::-1]))

    def cells(self, lateral: np.ndarray, axial: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """First of the four columns and rows of coefficients at places (n,), px, and the shares (n, 4) of these."""
        result = []
        for place, start in ((lateral, self.windows.left), (axial, self.windows.top)):
            index = (place - start[0] - (self.windows.side - 1) / 2) / (start[1] - start[0])
            index = np.clip(index, 0, len(start) - 1)
            first = np.minimum(index.astype(int), len(start) - 2)
            result.append((first, np.stack(cubic.shares(index - first), -1)))
        return tuple(result)


def motion(field: np.ndarray, windows: Windows, shape: tuple[int, int]) -> Motion:
    """Motion between the centres of windows, from that at them: (rows, columns, 2), all finite, px."""
    parts = [spline.coefficients(np.ascontiguousarray(each, np.float32)) for each in np.moveaxis(field, -1, 0)]
    return Motion(np.stack(parts, -1), windows, shape)
