"""How like two looks at the same tissue are, everywhere and about single points."""

from __future__ import annotations

import numpy as np

from echotruth.tracking.bspline import lattice
from echotruth.tracking.grey import FAINTEST, steepness


class Likeness:
    """Zero-normalised correlation of amplitudes at the same pixels of the wall.

    Parameters
    ----------
    places : ndarray of shape (pixel, 2)
        Lateral, axial, px.
    inside : ndarray of shape (pixel,), bool
        Pixels that count.
    points : ndarray of shape (n, 2)
        Where the correlation is wanted: lateral, axial, px.
    reach : float
        Half of the width of the weights about a point, px: two cubic B-splines in a row, knots a fourth of it apart.
    decibels : float
        As :func:`echotruth.tracking.grey.amplitudes` took it: a grey level is the more, the brighter it is around.
    """

    def __init__(self, places: np.ndarray, inside: np.ndarray, points: np.ndarray, reach: float, decibels: float):
        self._inside, self._points, self._decibels = inside, points, decibels
        self._net = lattice(places, reach / 4)
        self._cells, self._order = self._net.cells(places[inside])

    def about_points(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Correlation about the points.

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
        moments = self._cells.gather(values[self._inside][self._order], self._net.size)
        total, *sums = self._net.at(moments, self._points).T
        a, b, aa, bb, ab = (np.divide(each, total, out=np.full_like(total, np.nan), where=total > 0) for each in sums)
        variances = aa - a * a, bb - b * b
        product = np.where(
            self._textured(a, variances[0]) & self._textured(b, variances[1]), np.prod(variances, 0), np.nan
        )
        return np.clip((ab - a * b) / np.sqrt(product), -1, 1)

    def overall(self, first: np.ndarray, second: np.ndarray) -> float:
        """Correlation over all pixels that count; NaN where either has no texture."""
        a, b = first[self._inside], second[self._inside]
        if not (self._textured(a.mean(), a.var()) and self._textured(b.mean(), b.var())):
            return np.nan
        return float(np.mean((a - a.mean()) * (b - b.mean())) / (a.std() * b.std()))

    def _textured(self, mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
        """Whether amplitudes with such a mean and variance differ by more than a grey level."""
        return variance > (FAINTEST * steepness(mean, self._decibels)) ** 2
