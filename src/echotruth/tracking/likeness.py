"""How like two looks at the same tissue are, everywhere and about single points."""

from __future__ import annotations

import numpy as np

from echotruth.tracking.bspline import lattice
from echotruth.tracking.grey import FAINTEST


class Likeness:
    """Zero-normalised correlation of grey values of the same pixels of the wall.

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
    """

    def __init__(self, places: np.ndarray, inside: np.ndarray, points: np.ndarray, reach: float):
        self._inside, self._points = inside, points
        self._net = lattice(places, reach / 4)
        self._cells, self._order = self._net.cells(places[inside])

    def about_points(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Correlation about the points.

        Parameters
        ----------
        first, second : ndarray of shape (pixel,)
            Grey values from 0 to 1.

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
        product = np.where(np.minimum(*variances) > FAINTEST**2, variances[0] * variances[1], np.nan)
        return np.clip((ab - a * b) / np.sqrt(product), -1, 1)

    def overall(self, first: np.ndarray, second: np.ndarray) -> float:
        """Correlation over all pixels that count; NaN where either has no texture."""
        a, b = (each[self._inside] - each[self._inside].mean() for each in (first, second))
        return float(np.mean(a * b) / (a.std() * b.std())) if min(a.std(), b.std()) > FAINTEST else np.nan
