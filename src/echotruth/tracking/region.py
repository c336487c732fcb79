"""Pixels of the wall at end-diastole with their B-spline, and the alignment of an image with a template on them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg, ndimage
from scipy.linalg import lapack

from echotruth.tracking import alignment
from echotruth.tracking.bending_energy import BendingEnergy, bending_matrix, wall_frame
from echotruth.tracking.bspline import lattice_around
from echotruth.tracking.evidence import PROBES, Match, effective_parameters, energy_weight
from echotruth.tracking.flow import interpolate_field

MAX_ITERATIONS = 24
MATRIX_REUSE = 8
"""Iterations for which one normal matrix is used."""
CONVERGENCE = 5e-4
"""RMS of the last step over the knot spacing."""
FLOW_ITERATIONS = 3
"""Iterations of the fit to a dense flow."""
FLOW_SMOOTHNESS = 0.1
"""Weight of the bending energy in the fit to a dense flow, which is smooth already."""
MAX_KNOT_SPACING_ALL_PIXELS = 16
"""Knot spacing above which every other pixel is used, px."""
MIN_SMOOTHNESS = 3.0
"""Least weight of the bending energy, which fills areas without speckle even where there is no noise."""
FIRST_SMOOTHNESS = 300.0
"""Smoothness of the first iterations where it is chosen by the evidence, which needs a step to go by."""
LEAST_SMOOTHNESS = 0.01
"""Least weight of the bending energy by evidence, over the mean diagonal of the image's matrix."""
EVIDENCE_ITERATIONS = (2, 4, 6)
"""Iterations at which the evidence sets the weight anew; convergence is looked for from the last one on."""
PIXELS_PER_CELL = 40
"""Pixels of a cell that are enough for the normal matrix, which affects the rate of convergence, not the solution."""
SINGULAR = 1e-9
"""Share of the greatest singular value below which one counts as 0."""
REGULARISATION = 1e-5
"""Added to the diagonal of the normal matrix, over its mean, so that it is not singular."""


@dataclass(frozen=True)
class NormalMatrix:
    """Normal matrix S = F - beta K A (A^T K A)^+ A^T K of image and bending energy, where F = N + beta K is banded.

    Attributes
    ----------
    factor : ndarray of shape (width, unknowns)
        Cholesky factor of F, see :func:`scipy.linalg.cholesky_banded`.
    energy_weight : float
        Weight beta of the bending energy.
    energy : BendingEnergy
    """

    factor: np.ndarray
    energy_weight: float
    energy: BendingEnergy

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """F^-1 rhs; both of shape (unknowns,) or (unknowns, n)."""
        # SciPy's own function checks and converts for longer than a small system takes.
        return lapack.dpbtrs(self.factor, rhs)[0]

    def newton_step(self, rhs: np.ndarray) -> np.ndarray:
        """S^-1 rhs, both of shape (unknowns,), by the Woodbury formula."""
        step, (response, inverse) = self.solve(rhs), self._free
        return step + response @ (inverse @ (self.energy.gradients.T @ step))

    @cached_property
    def _free(self) -> tuple[np.ndarray, np.ndarray]:
        """R = beta F^-1 K A (A^T K A)^+, shape (unknowns, free), and (1 - (K A)^T R)^+, shape (free, free)."""
        response = self.energy_weight * self.solve(self.energy.projection)
        product = self.energy.gradients.T @ response
        return response, np.linalg.pinv(np.eye(len(product)) - product, SINGULAR)


