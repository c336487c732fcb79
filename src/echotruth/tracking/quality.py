"""Quality of tracked points: the probability that a point is near its true place.

Near means within 1/256 of the side of the image, the distance of 1 px of TAP-Vid (Doersch et al. 2022,
arXiv:2211.03726). The error of a point is taken to be Gaussian in the plane. Its standard deviation follows from the
correlation of the images along the path of the point, the size of their speckle, the distance of the paths forwards and
backwards, how far the point has moved, and the deviation that a network gives. The constants of each method are fitted
by maximum likelihood (benchmarks/quality.py); docs/tracking.md says on which hearts.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from echotruth.tracking.accumulation import Path, length

IMAGE_FRACTION = 1 / 256
"""Error within which a point is near its true place, as a fraction of the longer side of the image."""


@dataclass(frozen=True)
class ErrorModel:
    """Distribution of the error of a tracker; lengths are in units of 1/256 of the longer side of the image.

    The variance s^2 of each coordinate of the error, with the correlation length l of the speckle
    (:mod:`echotruth.tracking.speckle`), the variance V of :class:`echotruth.tracking.accumulation.Path`, the tracked
    displacement u and the disagreement d, which is u at most, is

        s^2 = N prior^2 / (N + prior^2) + (disagreement d)^2 + (wall D)^2 + (motion u)^2 + (unseen q u)^2
              + (stated S)^2,

    where N = (speckle l)^2 V, D is the RMS of d over the points in the frame, q (0 to 1) how far the point is hidden,
    and S the deviation that a tracker gives, if it does. V l^2 is the variance of the places of speckle. It counts in
    full where images are alike; elsewhere the tracker relies on its prior, a smooth motion. At a point the
    ways forwards and backwards may agree and both be wrong, so that D, their disagreement over the whole frame, counts
    beside d. Where they are farther apart than the point has moved, d is that motion.

    Attributes
    ----------
    speckle, prior, disagreement, wall, motion, unseen, stated : float
        See above.
    """

    speckle: float
    prior: float
    disagreement: float
    wall: float
    motion: float
    unseen: float = 0.0
    stated: float = 0.0

    def probability(self, path: Path, speckle: float, shape: tuple[float, ...]) -> np.ndarray:
        """Probability that points are within 1/256 of the side of the image of their true places.

        Parameters
        ----------
        path : Path
        speckle : float
            Correlation length of the speckle, px.
        shape : tuple of float
            Sides of the image, px.

        Returns
        -------
        ndarray of shape (frame, n)
            From 0 to 1; 1 at frame 0, NaN where the point is lost.
        """
        probability = within(1.0, self.variance(squares(path, speckle, shape)), path.displacement.shape[-1])
        probability[0] = 1.0
        probability[~np.isfinite(path.displacement).all(-1)] = np.nan
        return probability

    def variance(self, terms: "Squares") -> np.ndarray:
        """s^2 of points, in squares of 1/256 of the longer side of the image; the shape is that of the terms."""
        prior = self.prior**2
        expected = prior * (1 - prior / (self.speckle**2 * terms.speckle * terms.variance + prior))
        expected += self.disagreement**2 * terms.disagreement + self.wall**2 * terms.wall
        expected += self.stated**2 * terms.stated
        return expected + (self.motion**2 + self.unseen**2 * terms.unseen) * terms.motion


@dataclass(frozen=True)
class Squares:
    """What the variance of the error is made of, in squares of 1/256 of the longer side of the image.

    Attributes
    ----------
    variance : ndarray of shape (frame, n)
        V, a number.
    speckle : float
        l^2.
    disagreement, wall, motion : ndarray of shape (frame, n)
        d^2, 0 where there is one way only, D^2, which is the same for all points of a frame, and u^2.
    unseen : ndarray of shape (frame, n)
        q^2, a number.
    stated : ndarray of shape (frame, n)
        S^2, 0 if the tracker gives none.
    """

    variance: np.ndarray
    speckle: float | np.ndarray
    disagreement: np.ndarray
    wall: np.ndarray
    motion: np.ndarray
    unseen: np.ndarray
    stated: np.ndarray


def squares(path: Path, speckle: float, shape: tuple[float, ...]) -> Squares:
    """Terms of :class:`ErrorModel` for a path, with the arguments of :meth:`ErrorModel.probability`."""
    side = 1 / (IMAGE_FRACTION * max(shape))  # of a pixel
    moved = side * length(path.displacement)
    apart = np.minimum(side * np.nan_to_num(path.disagreement, nan=0.0), np.nan_to_num(moved)) ** 2
    known = np.isfinite(moved).sum(1, keepdims=True)
    wall = np.broadcast_to(apart.sum(1, keepdims=True) / np.maximum(known, 1), apart.shape)
    unseen, stated = (np.zeros_like(moved) if each is None else each for each in (path.unseen, path.deviation))
    return Squares(path.variance, (speckle * side) ** 2, apart, wall, moved**2, unseen**2, (side * stated) ** 2)


ERRORS = {
    "phase_correlation_ED": ErrorModel(0.127, 50.0, 0.0, 0.0, 0.193, 0.0, 0.0),
    "phase_correlation": ErrorModel(0.0673, 50.0, 0.274, 0.164, 0.0383, 0.0, 0.0),
    "window_deformation": ErrorModel(0.15, 49.5, 0.178, 0.299, 0.054, 0.0, 0.0),
    "dis": ErrorModel(0.162, 1.72, 0.185, 0.333, 0.104, 0.0, 0.0),
    "dis_fine": ErrorModel(0.139, 1.94, 0.184, 0.336, 0.07, 0.0, 0.0),
    "bspline_dic": ErrorModel(0.153, 0.464, 0.205, 0.297, 0.0326, 0.203, 0.0),
    "bspline_dic_volume": ErrorModel(0.146, 0.343, 0.268, 0.34, 0.00529, 0.0, 0.0),
    "bspline_cnn": ErrorModel(0.0899, 0.261, 0.116, 0.188, 0.0114, 0.117, 0.693),
}
"""Fitted distributions by method: of comparison with ED by METHOD_ED, of the preset `fine` of dis by `dis_fine`, and of
volumes by METHOD_volume."""


def error_model(settings: Any, is_volume: bool = False) -> ErrorModel:
    """Distribution of the error of a tracker with the settings of its section in `config/tracking.py`."""
    return ERRORS[error_name(settings, is_volume)]


def error_name(settings: Any, is_volume: bool = False) -> str:
    """Key of :data:`ERRORS` for the settings of a tracker."""
    variants = (
        getattr(settings, "reference", None),
        getattr(settings, "preset", None),
        "volume" if is_volume else None,
    )
    special = [f"{settings.method}_{variant}" for variant in variants]
    return next((name for name in special if name in ERRORS), settings.method)


def within(radius: float, variance: np.ndarray, dimensions: int = 2) -> np.ndarray:
    """Probability that a Gaussian error is within a radius: 1 - exp(-r^2 / (2 s^2)) in the plane.

    In space it is the distribution of Maxwell, the regularised gamma function P(3/2, r^2 / (2 s^2)).

    Parameters
    ----------
    radius : float
        r, any unit.
    variance : ndarray of any shape
        s^2 of each coordinate, in the square of that unit; infinite for an unknown place.
    dimensions : {2, 3}

    Returns
    -------
    ndarray of the same shape
    """
    with np.errstate(divide="ignore"):
        square = np.divide(radius**2, 2 * variance)
    if dimensions == 2:
        return -np.expm1(-square)
    from scipy import special  # whoever brings a tracker needs none

    return special.gammainc(1.5, square)
