"""Bending energy of a B-spline field, anisotropic along and through the wall.

The energy is the sum over the pixels of |M H M|^2, where H are the second derivatives of the field and the metric M
scales lengths through the wall: a wall thickens unevenly over a millimetre, but neighbouring parts of its circumference
move alike. Derivatives are taken along and through the wall, of the components along and through it, so that the even
contraction or rotation of a ring has no energy. Where this frame turns by the angle phi and J is the rotation by 90
degrees, D_i u = d_i u - (d_i phi) J u, and the index of a derivative turns likewise; in a straight wall that is the
thin-plate energy.

Some fields have no energy: a field has that of what is left when the best sum of these is taken from it. They are the
null space of a smoothing spline (Wahba 1990, Spline Models for Observational Data, doi 10.1137/1.9781611970128).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy import ndimage
from scipy.linalg import blas

from echotruth.tracking import cubic
from echotruth.tracking.alignment import add_cell_matrices
from echotruth.tracking.bspline import Cells

MIN_ENERGY = 1e-9
"""Energy of a combination of free fields, over the greatest, below which it counts as 0."""
MIN_COHERENCE = 0.3
"""Coherence of the wall's direction around a pixel (0 to 1) below which derivatives of its angle are reduced."""


@dataclass(frozen=True)
class BendingEnergy:
    """Energy u^T (K - K A (A^T K A)^+ A^T K) u of fields u, which is 0 for the columns of A.

    Attributes
    ----------
    band : ndarray of shape (unknowns, width)
        Banded matrix K, see :func:`bending_matrix`.
    free : ndarray of shape (unknowns, free)
        Fields A without energy.
    gradients : ndarray of shape (unknowns, free)
        K A.
    projection : ndarray of shape (unknowns, free)
        K A (A^T K A)^+.
    """

    band: np.ndarray
    free: np.ndarray
    gradients: np.ndarray
    projection: np.ndarray

    @classmethod
    def without(cls, band: np.ndarray, free: np.ndarray) -> BendingEnergy:
        """The energy of a matrix K, with the columns of `free` (unknowns, free) free of it."""
        gradients = np.stack([_product(band, field) for field in free.T], -1)
        return cls._projected(band, free, gradients)

    @classmethod
    def _projected(cls, band: np.ndarray, free: np.ndarray, gradients: np.ndarray) -> BendingEnergy:
        products = free.T @ gradients
        return cls(band, free, gradients, gradients @ np.linalg.pinv(products, MIN_ENERGY, hermitian=True))

    def and_without(self, field: np.ndarray) -> BendingEnergy:
        """The energy with one more field (unknowns,) free of it; none if the field is 0."""
        size = np.sqrt(np.mean(field**2))
        if not size > 0:
            return self
        unit = field / size
        free = np.column_stack([self.free, unit])
        return self._projected(self.band, free, np.column_stack([self.gradients, _product(self.band, unit)]))

    def gradient(self, field: np.ndarray) -> np.ndarray:
        """Half the gradient of the energy of a field, both of shape (unknowns,)."""
        return _product(self.band, field) - self.projection @ (self.gradients.T @ field)