@dataclass(frozen=True)
class WallRegion:
    """Pixels of the wall and its surroundings, and the B-spline on them.

    Attributes
    ----------
    lattice : bspline.KnotLattice
    cells : bspline.Cells
        The pixels.
    positions : ndarray of shape (pixel, 2)
        Lateral, axial, px.
    inside : ndarray of shape (pixel,), bool
        Pixels of the wall itself.
    energy : BendingEnergy
        Of a field without the shift, stretch, shear and rotation of the whole wall.
    """

    lattice: Any
    cells: Any
    positions: np.ndarray
    inside: np.ndarray
    energy: BendingEnergy

    def align(
        self,
        image: np.ndarray,
        template: np.ndarray,
        start: np.ndarray,
        previous: np.ndarray,
        smoothness: float | None,
        tolerance: float,
        iterations: int = MAX_ITERATIONS,
        seen: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacement U that minimises sum w (I(X + U) - T)^2 plus the weighted bending energy of U - U_previous.

        A step in proportion to U_previous has no energy: tissue that has moved more than its surroundings so far, as
        around a scar, is expected to go on so.

        Parameters
        ----------
        image : ndarray
            Spline coefficients of I, see :func:`echotruth.imaging.spline.coefficients`.
        template : ndarray of shape (pixel,) or (pixel, 1 + axis)
            Grey values T, and their derivatives: if they are given, forces are by the mean of these and those of the
            image (Benhimane and Malis 2004, IEEE/RSJ IROS, 943). Those of the image alone pull speckle that has changed
            to where it is dark.
        start, previous : ndarray of shape (knot, 2)
            Coefficients of the initial estimate and of U_previous, px.
        smoothness : float, optional
            Weight of the bending energy relative to the image, if noise were as strong as speckle and the speckle
            length equal to the knot spacing; None for the weight that the evidence is greatest for, see
            :mod:`echotruth.tracking.evidence`.
        tolerance : float
            Residual, in standard deviations, at which the weight w of a pixel is 1/4.
        iterations : int
            Number of iterations at most.
        seen : ndarray of shape (pixel,), optional
            How far the pixels show tissue, from 0 to 1. Default: all do.

        Returns
        -------
        coefficients : ndarray of shape (knot, 2)
            px.
        warped : ndarray of shape (pixel, 3)
            I(X + U), and its lateral and axial derivative per px.
        """
        template, slopes = (template[:, 0], template[:, 1:]) if template.ndim == 2 else (template, None)
        coefficients, position = start, self.displaced(start)
        normal: Any = None
        shown = np.ones(len(template)) if seen is None else seen
        energy = self.energy.and_without(previous.ravel())
        for iteration in range(iterations):
            warped = self.interpolate(image, position)
            if slopes is not None:
                warped[:, 1:] = (warped[:, 1:] + slopes) / 2
            residual, weight, force = alignment.robust_match(warped, template, tolerance, shown)
            match = Match(template, residual, warped[:, 1:], weight)
            if (
                normal is None
                or iteration % MATRIX_REUSE == 0
                or (smoothness is None and iteration in EVIDENCE_ITERATIONS)
            ):
                normal = self._normal_matrix(match, smoothness, energy, coefficients - previous, normal)
            change = self._newton_step(normal, force, coefficients - previous)
            step = self.cells.evaluate(change)
            coefficients, position = coefficients + change, position + step
            settled = smoothness is not None or iteration >= EVIDENCE_ITERATIONS[-1]
            if settled and np.linalg.norm(step) < CONVERGENCE * self.lattice.knot_spacing * np.sqrt(step.size):
                break
        return coefficients, self.interpolate(image, position)

    def interpolate(self, image: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Grey value and derivatives (point, 3) at positions (point, 2), px, of an image of spline coefficients."""
        return alignment.interpolate_with_gradient(image, position)

    def sample(self, image: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Grey values (point,) of an image at positions (point, 2), px, linear between pixels; outside, its border."""
        inside = np.clip(position, 0, np.array(image.shape[::-1]) - 1)
        return interpolate_field(image[..., None], inside)[:, 0]

    def displaced(self, coefficients: np.ndarray) -> np.ndarray:
        """Positions (pixel, 2) of the pixels after the displacement with coefficients (knot, 2), px."""
        return self.positions + self.cells.evaluate(coefficients)

    def fit(self, flow: np.ndarray) -> np.ndarray:
        """Coefficients (knot, 2) of the field that best fits a dense flow (pixel, 2), px, with outliers down-weighted.

        The weights, scaled to a mean of 1, enter the right-hand side only, so that all flows share one matrix: modified
        residuals (Huber 1981, Robust Statistics, section 7.8).
        """
        coefficients = np.zeros((self.lattice.size, 2))
        for _ in range(FLOW_ITERATIONS):
            residual = self.cells.evaluate(coefficients) - flow
            weight = alignment.geman_mcclure(np.hypot(*residual.T), 2.0, np.ones(len(flow)))
            force = (weight / weight.mean())[:, None] * residual * self._flow_component
            coefficients = coefficients + self._newton_step(self._flow_matrix, force, coefficients)
        return coefficients

    @property
    def pixel_density(self) -> float:
        """Share of the pixels of the wall that are used."""
        return 1.0 if self.lattice.knot_spacing <= MAX_KNOT_SPACING_ALL_PIXELS else 0.5

    @cached_property
    def _probes(self) -> tuple[np.ndarray, np.ndarray]:
        """Vectors z of random signs, always the same, and K z, both (probe, unknowns)."""
        signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(PROBES, 2 * self.lattice.size))
        return signs, np.array([self.energy.gradient(sign) for sign in signs])

    @cached_property
    def _flow_component(self) -> np.ndarray:
        """Every other pixel (pixel, 2) gives the lateral and the axial flow, so that both share one matrix."""
        return np.eye(2)[np.arange(len(self.positions)) % 2]

    @cached_property
    def _flow_matrix(self) -> NormalMatrix:
        band, scale = self._image_matrix(self._flow_component, np.ones(len(self.positions)), 1)
        return _factor(band, scale, scale * FLOW_SMOOTHNESS, self.energy)

    def _newton_step(self, normal: Any, force: np.ndarray, field: np.ndarray) -> np.ndarray:
        """Change of coefficients (knot, 2) from the image force (pixel, 2) and the energy of a field (knot, 2)."""
        force = self.cells.adjoint(force, self.lattice.size).ravel()
        change = -force - normal.energy_weight * normal.energy.gradient(field.ravel())
        return normal.newton_step(change).reshape(field.shape)

    def _normal_matrix(
        self,
        match: Match,
        smoothness: float | None,
        energy: BendingEnergy,
        step: np.ndarray,
        before: NormalMatrix | None,
    ) -> Any:
        """Normal matrix of a match; its energy has the given smoothness, or the weight of :meth:`_evidence_weight`."""
        stride = max(1, len(self.positions) // (PIXELS_PER_CELL * len(self.cells.knots)))
        band, scale = self._image_matrix(match.gradient, match.weight, stride)
        if smoothness is None and before is not None:
            weight = self._evidence_weight(match, step.ravel(), before)
            if not np.isfinite(weight):
                weight = before.energy_weight
            return _factor(band, scale, max(weight, LEAST_SMOOTHNESS * scale), energy)
        relative = (smoothness or FIRST_SMOOTHNESS) * match.relative_noise(self.lattice.knot_spacing)
        return _factor(band, scale, scale * max(MIN_SMOOTHNESS, relative), energy)

    def _evidence_weight(self, match: Match, step: np.ndarray, before: NormalMatrix) -> float:
        """Weight of the energy by the evidence of a step (unknowns,), from the normal matrix that it was found with."""
        effective = effective_parameters(before.energy_weight, before.solve, *self._probes)
        vectors = step.reshape(-1, 2)
        square = float(((vectors - vectors.mean(0)) ** 2).sum(1).mean())
        energy = float(step @ before.energy.gradient(step))
        return energy_weight(match.variance(self.pixel_density), effective, energy, square)

    def _image_matrix(self, gradient: np.ndarray, weight: np.ndarray, stride: int) -> tuple[np.ndarray, float]:
        """Banded matrix N of every `stride`-th gradient (pixel, 2) and weight (pixel,), and its mean diagonal."""
        band = np.zeros(self.energy.band.shape)
        alignment.add_normal_matrix(self.cells.lines, np.ascontiguousarray(gradient), weight, stride, band)
        return band, band[:, -1].mean() or 1.0


def _factor(band: np.ndarray, scale: float, energy_weight: float, energy: BendingEnergy) -> NormalMatrix:
    """N + beta K, regularised, from N; in place."""
    band += energy_weight * energy.band
    band[:, -1] += scale * REGULARISATION
    return NormalMatrix(linalg.cholesky_banded(band.T, overwrite_ab=True), energy_weight, energy)


def wall_region(mask: np.ndarray, knot_spacing: float, margin: float, transmural_scale: float) -> WallRegion:
    """The wall and its surroundings with their B-spline.

    Parameters
    ----------
    mask : ndarray of shape (axial, lateral), bool
        The wall; not empty.
    knot_spacing : float
        px.
    margin : float
        Pixels up to this distance from the wall are used, px.
    transmural_scale : float
        Scale of lengths through the wall in the bending energy.

    Returns
    -------
    WallRegion
    """
    used = ndimage.distance_transform_edt(~mask) <= margin
    thinned = used & (np.indices(mask.shape).sum(0) % 2 == 0)
    if knot_spacing > MAX_KNOT_SPACING_ALL_PIXELS and (thinned & mask).any():
        used = thinned
    positions = np.argwhere(used)[:, ::-1].astype(float)
    lattice = lattice_around(positions, knot_spacing)
    cells, order = lattice.sort_points(positions)
    metrics, angle_derivatives = wall_frame(mask, used, knot_spacing, transmural_scale)
    matrix = bending_matrix(cells, metrics[order], angle_derivatives[order], lattice.size)
    energy = BendingEnergy.without(matrix, lattice.affine_fields())
    return WallRegion(lattice, cells, positions[order], mask[used][order], energy)
