"""The wall at end-diastole as pixels and knots, and its alignment with one image after another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from echotruth.tracking.alignment import add_matrix, factorise, grey_at, product, solve
from echotruth.tracking.bending_energy import frame, roughness
from echotruth.tracking.bspline import Cells, Lattice, lattice

STEPS = 24
"""Most iterations."""
HELD = 8
"""Iterations for which the normal matrix stays."""
STILL = 5e-4
"""Root mean square of the last step over the distance of the knots."""
FITS = 3
"""Iterations for a dense flow."""
LOOSE = 0.1
"""Weight of the roughness of a dense flow, which is smooth already."""
FINE = 16
"""Pixels between knots above which every other one will do."""
LEAST = 3.0
"""Least weight of the roughness, which fills what shows no speckle even where there is no noise."""
ENOUGH = 40
"""Pixels of a cell that do for its part of a normal matrix, which only sets how fast a field is found, not which."""
SAMPLE = 4
"""Of so many residuals one does for their median."""
DEVIATION = 1.4826
"""Standard deviation of a Gaussian over the median of its absolute value."""
ANCHOR = 1e-5
"""Stiffness of a knot on its own over the mean one, so that none is without an equation."""


@dataclass(frozen=True)
class Region:
    """Pixels of the wall and around it, and the B-spline on them.

    Attributes
    ----------
    lattice : Lattice
    cells : Cells
        Of the pixels.
    places : ndarray of shape (pixel, 2)
        Lateral, axial, px.
    inside : ndarray of shape (pixel,), bool
        Pixels of the wall itself.
    roughness : ndarray of shape (unknowns, width)
        Band of its matrix, see :mod:`echotruth.tracking.bending_energy`.
    bent : ndarray of shape (unknowns, 6)
        Its product with the motions of the whole that count as not rough, see :meth:`Lattice.affine`.
    freed : ndarray of shape (unknowns, 6)
        By which the product of `bent` with a field is multiplied to take these motions out of the field's own.
    """

    lattice: Lattice
    cells: Cells
    places: np.ndarray
    inside: np.ndarray
    roughness: np.ndarray
    bent: np.ndarray
    freed: np.ndarray

    def align(
        self, image: np.ndarray, template: np.ndarray, start: np.ndarray, anchor: np.ndarray, stiffness: tuple
    ) -> tuple[np.ndarray, np.ndarray]:
        """Field U that makes sum w (I(X + U) - T)^2 and the roughness of its change smallest.

        Parameters
        ----------
        image : ndarray
            Spline coefficients, see :func:`echotruth.imaging.spline.coefficients`.
        template : ndarray of shape (pixel,)
            Grey values T.
        start, anchor : ndarray of shape (knot, 2)
            Coefficients to begin with, and those from which the change is counted, px.
        stiffness : (float, float)
            Weight of the roughness over that of the image were noise as strong as the speckle and speckle as long as
            the knots are apart, and residual over its standard deviation at which a pixel has a quarter of its weight.

        Returns
        -------
        coefficients : ndarray of shape (knot, 2)
            px.
        grey : ndarray of shape (pixel, 3)
            Image carried back, and its slopes per px.
        """
        smoothness, tolerance = stiffness
        found, place = start, self.places + self.cells.evaluate(start)
        for iteration in range(STEPS):
            grey = grey_at(image, place)
            residual = grey[:, 0] - template
            weight = robust(residual, tolerance)
            if iteration % HELD == 0:
                rough = max(LEAST, smoothness * self._noise(template, residual, weight, grey[:, 1:]))
                normal = self._normal(grey[:, 1:], weight, rough, self._every)
            change = self._change(normal, (weight * residual)[:, None] * grey[:, 1:], found - anchor)
            step = self.cells.evaluate(change)
            found, place = found + change, place + step
            if np.sqrt(np.mean(step**2)) < STILL * self.lattice.step:
                break
        return found, grey_at(image, place)

    def fit(self, flow: np.ndarray) -> np.ndarray:
        """Coefficients (knot, 2) of the field that is like a flow (pixel, 2), px, without its outliers.

        Weights of one in the mean are in the force alone, so that one matrix does for all flows: modified residuals
        (Huber 1981, Robust Statistics, section 7.8).
        """
        found = np.zeros((self.lattice.size, 2))
        for _ in range(FITS):
            residual = self.cells.evaluate(found) - flow
            weight = robust(np.hypot(*residual.T), 2)
            force = (weight / weight.mean())[:, None] * residual * self._turns
            found = found + self._change(self._even, force, found)
        return found

    @property
    def _every(self) -> int:
        return max(1, len(self.places) // (ENOUGH * len(self.cells.knots)))

    @cached_property
    def _turns(self) -> np.ndarray:
        """Lateral and axial motion are taken from every other pixel, so that one matrix does for both."""
        return np.eye(2)[np.arange(len(self.places)) % 2]

    @cached_property
    def _even(self) -> tuple[np.ndarray, float]:
        return self._normal(self._turns, np.ones(len(self.places)), LOOSE)

    def _change(self, normal: tuple[np.ndarray, float], force: np.ndarray, field: np.ndarray) -> np.ndarray:
        """Change of coefficients (knot, 2) against a force (pixel, 2) and the roughness of a field (knot, 2)."""
        factor, rough = normal
        change = -self.cells.gather(force, self.lattice.size).ravel() - rough * self._bend(field.ravel())
        solve(factor, change)
        return change.reshape(-1, 2)

    def _bend(self, change: np.ndarray) -> np.ndarray:
        """Half the slope of the roughness of a change, both of shape (unknowns,).

        That of the change less the affine motion of all knots that leaves the least of it: a wall that is shifted or
        stretched as a whole is not rough, though its components along and across the wall are.
        """
        whole = np.sum(self.bent * change[:, None], 0)
        return product(self.roughness, change) - np.sum(self.freed * whole, 1)

    def _noise(self, template: np.ndarray, residual: np.ndarray, weight: np.ndarray, slope: np.ndarray) -> float:
        """Noise over speckle, times the length of speckle over the distance of the knots.

        Power of the residuals (pixel,) by their weights over that of the template (pixel,); the length is that over
        which grey values with these slopes (pixel, 2) change by their standard deviation.
        """
        power, steepness = np.var(template), np.sqrt(np.mean(slope**2))
        noise = np.sum(weight * residual**2) / np.sum(weight)
        return noise / (np.sqrt(power) * steepness * self.lattice.step or 1.0)

    def _normal(
        self, slope: np.ndarray, weight: np.ndarray, smoothness: float, every: int = 1
    ) -> tuple[np.ndarray, float]:
        """Cholesky factor of the normal matrix of every so many pixels, and the weight that the roughness has in it."""
        band, cells = np.zeros(self.roughness.shape), self.cells
        add_matrix(cells.knots, cells.first, cells.across, cells.down, np.ascontiguousarray(slope), weight, every, band)
        scale = band[:, -1].mean() or 1.0
        band += scale * smoothness * self.roughness
        band[:, -1] += scale * ANCHOR
        factorise(band)
        return band, scale * smoothness


def robust(residual: np.ndarray, tolerance: float) -> np.ndarray:
    """Weights of Geman and McClure for residuals, with their own scale; a quarter where they are `tolerance` of it."""
    scale = tolerance * DEVIATION * np.median(np.abs(residual[::SAMPLE]))
    return 1 / (1 + (residual / (scale or 1.0)) ** 2) ** 2


def region(mask: np.ndarray, knots: float, margin: float, across: float) -> Region:
    """The wall and what is around it.

    Parameters
    ----------
    mask : ndarray of shape (axial, lateral), bool
        The wall; True somewhere.
    knots : float
        Distance of the knots, px.
    margin : float
        How far around the wall pixels count, px.
    across : float
        Length of a unit through the wall where roughness is measured.

    Returns
    -------
    Region
    """
    wide = ndimage.distance_transform_edt(~mask) <= margin
    thinned = wide & (np.indices(mask.shape).sum(0) % 2 == 0)
    if knots > FINE and (thinned & mask).any():
        wide = thinned
    places = np.argwhere(wide)[:, ::-1].astype(float)
    net = lattice(places, knots)
    cells, order = net.cells(places)
    rough = roughness(cells, *(each[order] for each in frame(mask, wide, knots, across)), net.size)
    affine = net.affine()
    bent = np.stack([product(rough, each) for each in affine.T], -1)
    freed = bent @ np.linalg.pinv(affine.T @ bent)
    return Region(net, cells, places[order], mask[wide][order], rough, bent, freed)
