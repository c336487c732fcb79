"""Quality of tracked points: the probability that a point is near its true place.

Near means within 1/256 of the side of the image, the distance of 1 px of TAP-Vid (Doersch et al. 2022,
arXiv:2211.03726). The error of a point is taken to be Gaussian in the plane. Its standard deviation follows from what a
tracker can tell of itself: the correlation of the images along the path of the point and the size of their speckle, how
far the paths forwards and backwards are apart, and how far the point has moved. The constants of each method are fitted
by maximum likelihood (benchmarks/quality.py); docs/tracking.md says on which hearts.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from echotruth.tracking.accumulation import Path

IMAGE_FRACTION = 1 / 256
"""Error within which a point is near its true place, as a fraction of the longer side of the image."""


@dataclass(frozen=True)
class ErrorModel:
    """Distribution of the error of a tracker; lengths are in units of 1/256 of the longer side of the image.

    The variance s^2 of each coordinate of the error, with the correlation length l of the speckle
    (:mod:`echotruth.tracking.speckle`), the variance V of :class:`echotruth.tracking.accumulation.Path`, the tracked
    displacement u and the disagreement d, which is u at most, is

        s^2 = (speckle l)^2 V / (1 + V / limit) + (disagreement d)^2 + (wall D)^2 + (motion u)^2 + (unseen q u)^2,

    where D is the RMS of d over the points in the frame, and q, from 0 to 1, how far the point is not seen in the
    image. V l^2 is the variance of the places of speckle. It counts in full where images are alike. Where they are not,
    the tracker relies on what it expects of the motion, as a smooth one: with that as prior the variance is the noise's
    times the prior's over their sum. The two ways err together at many a point, but not at all of them, so that D tells
    more than d. Two ways that are farther apart than the point has moved do not say that it is farther off.

    Attributes
    ----------
    speckle, limit, disagreement, wall, motion, unseen : float
        See above.
    """

    speckle: float
    limit: float
    disagreement: float
    wall: float
    motion: float
    unseen: float = 0.0

    def probability(self, path: Path, speckle: float, shape: tuple[int, ...]) -> np.ndarray:
        """Probability that points are within 1/256 of the side of the image of their true places.

        Parameters
        ----------
        path : Path
        speckle : float
            Correlation length of the speckle, px.
        shape : tuple of int
            Axial and lateral size of the image, px.

        Returns
        -------
        ndarray of shape (frame, n)
            From 0 to 1; 1 at frame 0, NaN where the point is lost.
        """
        return _of_path(path, self.variance(squares(path, speckle, shape)))

    def variance(self, terms: "Squares") -> np.ndarray:
        """s^2 of points, in squares of 1/256 of the longer side of the image; the shape is that of the terms."""
        v = terms.variance
        noise = np.divide(v, 1 + v / self.limit, out=np.full_like(v, self.limit), where=np.isfinite(v))
        expected = self.speckle**2 * terms.speckle * noise
        expected += self.disagreement**2 * terms.disagreement + self.wall**2 * terms.wall
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
    """

    variance: np.ndarray
    speckle: float | np.ndarray
    disagreement: np.ndarray
    wall: np.ndarray
    motion: np.ndarray
    unseen: np.ndarray


def squares(path: Path, speckle: float, shape: tuple[int, ...]) -> Squares:
    """Terms of :class:`ErrorModel` for a path, with the arguments of :meth:`ErrorModel.probability`."""
    side = 1 / (IMAGE_FRACTION * max(shape))  # of a pixel
    moved = side * np.hypot(*np.moveaxis(path.displacement, -1, 0))
    apart = np.minimum(side * np.nan_to_num(path.disagreement, nan=0.0), np.nan_to_num(moved)) ** 2
    known = np.isfinite(moved).sum(1, keepdims=True)
    wall = np.broadcast_to(apart.sum(1, keepdims=True) / np.maximum(known, 1), apart.shape)
    unseen = np.zeros_like(moved) if path.unseen is None else path.unseen
    return Squares(path.variance, (speckle * side) ** 2, apart, wall, moved**2, unseen**2)


ERRORS = {
    "phase_correlation_ED": ErrorModel(0.251, 50.0, 0.0, 0.0, 0.523),
    "phase_correlation": ErrorModel(0.0607, 50.0, 0.298, 0.152, 0.0298),
    "window_deformation": ErrorModel(0.189, 20.4, 0.245, 0.192, 0.0426),
    "affine_dic": ErrorModel(0.365, 5.81, 0.272, 0.221, 0.0399),
    "dis": ErrorModel(0.27, 5.25, 0.166, 0.19, 0.0744),
    "dis_fine": ErrorModel(0.183, 6.54, 0.215, 0.243, 0.0529),
    "ilk": ErrorModel(0.235, 4.55, 0.234, 0.133, 0.051),
    "bspline_dic": ErrorModel(0.172, 3.6, 0.247, 0.143, 0.028, 0.137),
}
"""Fitted distributions by method, of comparison with ED by METHOD_ED and of the preset `fine` of dis by `dis_fine`."""


def error_model(settings: Any) -> ErrorModel:
    """Distribution of the error of a tracker with the settings of its section in `config/tracking.py`."""
    return ERRORS[error_name(settings)]


def error_name(settings: Any) -> str:
    """Key of :data:`ERRORS` for the settings of a tracker."""
    variants = (getattr(settings, "reference", None), getattr(settings, "preset", None))
    special = [f"{settings.method}_{variant}" for variant in variants]
    return next((name for name in special if name in ERRORS), settings.method)


def told_probability(path: Path, shape: tuple[int, ...]) -> np.ndarray:
    """:meth:`ErrorModel.probability` of a tracker that tells the deviation of its error."""
    assert path.deviation is not None
    return _of_path(path, (path.deviation / (IMAGE_FRACTION * max(shape))) ** 2)


def _of_path(path: Path, variance: np.ndarray) -> np.ndarray:
    """Probability (frame, n) by the variance of the error, in squares of 1/256 of the side of the image."""
    probability = within(1.0, variance)
    probability[0] = 1.0
    probability[~np.isfinite(path.displacement).all(-1)] = np.nan
    return probability


def within(radius: float, variance: np.ndarray) -> np.ndarray:
    """Probability 1 - exp(-r^2 / (2 s^2)) that a Gaussian error in the plane is within a radius.

    Parameters
    ----------
    radius : float
        r, any unit.
    variance : ndarray of any shape
        s^2 of each coordinate, in the square of that unit; infinite for an unknown place.

    Returns
    -------
    ndarray of the same shape
    """
    with np.errstate(divide="ignore"):
        return -np.expm1(-np.divide(radius**2, 2 * variance))
