"""How rough a B-spline field is along the wall and, less so, across it.

The roughness is the sum over the pixels of |M H M|^2 with H the second derivatives of the field, in a metric M that
shortens what lies across the wall: a wall thickens unevenly over a millimetre, but what happens at one place of its
circumference happens beside it too. Derivatives are taken along and across the wall, of the components along and across
it, so that a ring which contracts or turns evenly is not rough. Where this frame turns by the angle phi and J is the
quarter turn, D_i u = d_i u - (d_i phi) J u, and the index of a derivative turns likewise; in a straight wall that is
the thin-plate energy.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy import ndimage

from echotruth.tracking import cubic
from echotruth.tracking.alignment import add_cell
from echotruth.tracking.bspline import Cells

VAGUE = 0.3
"""Share of the directions about a pixel that must agree for its own to be known; with less, it turns less."""


def roughness(cells: Cells, metrics: np.ndarray, turns: np.ndarray, size: int) -> np.ndarray:
    """Band of the matrix of the roughness, its diagonal one in the mean.

    Parameters
    ----------
    cells : Cells
        Of the pixels.
    metrics : ndarray of shape (pixel, 3)
        Entries xx, xy, yy of M.
    turns : ndarray of shape (pixel, 5)
        Derivatives x, y, xx, xy, yy of the angle of the frame, rad, a unit being the distance of the knots.
    size : int
        Number of knots.

    Returns
    -------
    ndarray of shape (unknowns, width)
        See :func:`echotruth.tracking.alignment.add_matrix`.
    """
    lowest = np.where(cells.knots < 0, size, cells.knots).min(1)
    band = np.zeros((2 * size, 2 * int((cells.knots.max(1) - lowest).max()) + 2))
    _add(cells.knots, cells.first, *map(derivatives, cells.fraction.T), metrics, turns, band)
    return band / band[:, -1].mean()


def frame(mask: np.ndarray, wide: np.ndarray, width: float, across: float) -> tuple[np.ndarray, np.ndarray]:
    """Metric and turning of the frame of the wall at every pixel.

    Parameters
    ----------
    mask, wide : ndarray of shape (axial, lateral), bool
        The wall, and the pixels that are wanted.
    width : float
        Standard deviation of the Gaussian over which directions are averaged, and unit of the derivatives, px.
    across : float
        Length of a unit through the wall; one along it is 1, and in between where the wall has no direction.

    Returns
    -------
    metrics : ndarray of shape (pixel, 3)
        Entries xx, xy, yy, in the order of the True pixels of `wide`.
    turns : ndarray of shape (pixel, 5)
        Derivatives x, y, xx, xy, yy of the angle, rad; less where the wall has no direction.
    """
    depth = ndimage.distance_transform_edt(~mask) - ndimage.distance_transform_edt(mask)
    down, right = np.gradient(ndimage.gaussian_filter(depth, 1.0))
    xx, xy, yy = (ndimage.gaussian_filter(each, width) for each in (right**2, right * down, down**2))
    trace = np.maximum(xx + yy, 1e-12)
    less = 1 - across
    metrics = np.stack([1 - less * xx / trace, -less * xy / trace, 1 - less * yy / trace], -1)
    # The direction has no sign, but twice its angle is known.
    cosine, sine = (xx - yy) / trace, 2 * xy / trace
    slopes = zip(np.gradient(cosine, 1 / width), np.gradient(sine, 1 / width), strict=True)
    known = 2 * np.maximum(cosine**2 + sine**2, VAGUE**2)
    y, x = ((cosine * each - sine * other) / known for other, each in slopes)
    bends = [np.gradient(each, 1 / width) for each in (x, y)]
    turns = np.stack([x, y, bends[0][1], (bends[0][0] + bends[1][1]) / 2, bends[1][0]], -1)
    return metrics[wide], turns[wide]


def derivatives(fraction: np.ndarray) -> np.ndarray:
    """Shares of cubic B-splines with their first and second derivatives at fractions (point,); (point, 3, 4)."""
    kinds = (cubic.shares, cubic.slopes, cubic.bends)
    return np.stack([np.stack(kind(fraction), -1) for kind in kinds], 1)


@numba.njit(cache=True, nogil=True)
def _add(knots, first, across, down, metrics, turns, band):
    local, straight, turned = np.zeros((3, 16, 16)), np.empty((16, 4)), np.empty((16, 4))
    for cell in range(len(knots)):
        local[:] = 0
        for point in range(first[cell], first[cell + 1]):
            for k in range(16):
                i, j = k // 4, k % 4
                _bend(down[point, :, i], across[point, :, j], turns[point], straight[k], turned[k])
                _stretch(metrics[point], straight[k])
                _stretch(metrics[point], turned[k])
            for k in range(16):
                for m in range(16):
                    for e in range(4):
                        local[0, k, m] += straight[k, e] * straight[m, e] + turned[k, e] * turned[m, e]
                        local[1, k, m] += turned[k, e] * straight[m, e] - straight[k, e] * turned[m, e]
        local[2] = local[0]
        add_cell(knots[cell], local, band)


@numba.njit(cache=True, nogil=True)
def _bend(down, across, turn, straight, turned):
    """Entries xx, xy, yx, yy of D D B e for a spline B and a unit vector e: factors of e, and of J e."""
    value, bx, by = down[0] * across[0], down[0] * across[1], down[1] * across[0]
    bxx, bxy, byy = down[0] * across[2], down[1] * across[1], down[2] * across[0]
    x, y, xx, xy, yy = turn
    straight[0] = bxx - x * x * value + x * by
    straight[1] = bxy - x * y * value - x * bx
    straight[2] = bxy - x * y * value + y * by
    straight[3] = byy - y * y * value - y * bx
    turned[0] = -xx * value - 2 * x * bx - x * y * value
    turned[1] = -xy * value - y * bx - x * by + x * x * value
    turned[2] = -xy * value - x * by - y * bx - y * y * value
    turned[3] = -yy * value - 2 * y * by + x * y * value


@numba.njit(cache=True, nogil=True)
def _stretch(metric, entries):
    """M H M in place of the entries xx, xy, yx, yy of H."""
    a, b, c = metric
    xx, xy, yx, yy = entries
    px, py, qx, qy = a * xx + b * yx, a * xy + b * yy, b * xx + c * yx, b * xy + c * yy
    entries[0], entries[1], entries[2], entries[3] = px * a + py * b, px * b + py * c, qx * a + qy * b, qx * b + qy * c
