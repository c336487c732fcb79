"""Displacement fields from vectors at the centres of windows: outliers, smoothing, and spline interpolation."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.imaging import spline
from echotruth.tracking import cubic
from echotruth.tracking.windows import Windows

MAX_RESIDUAL = 2.0
"""Normalised residual above which a vector is an outlier (Westerweel and Scarano 2005)."""
NOISE_LEVEL = 0.1
"""Scatter of vectors from measurement noise alone, px (Westerweel and Scarano 2005)."""


def replace_outliers(field: np.ndarray) -> np.ndarray:
    """Replace outliers and missing vectors.

    Normalised median test |u - u_m| / (r_m + 0.1 px) > 2 (Westerweel and Scarano 2005, Exp Fluids 39:1096), where u_m
    is the median of the eight neighbours and r_m that of their distances from u_m: an outlier is replaced by u_m.
    Vectors still missing are replaced by the nearest.

    Parameters
    ----------
    field : ndarray of shape (rows, columns, 2)
        px; NaN where unknown.

    Returns
    -------
    ndarray of the same shape
        0 throughout if no vector is known.
    """
    rows, columns = field.shape[:2]
    padded = np.pad(field, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    neighbours = [padded[i : i + rows, j : j + columns] for i, j in np.ndindex(3, 3) if (i, j) != (1, 1)]
    median = _nanmedian(np.stack(neighbours))
    scatter = _nanmedian(np.abs(neighbours - median))
    residual = np.linalg.norm((field - median) / (scatter + NOISE_LEVEL), axis=-1)
    result = np.where((residual <= MAX_RESIDUAL)[..., None], field, median)
    missing = np.isnan(result).any(-1)
    if missing.all():
        return np.zeros_like(field)
    nearest = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    return result[tuple(nearest)]


def _nanmedian(values: np.ndarray) -> np.ndarray:
    """Median along the first axis without NaN; NaN where all are, without the warning of NumPy."""
    last = np.maximum(np.isfinite(values).sum(0, keepdims=True) - 1, 0)
    ranked = np.sort(values, axis=0)
    return sum(np.take_along_axis(ranked, k, axis=0)[0] for k in (last // 2, last - last // 2)) / 2


def smooth(field: np.ndarray) -> np.ndarray:
    """Average each vector (rows, columns, 2) with its neighbours, with the weights 1/4, 1/2, 1/4 along both axes."""
    for axis in (0, 1):
        field = ndimage.convolve1d(field, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
    return field


@dataclass(frozen=True)
class DisplacementField:
    """Cubic spline through the displacement at the centres of windows; constant beyond the outermost centres.

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
        """Displacement (n, 2) at points (n, 2): lateral, axial, px; NaN outside the image."""
        inside = np.all((points >= 0) & (points <= np.array(self.shape[::-1]) - 1), axis=1)
        (column, weight_x), (row, weight_y) = self.weights(*np.where(inside[:, None], points, 0).T)
        around = np.arange(4)
        local = self.coefficients[row[:, None, None] + around[:, None], column[:, None, None] + around]
        return np.where(inside[:, None], np.einsum("na,nb,nabk->nk", weight_y, weight_x, local), np.nan)

    def mean(self, windows: Windows) -> np.ndarray:
        """Mean over the pixels of other windows, shape (rows, columns, 2)."""
        result = self.coefficients
        for corners, (first, weights) in zip((windows.left, windows.top), self.pixel_weights, strict=True):
            matrix = np.zeros((len(first), result.shape[1]))
            matrix[np.arange(len(first))[:, None], first[:, None] + np.arange(4)] = weights
            window_mean = matrix[corners[:, None] + np.arange(windows.side)].mean(1)
            # The processed axis becomes the first, so that the other one comes next.
            result = np.einsum("jb,abk->jak", window_mean, result)
        return result

    @property
    def pixel_weights(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """:meth:`weights` of all columns and rows of the image."""
        return self.weights(*(np.arange(size, dtype=float) for size in self.shape[::-1]))

    def weights(self, lateral: np.ndarray, axial: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """For both coordinates (n,), px: the first of their four coefficients, and their weights (n, 4)."""
        result = []
        for position, corners in ((lateral, self.windows.left), (axial, self.windows.top)):
            index = (position - corners[0] - (self.windows.side - 1) / 2) / (corners[1] - corners[0])
            index = np.clip(index, 0, len(corners) - 1)
            first = np.minimum(index.astype(int), len(corners) - 2)
            result.append((first, np.stack(cubic.bspline_weights(index - first), -1)))
        return tuple(result)


def displacement_field(vectors: np.ndarray, windows: Windows, shape: tuple[int, int]) -> DisplacementField:
    """Spline through the vectors (rows, columns, 2), all finite, px, at the centres of windows."""
    components = np.moveaxis(vectors, -1, 0)
    parts = [spline.coefficients(np.ascontiguousarray(component, np.float32)) for component in components]
    return DisplacementField(np.stack(parts, -1), windows, shape)
