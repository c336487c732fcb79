"""How rough a B-spline field is along the wall and, less so, across it.

The roughness is the thin-plate energy, the sum over the pixels of |M H M|^2 with H the second derivatives of a
component of the field, in a metric M that shortens what lies across the wall: a wall thickens unevenly over a
millimetre, but what happens at one place of its circumference happens beside it too.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy import ndimage

from echotruth.tracking import cubic
from echotruth.tracking.alignment import add_cell
from echotruth.tracking.bspline import Cells


def roughness(cells: Cells, metrics: np.ndarray, size: int) -> np.ndarray:
    """Band of the matrix of the roughness, its diagonal one in the mean.

    Parameters
    ----------
    cells : Cells
        Of the pixels.
    metrics : ndarray of shape (pixel, 3)
        Entries xx, xy, yy of M.
    size : int
        Number of knots.

    Returns
    -------
    ndarray of shape (unknowns, width)
        See :func:`echotruth.tracking.alignment.add_matrix`.
    """
    lowest = np.where(cells.knots < 0, size, cells.knots).min(1)
    band = np.zeros((2 * size, 2 * int((cells.knots.max(1) - lowest).max()) + 2))
    _add(cells.knots, cells.first, *map(derivatives, cells.fraction.T), metrics, band)
    return band / band[:, -1].mean()


def metric(mask: np.ndarray, wide: np.ndarray, width: float, across: float) -> np.ndarray:
    """Metric of every pixel: 1 along the wall and `across` through it, in between where the wall has no direction.

    Parameters
    ----------
    mask, wide : ndarray of shape (axial, lateral), bool
        The wall, and the pixels that are wanted.
    width : float
        Standard deviation of the Gaussian over which directions are averaged, px.
    across : float
        Length of a unit through the wall.

    Returns
    -------
    ndarray of shape (pixel, 3)
        Entries xx, xy, yy, in the order of the True pixels of `wide`.
    """
    depth = ndimage.distance_transform_edt(~mask) - ndimage.distance_transform_edt(mask)
    down, right = np.gradient(ndimage.gaussian_filter(depth, 1.0))
    xx, xy, yy = (ndimage.gaussian_filter(each, width)[wide] for each in (right**2, right * down, down**2))
    trace = np.maximum(xx + yy, 1e-12)
    less = 1 - across
    return np.stack([1 - less * xx / trace, -less * xy / trace, 1 - less * yy / trace], -1)


def derivatives(fraction: np.ndarray) -> np.ndarray:
    """Shares of cubic B-splines with their first and second derivatives at fractions (point,); (point, 3, 4)."""
    kinds = (cubic.shares, cubic.slopes, cubic.bends)
    return np.stack([np.stack(kind(fraction), -1) for kind in kinds], 1)


@numba.njit(cache=True, nogil=True)
def _add(knots, first, across, down, metrics, band):
    local = np.zeros((3, 16, 16))
    for cell in range(len(knots)):
        local[:] = 0
        for point in range(first[cell], first[cell + 1]):
            bent = _bent(across[point], down[point], metrics[point])
            for k in range(16):
                for m in range(16):
                    local[0, k, m] += bent[k, 0] * bent[m, 0] + 2 * bent[k, 1] * bent[m, 1] + bent[k, 2] * bent[m, 2]
        local[2] = local[0]
        add_cell(knots[cell], local, band)


@numba.njit(cache=True, nogil=True)
def _bent(across, down, metric):
    """Entries xx, xy, yy of M H M of each of the 16 splines at a point."""
    a, b, c = metric
    bent = np.empty((16, 3))
    for k in range(16):
        i, j = k // 4, k % 4
        xx, xy, yy = down[0, i] * across[2, j], down[1, i] * across[1, j], down[2, i] * across[0, j]
        bent[k, 0] = a * a * xx + 2 * a * b * xy + b * b * yy
        bent[k, 1] = a * b * xx + (a * c + b * b) * xy + b * c * yy
        bent[k, 2] = b * b * xx + 2 * b * c * xy + c * c * yy
    return bent
