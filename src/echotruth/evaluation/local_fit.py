"""Values and gradients of a displacement between the points at which it is known, by local polynomials.

About every target x_0 the displacement is fitted by a polynomial of second degree in the position x at end-diastole,
u(x) = sum_j c_j p_j with p = (1, X, Y, X^2, XY, Y^2) and (X, Y) = (x - x_0) / r, by weighted least squares over the
points of the wall within the radius r: c = (P^T W P)^-1 P^T W u, u(x_0) = c_0 and grad u = (c_1, c_2) / r. The weights
w = 1 - (|x - x_0| / r)^2 (Epanechnikov) fall to 0 at the radius. In a volume there are ten terms, of three coordinates.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement

import numpy as np

from echotruth.evaluation.neighbours import within

MIN_POINTS = {2: 10, 3: 17}
"""Smallest number of points of a fit, which has six coefficients in a plane and ten in space."""

MIN_EIGENVALUE_RATIO = 1e-4
"""Smallest over largest eigenvalue of P^T W P, below which the points lie almost on a line."""


@dataclass(frozen=True)
class LocalFit:
    """Linear operator from the displacement of points to its value and gradient at targets.

    Attributes
    ----------
    position : ndarray of shape (point, d)
        Points at end-diastole: lateral, axial, m, and in a volume elevation.
    normal : ndarray of shape (point, d)
        Radial direction of the wall there.
    target : ndarray of shape (target, d)
        Where values are wanted, m.
    target_normal : ndarray of shape (target, d)
        Radial direction of the wall there.
    radius : float
        Radius of the neighbourhood of a target, m.
    """

    position: np.ndarray
    normal: np.ndarray
    target: np.ndarray
    target_normal: np.ndarray
    radius: float

    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """Fit a displacement.

        Parameters
        ----------
        displacement : ndarray of shape (frame, point, d)
            m; NaN where unknown.

        Returns
        -------
        ndarray of shape (frame, target, 1 + d, d)
            Value, m, and derivatives along each axis, of each component; NaN where too few points are known.
        """
        known = np.isfinite(displacement).all(-1)
        filled = np.where(known[..., None], displacement, 0)
        targets, dims = self.target.shape
        result = np.full((len(displacement), targets, 1 + dims, dims), np.nan)
        if not len(self.position):
            return result
        patterns, pattern_of_frame = np.unique(known, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            frames = np.flatnonzero(pattern_of_frame.ravel() == number)
            columns = np.moveaxis(filled[frames], 1, 0).reshape(len(pattern), dims * len(frames))
            fitted = np.zeros((targets, 1 + dims, dims * len(frames)))
            # Neighbour by neighbour, so that the sums of a frame do not depend on the others.
            for coefficients, neighbour in zip(self._known_coefficients(pattern), self._neighbours[0].T, strict=True):
                fitted += coefficients[..., None] * columns[neighbour, None]
            result[frames] = fitted.reshape(targets, 1 + dims, len(frames), dims).transpose(2, 0, 1, 3)
        return result

    @cached_property
    def _neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Indices of the neighbours of every target, their weights w and their polynomial terms p."""
        neighbour, distance = within(self.position, self.target, self.radius)
        # Points across a narrow cavity, whose radial direction is opposite, do not count.
        same_side = np.einsum("nkj,nj->nk", self.normal[neighbour], self.target_normal) > 0
        weight = np.where(np.isfinite(distance) & same_side, 1 - (distance / self.radius) ** 2, 0)
        offset = np.moveaxis((self.position[neighbour] - self.target[:, None]) / self.radius, -1, 0)
        products = (one * other for one, other in combinations_with_replacement(offset, 2))
        return neighbour, weight, np.stack([np.ones_like(offset[0]), *offset, *products], -1)

    def _known_coefficients(self, known: np.ndarray) -> np.ndarray:
        """Coefficients from values at neighbours to value (1) and derivatives (1/m), (neighbour, target, 1 + d)."""
        neighbour, weight, _ = self._neighbours
        incomplete = ((weight > 0) & ~known[neighbour]).any(1)
        coefficients = self._coefficients_of_all
        if incomplete.any():
            coefficients = coefficients.copy()
            coefficients[incomplete] = self._coefficients(incomplete, known)
        return np.swapaxes(coefficients, 0, 1)

    @cached_property
    def _coefficients_of_all(self) -> np.ndarray:
        """Coefficients of all targets where all points are known."""
        return self._coefficients(np.ones(len(self.target), bool), np.ones(len(self.position), bool))

    def _coefficients(self, chosen: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Rows 0 to d of (P^T W P)^-1 P^T W at the chosen targets, 1 to d over r, (target, neighbour, 1 + d)."""
        neighbour, weight, terms = (array[chosen] for array in self._neighbours)
        weight = weight * known[neighbour]
        weighted = np.swapaxes(weight[..., None] * terms, 1, 2)  # P^T W
        normal = weighted @ terms  # P^T W P
        eigenvalue = np.linalg.eigvalsh(normal)
        dims = self.position.shape[1]
        enough = (weight > 0).sum(1) >= MIN_POINTS[dims]
        fit = enough & (eigenvalue[:, 0] > MIN_EIGENVALUE_RATIO * eigenvalue[:, -1])
        coefficients = np.full((*weight.shape, 1 + dims), np.nan)
        coefficients[fit] = np.swapaxes(np.linalg.inv(normal[fit])[:, : 1 + dims] @ weighted[fit], 1, 2)
        return coefficients / [1, *[self.radius] * dims]