def _product(band: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Product of a symmetric matrix, banded (unknowns, width) or sparse, and a field (unknowns,)."""
    return blas.dsbmv(band.shape[1] - 1, 1.0, band.T, field) if isinstance(band, np.ndarray) else band @ field


def bending_matrix(cells: Cells, metrics: np.ndarray, angle_derivatives: np.ndarray, size: int) -> np.ndarray:
    """Banded matrix of the bending energy, scaled to a mean diagonal of 1.

    Parameters
    ----------
    cells : Cells
        The pixels.
    metrics : ndarray of shape (pixel, 3)
        Entries xx, xy, yy of M.
    angle_derivatives : ndarray of shape (pixel, 5)
        Derivatives x, y, xx, xy, yy of phi, rad per knot spacing (squared).
    size : int
        Number of knots.

    Returns
    -------
    ndarray of shape (unknowns, width)
        See :func:`echotruth.tracking.alignment.add_normal_matrix`.
    """
    lowest = np.where(cells.knots < 0, size, cells.knots).min(1)
    band = np.zeros((2 * size, 2 * int((cells.knots.max(1) - lowest).max()) + 2))
    basis_x, basis_y = map(basis_derivatives, cells.fraction.T)
    _add(cells.knots, cells.offsets, basis_x, basis_y, metrics, angle_derivatives, band)
    return band / band[:, -1].mean()


def wall_frame(
    mask: np.ndarray, pixels: np.ndarray, width: float, transmural_scale: float
) -> tuple[np.ndarray, np.ndarray]:
    """Metric and angle derivatives of the local frame of the wall, from the structure tensor of its distance map.

    Parameters
    ----------
    mask, pixels : ndarray of shape (axial, lateral), bool
        The wall, and the pixels at which the result is wanted.
    width : float
        Standard deviation of the Gaussian window of the structure tensor, and unit of the derivatives, px.
    transmural_scale : float
        Scale of lengths through the wall; 1 along it, and in between where the wall has no clear direction.

    Returns
    -------
    metrics : ndarray of shape (pixel, 3)
        Entries xx, xy, yy of M, in the order of the True entries of `pixels`.
    angle_derivatives : ndarray of shape (pixel, 5)
        Derivatives x, y, xx, xy, yy of phi, rad; reduced where the wall has no clear direction.
    """
    distance = ndimage.distance_transform_edt(~mask) - ndimage.distance_transform_edt(mask)
    gy, gx = np.gradient(ndimage.gaussian_filter(distance, 1.0))
    xx, xy, yy = (ndimage.gaussian_filter(product, width) for product in (gx**2, gx * gy, gy**2))
    trace = np.maximum(xx + yy, 1e-12)
    shortening = 1 - transmural_scale
    metrics = np.stack([1 - shortening * xx / trace, -shortening * xy / trace, 1 - shortening * yy / trace], -1)
    # A normal has no sign, but 2 phi is unique. d phi = (cos d sin - sin d cos) / (2 (cos^2 + sin^2)), all of 2 phi.
    cosine, sine = (xx - yy) / trace, 2 * xy / trace
    gradients = zip(np.gradient(cosine, 1 / width), np.gradient(sine, 1 / width), strict=True)
    denominator = 2 * np.maximum(cosine**2 + sine**2, MIN_COHERENCE**2)
    y, x = ((cosine * d_sine - sine * d_cosine) / denominator for d_cosine, d_sine in gradients)
    (dxy, dxx), (dyy, dyx) = (np.gradient(derivative, 1 / width) for derivative in (x, y))
    angle_derivatives = np.stack([x, y, dxx, (dxy + dyx) / 2, dyy], -1)
    return metrics[pixels], angle_derivatives[pixels]


def basis_derivatives(fraction: np.ndarray) -> np.ndarray:
    """Cubic basis functions, their first and second derivatives at fractions (point,) of a cell; (point, 3, 4)."""
    orders = (cubic.bspline_weights, cubic.first_derivatives, cubic.second_derivatives)
    return np.stack([np.stack(order(fraction), -1) for order in orders], 1)


@numba.njit(cache=True, nogil=True)
def _add(knots, offsets, basis_x, basis_y, metrics, angle_derivatives, band):
    cell_matrices, parallel, rotated = np.zeros((3, 16, 16)), np.empty((16, 4)), np.empty((16, 4))
    for cell in range(len(knots)):
        cell_matrices[:] = 0
        for point in range(offsets[cell], offsets[cell + 1]):
            for k in range(16):
                i, j = k // 4, k % 4
                _second_derivatives(
                    basis_y[point, :, i], basis_x[point, :, j], angle_derivatives[point], parallel[k], rotated[k]
                )
                _apply_metric(metrics[point], parallel[k])
                _apply_metric(metrics[point], rotated[k])
            for k in range(16):
                for m in range(16):
                    for e in range(4):
                        cell_matrices[0, k, m] += parallel[k, e] * parallel[m, e] + rotated[k, e] * rotated[m, e]
                        cell_matrices[1, k, m] += rotated[k, e] * parallel[m, e] - parallel[k, e] * rotated[m, e]
                    # Not all at once, which takes longer to compile than the rest.
                    cell_matrices[2, k, m] = cell_matrices[0, k, m]
        add_cell_matrices(knots[cell], cell_matrices, band)


@numba.njit(cache=True, nogil=True)
def _second_derivatives(basis_y, basis_x, angle_derivatives, parallel, rotated):
    """Write entries xx, xy, yx, yy of D D B e for a basis function B and a unit vector e: factors of e, and of J e."""
    value, bx, by = basis_y[0] * basis_x[0], basis_y[0] * basis_x[1], basis_y[1] * basis_x[0]
    bxx, bxy, byy = basis_y[0] * basis_x[2], basis_y[1] * basis_x[1], basis_y[2] * basis_x[0]
    x, y, xx, xy, yy = angle_derivatives
    parallel[0] = bxx - x * x * value + x * by
    parallel[1] = bxy - x * y * value - x * bx
    parallel[2] = bxy - x * y * value + y * by
    parallel[3] = byy - y * y * value - y * bx
    rotated[0] = -xx * value - 2 * x * bx - x * y * value
    rotated[1] = -xy * value - y * bx - x * by + x * x * value
    rotated[2] = -xy * value - x * by - y * bx - y * y * value
    rotated[3] = -yy * value - 2 * y * by + x * y * value


@numba.njit(cache=True, nogil=True)
def _apply_metric(metric, entries):
    """Replace the entries xx, xy, yx, yy of H by those of M H M."""
    a, b, c = metric
    xx, xy, yx, yy = entries
    px, py, qx, qy = a * xx + b * yx, a * xy + b * yy, b * xx + c * yx, b * xy + c * yy
    entries[0], entries[1], entries[2], entries[3] = px * a + py * b, px * b + py * c, qx * a + qy * b, qx * b + qy * c
