"""Strain from displacement at points of the wall: one operator for every tracker, and for the truth.

About every point the displacement is fitted by a polynomial of second degree in the place at end-diastole, by least
squares over the points of the wall within a fixed radius; its slope at the point is grad u. The weights fall as
1 - (distance / radius)^2 (Epanechnikov), so that no point enters or leaves with a jump. With F = I + grad u the strain
is E = (F^T F - I) / 2 along the wall's axes at end-diastole.

The terms of second degree are there for the borders of the wall, where all points lie to one side: a plane fitted there
takes the slope of the interior, and radial strain is steep. On the true motion of the default heart at ES
(basal slice, radius 0.45 mm, 35 points) they halve the error of the operator's radial strain, 11.1 to 5.6 points RMS
(bias -3.5 to -1.5), and lower that of the circumferential from 1.6 to 1.0; white noise of 5 um then makes 2.2 and 0.5
points in place of 0.9 and 0.4, which is below that error. A radius of 0.40 mm has 5.2 and 0.9 with noise of 2.3 and
0.6; one of 0.60 mm 7.1 and 1.2 with 1.2 and 0.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from echotruth.mechanics.kinematics import IMAGE, strain

RADIUS = 0.0375
"""Radius over the side of the image: 0.45 mm of the 12 mm in which a mouse heart is imaged."""

FEWEST = 10
"""Points that a fit needs: six coefficients, and some to average."""

WORST = 1e-4
"""Smallest over largest eigenvalue of the normal equations: below it the points lie as good as on a line."""


@dataclass(frozen=True)
class Operator:
    """The operator at the points of one view.

    Attributes
    ----------
    position : ndarray of shape (point, 2)
        At end-diastole: lateral, axial, m.
    axes : ndarray of shape (point, 2, 2)
        Unit vectors along the wall at end-diastole: radial, tangential by lateral, axial.
    radius : float
        m.
    """

    position: np.ndarray
    axes: np.ndarray
    radius: float

    def strain(self, displacement: np.ndarray) -> np.ndarray:
        """Strain since end-diastole.

        Parameters
        ----------
        displacement : ndarray of shape (frame, point, 2)
            Since end-diastole: lateral, axial, m; NaN where there is none.

        Returns
        -------
        ndarray of shape (frame, point, 3)
            Radial, tangential, shear; NaN where there is no displacement, or too little about a point.
        """
        return strain(np.eye(2) + self.gradient(np.asarray(displacement, float)), self.axes, IMAGE)

    def gradient(self, displacement: np.ndarray) -> np.ndarray:
        """Slope of displacement by place: (frame, point, 2) in m to (frame, point, 2 of u, 2 of x)."""
        known = np.isfinite(displacement).all(-1)
        filled = np.where(known[..., None], displacement, 0)
        result = np.empty((*displacement.shape, 2))
        patterns, which = np.unique(known, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            frames = np.flatnonzero(which.ravel() == number)
            columns = np.moveaxis(filled[frames], 1, 0).reshape(len(pattern), 2 * len(frames))
            slope = (self._slope(pattern) @ columns).reshape(len(pattern), 2, len(frames), 2)
            result[frames] = slope.transpose(2, 0, 3, 1)
        return result

    @cached_property
    def _neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers of the points about each, their weights, and the terms of the polynomial there."""
        tree = cKDTree(self.position)
        most = int(tree.query_ball_point(self.position, self.radius, return_length=True).max(initial=1))
        distance, near = tree.query(self.position, most, distance_upper_bound=self.radius)
        distance, near = (each.reshape(len(self.position), most) for each in (distance, near))
        # Where there are fewer, the tree fills up with a number past the last.
        near = np.where(np.isfinite(distance), near, 0)
        # The other side of a narrow cavity is no neighbour: its radial direction is the opposite one.
        facing = np.einsum("nkj,nj->nk", self.axes[near, 0], self.axes[:, 0]) > 0
        weight = np.where(np.isfinite(distance) & facing, 1 - (distance / self.radius) ** 2, 0)
        x, y = np.moveaxis((self.position[near] - self.position[:, None]) / self.radius, -1, 0)
        return near, weight, np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1)

    def _slope(self, known: np.ndarray) -> csr_array:
        """The slopes at the points, x before y, by the values at the points that are known, (2 point, point), 1/m."""
        near, weight, _ = self._neighbours
        lost = ((weight > 0) & ~known[near]).any(1)
        shares = self._whole
        if lost.any():
            shares = shares.copy()
            shares[lost] = self._shares(lost, known)
        most, points = near.shape[1], len(near)
        values = np.swapaxes(shares, 1, 2).ravel()
        return csr_array(
            (values, np.repeat(near, 2, axis=0).ravel(), np.arange(2 * points + 1) * most), (2 * points, points)
        )

    @cached_property
    def _whole(self) -> np.ndarray:
        """Shares where all points are known."""
        every = np.ones(len(self.position), bool)
        return self._shares(every, every)

    def _shares(self, where: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Shares of the neighbours in the slope at some of the points, (point, neighbour, 2), 1/m."""
        near, weight, terms = (each[where] for each in self._neighbours)
        weight = weight * known[near]
        weighted = np.swapaxes(weight[..., None] * terms, 1, 2)
        normal = weighted @ terms
        values = np.linalg.eigvalsh(normal)
        fit = known[where] & ((weight > 0).sum(1) >= FEWEST) & (values[:, 0] > WORST * values[:, -1])
        shares = np.full((*weight.shape, 2), np.nan)
        shares[fit] = np.swapaxes(np.linalg.inv(normal[fit])[:, 1:3] @ weighted[fit], 1, 2) / self.radius
        return shares
