"""Voxels of the wall at end-diastole with their trilinear field, and the alignment of a volume on them.

Positions and displacements are in units of the finest of the three voxel spacings, so that they are the same along all
axes: lateral, elevation, depth.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numba
import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.linalg import LinearOperator, cg

from echotruth.imaging import spline
from echotruth.tracking.bending_energy import BendingEnergy
from echotruth.tracking.evidence import Match
from echotruth.tracking.region import REGULARISATION, WallRegion
from echotruth.tracking.trilinear import TrilinearLattice, trilinear_lattice

SMOOTHNESS = 2000.0
"""Weight of the bending energy where none is set, in proportion to the noise."""
MIN_SMOOTHNESS = 100.0
"""Least weight of the bending energy: images of little noise are smoothed too, since errors of the steps add up."""
CG_TOLERANCE, CG_ITERATIONS = 1e-2, 60
"""Residual of a Newton step over its right-hand side, for which the next step makes up, and iterations at most."""
ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Axes of the entries of a symmetric matrix."""


@dataclass(frozen=True)
class SparseNormalMatrix:
    """Normal matrix N + beta K of image and bending energy."""

    image: sparse.csr_array
    energy_weight: float
    energy: BendingEnergy

    def newton_step(self, rhs: np.ndarray) -> np.ndarray:
        """Solution (unknowns,) by conjugate gradients, with the diagonal as preconditioner."""
        inverse = 1 / (self.image.diagonal() + self.energy_weight * self.energy.band.diagonal())
        matrix = LinearOperator(self.image.shape, self._product, dtype=float)
        jacobi = LinearOperator(self.image.shape, lambda field: inverse * field, dtype=float)
        return cg(matrix, rhs, rtol=CG_TOLERANCE, maxiter=CG_ITERATIONS, M=jacobi)[0]

    def _product(self, field: np.ndarray) -> np.ndarray:
        return self.image @ field + self.energy_weight * self.energy.gradient(field)


