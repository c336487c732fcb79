"""The wall at end-diastole as pixels and knots, and its alignment with one image after another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.tracking.alignment import add_matrix, factorise, grey_at, product, solve
from echotruth.tracking.bspline import Cells, Lattice, lattice

STEPS = 15
"""Most iterations."""
STILL = 0.01
"""Largest change of a coefficient in the last iteration, px."""
DEVIATION = 1.4826
"""Standard deviation of a Gaussian over the median of its absolute value."""
ANCHOR = 1e-6
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
        Band of the matrix of the summed squares of second differences of the coefficients.
    """

    lattice: Lattice
    cells: Cells
    places: np.ndarray
    inside: np.ndarray
    roughness: np.ndarray

    def align(
        self, image: np.ndarray, template: np.ndarray, start: np.ndarray, anchor: np.ndarray, stiffness: tuple
    ) -> tuple[np.ndarray, np.ndarray]:
        """Field U that makes sum w (I(X + U) - T)^2 and the roughness of its change since the template smallest.

        Parameters
        ----------
        image : ndarray
            Spline coefficients, see :func:`echotruth.imaging.spline.coefficients`.
        template : ndarray of shape (pixel,)
            Grey values T.
        start, anchor : ndarray of shape (knot, 2)
            Coefficients to begin with, and those of the template, px.
        stiffness : (float, float)
            Weight of the roughness over that of the image, and residual over its standard deviation
            at which a pixel has a quarter of its weight.

        Returns
        -------
        coefficients : ndarray of shape (knot, 2)
            px.
        grey : ndarray of shape (pixel, 3)
            Image carried back, and its slopes per px.
        """
        smoothness, tolerance = stiffness
        found = start
        for _ in range(STEPS):
            grey = grey_at(image, self.places + self.cells.evaluate(found))
            residual = grey[:, 0] - template
            change = self._step(grey[:, 1:], residual, robust(residual, tolerance), (found - anchor, smoothness))
            found = found + change
            if np.abs(change).max() < STILL:
                break
        return found, grey_at(image, self.places + self.cells.evaluate(found))

    def fit(self, flow: np.ndarray, smoothness: float) -> np.ndarray:
        """Coefficients (knot, 2) of the field that is like a flow (pixel, 2), px, without its outliers."""
        found = np.zeros((self.lattice.size, 2))
        for _ in range(3):
            residual = self.cells.evaluate(found) - flow
            weight = robust(np.hypot(*residual.T), 2)
            for component, slope in enumerate(np.eye(2)):
                slopes = np.broadcast_to(slope, flow.shape)
                change = self._step(slopes, residual[:, component], weight, (found * slope, smoothness))
                found = found + change * slope
        return found

    def _step(self, slope: np.ndarray, residual: np.ndarray, weight: np.ndarray, rough: tuple) -> np.ndarray:
        """Gauss-Newton step (knot, 2); roughness is that of some coefficients, times a weight."""
        band = np.zeros(self.roughness.shape)
        cells, slope = self.cells, np.ascontiguousarray(slope)
        add_matrix(cells.knots, cells.first, cells.across, cells.down, slope, weight, band)
        scale = band[:, -1].mean()
        coefficients, smoothness = rough
        right = -cells.gather((weight * residual)[:, None] * slope, self.lattice.size).ravel()
        right -= scale * smoothness * product(self.roughness, coefficients.ravel())
        band += scale * smoothness * self.roughness
        band[:, -1] += scale * ANCHOR or 1.0
        factorise(band)
        solve(band, right)
        return right.reshape(-1, 2)


def robust(residual: np.ndarray, tolerance: float) -> np.ndarray:
    """Weights of Geman and McClure for residuals, with their own scale; a quarter where they are `tolerance` of it."""
    scale = tolerance * DEVIATION * np.median(np.abs(residual))
    return 1 / (1 + (residual / (scale or 1.0)) ** 2) ** 2


def region(mask: np.ndarray, knots: float, margin: float) -> Region:
    """The wall and what is around it.

    Parameters
    ----------
    mask : ndarray of shape (axial, lateral), bool
        The wall; True somewhere.
    knots : float
        Distance of the knots, px.
    margin : float
        How far around the wall pixels count, px.

    Returns
    -------
    Region
    """
    wide = ndimage.distance_transform_edt(~mask) <= margin
    places = np.argwhere(wide)[:, ::-1].astype(float)
    net = lattice(wide, knots)
    cells, order = net.cells(places)
    return Region(net, cells, places[order], mask[wide][order], roughness(net, cells))


def roughness(net: Lattice, cells: Cells) -> np.ndarray:
    """Band of the matrix of the summed squares of all second differences on a lattice, the mixed ones twice."""
    seen = np.where(cells.knots < 0, cells.knots.max(), cells.knots)
    band = np.zeros((2 * net.size, 2 * int((cells.knots.max(1) - seen.min(1)).max()) + 2))
    last, mixed = band.shape[1] - 1, np.sqrt(2)
    line = [1, -2, 1]
    for weights, offsets in (
        (line, [(0, 0), (0, 1), (0, 2)]),
        (line, [(0, 0), (1, 0), (2, 0)]),
        ([mixed, -mixed, -mixed, mixed], [(0, 0), (0, 1), (1, 0), (1, 1)]),
    ):
        sets = net.neighbours(offsets)
        for i, j in np.ndindex(len(weights), len(weights)):
            low = sets[:, j] <= sets[:, i]
            row, back = 2 * sets[low, i], 2 * (sets[low, j] - sets[low, i])
            for component in (0, 1):
                np.add.at(band, (row + component, back + last), weights[i] * weights[j])
    return band
