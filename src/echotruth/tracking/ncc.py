"""Normalised cross-correlation of two images of the same wall pixels, around single points and over the whole wall."""

from typing import Any

import numpy as np

from echotruth.tracking.bspline import lattice_around
from echotruth.tracking.grey import MIN_STD, decompression_slope
from echotruth.tracking.trilinear import trilinear_lattice


class NormalizedCrossCorrelation:
    """Zero-normalised cross-correlation (NCC) of amplitudes at the pixels of the wall.

    Parameters
    ----------
    positions : ndarray of shape (pixel, 2) or (pixel, 3)
        Lateral, axial, px; of volumes lateral, elevation, depth.
    inside : ndarray of shape (pixel,), bool
        Pixels that are used.
    points : ndarray of shape (n, 2)
        Points of :meth:`at_points`: lateral, axial, px.
    radius : float
        Half-width of the weights around a point, px: two cubic B-splines in succession, knots a quarter of it apart; of
        volumes two hat functions, knots a half of it apart.
    decibels : float
        Dynamic range that :func:`echotruth.tracking.grey.decompress` removed; it sets the amplitude of a grey level.
    """

    def __init__(self, positions: np.ndarray, inside: np.ndarray, points: np.ndarray, radius: float, decibels: float):
        self._inside, self._points, self._decibels = inside, points, decibels
        is_flat = positions.shape[1] == 2
        self._lattice: Any = (
            lattice_around(positions, radius / 4) if is_flat else trilinear_lattice(positions, radius / 2)
        )
        self._cells: Any
        self._cells, self._order = self._lattice.sort_points(positions[inside])

    def at_points(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Correlation around each point.

        Parameters
        ----------
        first, second : ndarray of shape (pixel,)
            Amplitudes.

        Returns
        -------
        ndarray of shape (n,)
            From -1 to 1; NaN where either has no texture, or there is no pixel.
        """
        values = np.stack([np.ones_like(first), first, second, first**2, second**2, first * second], -1)
        moments = self._cells.adjoint(values[self._inside][self._order], self._lattice.size)
        total, *sums = self._lattice.evaluate(moments, self._points).T
        a, b, aa, bb, ab = (np.divide(s, total, out=np.full_like(total, np.nan), where=total > 0) for s in sums)
        variances = aa - a * a, bb - b * b
        textured = self._has_texture(a, variances[0]) & self._has_texture(b, variances[1])
        product = np.where(textured, np.prod(variances, 0), np.nan)
        return np.clip((ab - a * b) / np.sqrt(product), -1, 1)

    def overall(self, first: np.ndarray, second: np.ndarray) -> float:
        """Correlation over all pixels that are used; NaN where either has no texture."""
        a, b = first[self._inside], second[self._inside]
        if not all(self._has_texture(values.mean(), values.var()) for values in (a, b)):
            return np.nan
        return float(np.mean((a - a.mean()) * (b - b.mean())) / (a.std() * b.std()))

    def _has_texture(self, mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
        """Whether the standard deviation exceeds one grey level at that mean amplitude."""
        return variance > (MIN_STD * decompression_slope(mean, self._decibels)) ** 2
