"""Strain from displacement at points of the wall, by one operator for all trackers and for the truth.

About every point x_0 the displacement is fitted by a polynomial of second degree in the position x at end-diastole,
u(x) = sum_j c_j p_j with p = (1, X, Y, X^2, XY, Y^2) and (X, Y) = (x - x_0) / r, by weighted least squares over the
points of the wall within the radius r: c = (P^T W P)^-1 P^T W u and grad u = (c_1, c_2) / r. The weights
w = 1 - (|x - x_0| / r)^2 (Epanechnikov) fall to 0 at the radius. With F = I + grad u the strain is
E = (F^T F - I) / 2 along the wall's axes at end-diastole.

The quadratic terms matter at the borders of the wall, where all points lie to one side: a linear fit takes the gradient
of the interior there, and radial strain varies steeply. On the true motion of the default heart at ES
(basal slice, radius 0.45 mm, 35 points) they halve the error of the operator's radial strain, 11.1 to 5.6 percentage
points RMS (bias -3.5 to -1.5), and lower that of the circumferential from 1.6 to 1.0; white noise of 5 um then makes
2.2 and 0.5 instead of 0.9 and 0.4, which is below that error. A radius of 0.40 mm gives 5.2 and 0.9 with noise of 2.3
and 0.6; one of 0.60 mm 7.1 and 1.2 with 1.2 and 0.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from echotruth.mechanics.kinematics import IMAGE_COMPONENTS, strain

RADIUS = 0.0375
"""Radius over the side of the image: 0.45 mm for a mouse heart, imaged in 12 mm."""

MIN_POINTS = 10
"""Smallest number of points of a fit, which has six coefficients."""

MIN_EIGENVALUE_RATIO = 1e-4
"""Smallest over largest eigenvalue of P^T W P, below which the points lie almost on a line."""


@dataclass(frozen=True)
class StrainOperator:
    """Linear operator from displacement to strain at the points of one view.

    Attributes
    ----------
    position : ndarray of shape (point, 2)
        Points at end-diastole: lateral, axial, m.
    axes : ndarray of shape (point, 2, 2)
        Unit vectors of the wall at end-diastole: (radial, tangential) by (lateral, axial).
    radius : float
        Radius of the neighbourhood of a point, m.
    """

    position: np.ndarray
    axes: np.ndarray
    radius: float

    def strain(self, displacement: np.ndarray) -> np.ndarray:
        """Strain since end-diastole.

        Parameters
        ----------
        displacement : ndarray of shape (frame, point, 2)
            Since end-diastole: lateral, axial, m; NaN where unknown.

        Returns
        -------
        ndarray of shape (frame, point, 3)
            Radial, tangential, shear; NaN where the displacement is unknown or cannot be fitted.
        """
        return strain(np.eye(2) + self.gradient(np.asarray(displacement, float)), self.axes, IMAGE_COMPONENTS)

    def gradient(self, displacement: np.ndarray) -> np.ndarray:
        """Displacement gradient du_i/dx_j: (frame, point, i), m, to (frame, point, i, j)."""
        known = np.isfinite(displacement).all(-1)
        filled = np.where(known[..., None], displacement, 0)
        result = np.empty((*displacement.shape, 2))
        patterns, pattern_of_frame = np.unique(known, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            frames = np.flatnonzero(pattern_of_frame.ravel() == number)
            columns = np.moveaxis(filled[frames], 1, 0).reshape(len(pattern), 2 * len(frames))
            gradient = (self._gradient_matrix(pattern) @ columns).reshape(len(pattern), 2, len(frames), 2)
            result[frames] = gradient.transpose(2, 0, 3, 1)
        return result

    @cached_property
    def _neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Indices of the neighbours of every point, their weights w and their polynomial terms p."""
        tree = cKDTree(self.position)
        most = int(tree.query_ball_point(self.position, self.radius, return_length=True).max(initial=1))
        distance, neighbour = tree.query(self.position, most, distance_upper_bound=self.radius)
        distance, neighbour = (array.reshape(len(self.position), most) for array in (distance, neighbour))
        # Where a point has fewer neighbours, the tree pads with an infinite distance and an index out of range.
        neighbour = np.where(np.isfinite(distance), neighbour, 0)
        # Points across a narrow cavity, whose radial direction is opposite, do not count.
        same_side = np.einsum("nkj,nj->nk", self.axes[neighbour, 0], self.axes[:, 0]) > 0
        weight = np.where(np.isfinite(distance) & same_side, 1 - (distance / self.radius) ** 2, 0)
        x, y = np.moveaxis((self.position[neighbour] - self.position[:, None]) / self.radius, -1, 0)
        return neighbour, weight, np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1)

    def _gradient_matrix(self, known: np.ndarray) -> csr_array:
        """Matrix from the values at the known points to their gradients, d/dx before d/dy, (2 point, point), 1/m."""
        neighbour, weight, _ = self._neighbours
        incomplete = ((weight > 0) & ~known[neighbour]).any(1)
        coefficients = self._coefficients_of_all
        if incomplete.any():
            coefficients = coefficients.copy()
            coefficients[incomplete] = self._coefficients(incomplete, known)
        points, most = neighbour.shape
        values = np.swapaxes(coefficients, 1, 2).ravel()
        return csr_array(
            (values, np.repeat(neighbour, 2, axis=0).ravel(), np.arange(2 * points + 1) * most), (2 * points, points)
        )

    @cached_property
    def _coefficients_of_all(self) -> np.ndarray:
        """Coefficients of all points where all points are known."""
        all_points = np.ones(len(self.position), bool)
        return self._coefficients(all_points, all_points)

    def _coefficients(self, chosen: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Rows 1 and 2 of (P^T W P)^-1 P^T W / r at the chosen points, (point, neighbour, 2), 1/m."""
        neighbour, weight, terms = (array[chosen] for array in self._neighbours)
        weight = weight * known[neighbour]
        weighted = np.swapaxes(weight[..., None] * terms, 1, 2)  # P^T W
        normal = weighted @ terms  # P^T W P
        eigenvalue = np.linalg.eigvalsh(normal)
        enough = (weight > 0).sum(1) >= MIN_POINTS
        fit = known[chosen] & enough & (eigenvalue[:, 0] > MIN_EIGENVALUE_RATIO * eigenvalue[:, -1])
        coefficients = np.full((*weight.shape, 2), np.nan)
        coefficients[fit] = np.swapaxes(np.linalg.inv(normal[fit])[:, 1:3] @ weighted[fit], 1, 2) / self.radius
        return coefficients