@dataclass(frozen=True)
class VolumeRegion(WallRegion):
    """Voxels of the wall and its surroundings, and the trilinear field on them.

    Attributes
    ----------
    ratio : ndarray of shape (3,)
        Voxel spacing over the finest.
    """

    ratio: np.ndarray

    def interpolate(self, image: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Grey value and derivatives (voxel, 4) at positions (voxel, 3) of a volume of :func:`coefficients`."""
        result = interpolate_with_gradient(image, position / self.ratio)
        result[:, 1:] /= self.ratio
        return result

    def sample(self, image: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Grey values (voxel,) of a volume at positions (voxel, 3), linear between voxels; outside, its border."""
        return ndimage.map_coordinates(image, (position / self.ratio)[:, ::-1].T, order=1, mode="nearest")

    def _normal_matrix(
        self, match: Match, smoothness: float | None, energy: BendingEnergy, step: np.ndarray, before: Any
    ) -> SparseNormalMatrix:
        matrix = self.cells.normal_matrix(match.gradient, match.weight, self.lattice.size)
        scale = matrix.diagonal().mean() or 1.0
        relative = (smoothness or SMOOTHNESS) * match.relative_noise(self.lattice.knot_spacing)
        matrix += REGULARISATION * scale * sparse.eye_array(matrix.shape[0])
        return SparseNormalMatrix(matrix.tocsr(), scale * max(MIN_SMOOTHNESS, relative), energy)


def volume_region(
    mask: np.ndarray, ratio: np.ndarray, knot_spacing: float, margin: float, transmural_scale: float
) -> VolumeRegion:
    """The wall of a volume and its surroundings, of which every other voxel is used.

    Parameters
    ----------
    mask : ndarray of shape (depth, elevation, lateral), bool
        The wall; not empty.
    ratio : ndarray of shape (3,)
        Voxel spacing along lateral, elevation, depth over the finest.
    knot_spacing, margin, transmural_scale : float
        See :func:`.region.wall_region`; the lengths are in the finest spacing.
    """
    outside = ndimage.distance_transform_edt(~mask, sampling=ratio[::-1])
    thinned = np.indices(mask.shape, sparse=True)
    used = (outside <= margin) & (sum(thinned) % 2 == 0)
    if not (used & mask).any():
        used = outside <= margin
    distance = (outside - ndimage.distance_transform_edt(mask, sampling=ratio[::-1])).astype(np.float32)
    positions = np.argwhere(used)[:, ::-1] * ratio
    lattice = trilinear_lattice(positions, knot_spacing)
    cells, order = lattice.sort_points(positions)
    matrix = bending_matrix(lattice, np.eye(3) - (1 - transmural_scale) * normal_tensor(distance, ratio, lattice))
    # Affine fields have no energy as it is.
    energy = BendingEnergy(matrix, *[np.empty((matrix.shape[0], 0))] * 3)
    return VolumeRegion(lattice, cells, positions[order], mask[used][order], energy, ratio)


def normal_tensor(distance: np.ndarray, ratio: np.ndarray, lattice: TrilinearLattice) -> np.ndarray:
    """Structure tensor (knot, 3, 3), of trace 1, of the distance (depth, elevation, lateral) from the wall."""
    sampling = ratio[::-1]
    gradient = np.gradient(ndimage.gaussian_filter(distance, 1 / sampling), *sampling)[::-1]
    place = ((lattice.origin + lattice.knot_spacing * lattice.steps) / ratio)[:, ::-1].T
    tensor = np.empty((lattice.size, 3, 3))
    for a, b in ENTRIES:
        entry = ndimage.gaussian_filter(gradient[a] * gradient[b], lattice.knot_spacing / sampling, truncate=3)
        tensor[:, a, b] = tensor[:, b, a] = ndimage.map_coordinates(entry, place, order=1, mode="nearest")
    return tensor / np.maximum(np.trace(tensor, axis1=1, axis2=2), 1e-12)[:, None, None]


def bending_matrix(lattice: TrilinearLattice, metric: np.ndarray) -> sparse.csr_array:
    """Sparse matrix of the bending energy sum |M H M|^2 over the knots, scaled to a mean diagonal of 1.

    H are second differences of each component of the field over the knots that there are, and the metric M (knot, 3, 3)
    scales lengths through the wall.
    """
    # |M H M|^2 = h^T W h with the entries h of H, of which those beside the diagonal are in H twice.
    square, weight = metric @ metric, np.empty((lattice.size, 6, 6))
    for (i, (a, b)), (j, (c, d)) in product(enumerate(ENTRIES), repeat=2):
        pairs = square[:, a, c] * square[:, b, d] + square[:, a, d] * square[:, b, c]
        weight[:, i, j] = (1 + (a != b)) * (1 + (c != d)) * pairs / 2
    differences = second_differences(lattice)
    blocks = sparse.bsr_array((weight, np.arange(lattice.size), np.arange(lattice.size + 1)))
    matrix = sparse.kron(differences.T @ blocks @ differences, np.eye(3), format="csr")
    return matrix / matrix.diagonal().mean()


def second_differences(lattice: TrilinearLattice) -> sparse.csr_array:
    """Matrix (6 knot, knot) of the second differences of :data:`ENTRIES` at each knot.

    Along one axis they are 0 at the last knot; along two they are the mean of those to the neighbours that there are.
    """
    index, steps = np.pad(lattice.index, 1, constant_values=-1), lattice.steps + 1
    unit, here, terms = np.eye(3, dtype=int), np.arange(lattice.size), []
    for entry, (a, b) in enumerate(ENTRIES):
        signs = [(-1, 1)] if a == b else list(product((-1, 1), repeat=2))
        moves = [(s * unit[a], t * unit[b], s * unit[a] + t * unit[b]) for s, t in signs]
        around = np.array([[index[tuple((steps + move).T)] for move in each] for each in moves])
        known = np.asarray((around >= 0).all(1))
        for (p, q, r), valid, (s, t) in zip(around, known, signs, strict=True):
            weight = s * t / np.maximum(known.sum(0), 1)
            for knot, sign in ((here, 1), (p, -1), (q, -1), (r, 1)):
                terms.append((6 * here[valid] + entry, knot[valid], sign * weight[valid]))
    row, column, value = map(np.concatenate, zip(*terms, strict=True))
    return sparse.csr_array((value, (row, column)), (6 * lattice.size, lattice.size))


def coefficients(volume: np.ndarray) -> np.ndarray:
    """Coefficients of the cubic spline through a volume, float32, with a mirrored margin: one before and two after."""
    values = np.asarray(volume, np.float32)
    for axis in range(3):
        lines = np.moveaxis(values, axis, 0)
        flat = 6 * lines.reshape(len(lines), -1)
        spline.prefilter(flat)
        values = np.moveaxis(flat.reshape(lines.shape), 0, axis)
    return np.pad(values, (1, 2), mode="reflect")


@numba.njit(cache=True, nogil=True)
def interpolate_with_gradient(padded, position):
    """Value and derivative along lateral, elevation, depth, (points, 4), of the cubic spline through a volume.

    The `padded` coefficients are of :func:`coefficients`, the `position` (points, 3) is in voxels: lateral, elevation,
    depth. Outside the volume its border is taken.
    """
    result = np.empty((len(position), 4))
    depth, rows, columns = padded.shape
    for point in range(len(position)):
        x = np.float32(min(max(position[point, 0], 0.0), columns - 4.0))
        y = np.float32(min(max(position[point, 1], 0.0), rows - 4.0))
        z = np.float32(min(max(position[point, 2], 0.0), depth - 4.0))
        i, j, k = min(np.int32(x), columns - 5), min(np.int32(y), rows - 5), min(np.int32(z), depth - 5)
        x, y, z = x - np.float32(i), y - np.float32(j), z - np.float32(k)
        wx, wy, wz = spline.bspline_weights(x), spline.bspline_weights(y), spline.bspline_weights(z)
        sx, sy, sz = spline.bspline_slopes(x), spline.bspline_slopes(y), spline.bspline_slopes(z)
        value = gx = gy = gz = np.float32(0)
        for c in range(4):
            plane = plane_x = plane_y = np.float32(0)
            for b in range(4):
                line = padded[k + c, j + b, i : i + 4]
                p = wx[0] * line[0] + wx[1] * line[1] + wx[2] * line[2] + wx[3] * line[3]
                q = sx[0] * line[0] + sx[1] * line[1] + sx[2] * line[2] + sx[3] * line[3]
                plane += wy[b] * p
                plane_x += wy[b] * q
                plane_y += sy[b] * p
            value += wz[c] * plane
            gx += wz[c] * plane_x
            gy += wz[c] * plane_y
            gz += sz[c] * plane
        result[point, 0], result[point, 1], result[point, 2], result[point, 3] = value, gx, gy, gz
    return result
