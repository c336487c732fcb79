"""Quality of tracked points: the probability that a point is near its true place.

Near means within 1/256 of the side of the image, the distance of 1 px of TAP-Vid (Doersch et al. 2022,
arXiv:2211.03726). The error of a point is taken to be Gaussian in the plane. Its standard deviation follows from what a
tracker can tell of itself: the correlation of the images along the path of the point, how far the paths forwards and
backwards are apart, and how far the point has moved. The constants of each method are fitted by maximum likelihood
(benchmarks/calibration.py of 02d7c8a); docs/tracking.md says on which hearts.
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

    The variance s^2 of each coordinate of the error, with the side h of a pixel, the variance V of
    :class:`echotruth.tracking.accumulation.Path`, the disagreement d and the tracked displacement u, is

        s^2 = constant^2 + (pixel h)^2 + (correlation^2 + (pixel_correlation h)^2) V + (disagreement d)^2 + (motion u)^2
            + (unseen q u)^2,

    where q, from 0 to 1, is how far the point is not seen in the image.

    Attributes
    ----------
    constant, pixel, correlation, pixel_correlation, disagreement, motion, unseen : float
        See above.
    """

    constant: float
    pixel: float
    correlation: float
    pixel_correlation: float
    disagreement: float
    motion: float
    unseen: float = 0.0

    def probability(self, path: Path, shape: tuple[int, ...]) -> np.ndarray:
        """Probability that points are within 1/256 of the side of the image of their true places.

        Parameters
        ----------
        path : Path
        shape : tuple of int
            Axial and lateral size of the image, px.

        Returns
        -------
        ndarray of shape (frame, n)
            From 0 to 1; 1 at frame 0, NaN where the point is lost.
        """
        side = 1 / (IMAGE_FRACTION * max(shape))  # of a pixel
        displacement = np.hypot(*np.moveaxis(path.displacement, -1, 0))
        expected = self.variance(side, path.variance, side * path.disagreement, side * displacement)
        if path.unseen is not None:
            expected += (self.unseen * path.unseen * side * displacement) ** 2
        probability = within(1.0, expected)
        probability[0] = 1.0
        probability[~np.isfinite(path.displacement).all(-1)] = np.nan
        return probability

    def variance(
        self, pixel: float | np.ndarray, variance: np.ndarray, disagreement: np.ndarray, displacement: np.ndarray
    ) -> np.ndarray:
        """s^2 of points; all lengths in units of 1/256 of the longer side of the image.

        Parameters
        ----------
        pixel : float or ndarray
            Side h of a pixel.
        variance, disagreement, displacement : ndarray of one shape
            V, d and u; where d is NaN, there is only one way, and it is left out.

        Returns
        -------
        ndarray of the same shape
        """
        rate = self.correlation**2 + (self.pixel_correlation * pixel) ** 2
        known = np.nan_to_num(disagreement, nan=0.0)
        terms = (self.constant, self.pixel * pixel, self.disagreement * known, self.motion * displacement)
        expected = np.multiply(rate, variance, out=np.zeros(np.shape(variance)), where=np.greater(rate, 0))
        for term in terms:
            expected += np.square(term)
        return expected


ERRORS = {
    "phase_correlation_ED": ErrorModel(0.0, 0.0, 0.226, 0.145, 0.0, 0.0),
    "phase_correlation": ErrorModel(0.0, 0.307, 0.0, 0.0812, 0.0737, 0.096),
    "window_deformation": ErrorModel(0.286, 0.257, 0.339, 0.352, 0.0853, 0.0595),
    "affine_dic": ErrorModel(0.31, 0.192, 0.355, 0.655, 0.253, 0.0338),
    "dis": ErrorModel(0.28, 0.386, 0.309, 0.205, 0.15, 0.0712),
    "dis_fine": ErrorModel(0.292, 0.255, 0.294, 0.0, 0.196, 0.0516),
    "ilk": ErrorModel(0.475, 0.0, 0.11, 0.173, 0.0, 0.0771),
    "bspline_dic": ErrorModel(0.358, 0.0652, 0.0459, 0.0429, 0.25, 0.0221, 0.104),
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
