"""Displacement of points through a clip, from a tracker that compares two images at a time: which is the reference.

Of `bspline_dic`, which follows its own template, :mod:`.trackers.bspline_dic` says when the template is updated.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from echotruth.tracking.bidirectional import combined_variance, forward_backward, inverse_variance_weight, weighted_mean


class PairTracker(Protocol):
    """A tracker that compares two images."""

    def prepare(self, image: np.ndarray) -> Any:
        """Compute what is needed of an image in every comparison with another.

        Parameters
        ----------
        image : ndarray of shape (axial, lateral)
            Grey values.
        """

    def match(self, first: Any, second: Any, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement from one prepared image to another.

        Parameters
        ----------
        first, second
            As returned by :meth:`prepare`.
        points : ndarray of shape (n, 2)
            Positions in the first image: lateral, axial, px; NaN for lost points.

        Returns
        -------
        step : ndarray of shape (n, 2)
            Displacement of the tissue at each position: lateral, axial, px; NaN where unknown.
        quality : ndarray of shape (n,)
            From 0 to 1.
        """


@dataclass(frozen=True)
class Path:
    """Displacement of points since the first frame, and how far it may be off.

    Attributes
    ----------
    displacement : ndarray of shape (frame, n, 2)
        Lateral, axial, px; NaN where the point is lost.
    correlation : ndarray of shape (frame, n)
        Of the images of the last step, from 0 to 1; 1 at frame 0, NaN where the point is lost.
    variance : ndarray of shape (frame, n)
        Variance of the displacement by the correlations of all steps, up to a factor (see :func:`variance`).
    disagreement : ndarray of shape (frame, n)
        Distance of the displacements forwards and backwards, px; NaN where there is only one of them.
    unseen : ndarray of shape (frame, n), optional
        From 0 to 1: how far the image shows no tissue at the point, which then moves with what is around it. None of a
        tracker that gives none.
    deviation : ndarray of shape (frame, n), optional
        Standard deviation of the error along each axis, px, of a tracker that gives it.
    """

    displacement: np.ndarray
    correlation: np.ndarray
    variance: np.ndarray
    disagreement: np.ndarray
    unseen: np.ndarray | None = None
    deviation: np.ndarray | None = None


def accumulate(
    tracker: PairTracker, frames: np.ndarray, points: np.ndarray, reference: str
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement (frame, n, 2) and correlation (frame, n) of :func:`follow`, whose arguments these are."""
    path = follow(tracker, frames, points, reference)
    return path.displacement, path.correlation


def follow(tracker: PairTracker, frames: np.ndarray, points: np.ndarray, reference: str) -> Path:
    """Displacement of points since the first frame.

    Parameters
    ----------
    tracker : PairTracker
    frames : ndarray of shape (frame, axial, lateral)
        Grey values; frame 0 is end-diastole.
    points : ndarray of shape (n, 2)
        Positions at end-diastole: lateral, axial, px (0 is the centre of the first pixel).
    reference : {"ED", "previous", "bidirectional"}
        `ED`: every frame is compared with frame 0 at the initial position of the points. `previous`: each step is
        measured at the current position of the point, and the steps are added; a lost point stays lost.
        `bidirectional`: likewise from frame 0 both forwards and backwards; the two displacements are averaged with
        weights from their :func:`variance`.

    Returns
    -------
    Path
    """
    prepared = map(tracker.prepare, frames)
    if reference != "bidirectional":
        stepwise = reference == "previous"
        displacement, quality = _accumulate(tracker, prepared, points, stepwise)
        terms = variance(quality) if stepwise else step_variance(quality)
        return Path(displacement, quality, terms, np.full_like(quality, np.nan))
    images = list(prepared)
    results = []
    for order in forward_backward(len(images)):
        displacement, quality = _accumulate(tracker, (images[t] for t in order), points, True)
        # Either order is its own inverse permutation.
        results.append((displacement[order], quality[order], variance(quality)[order]))
    displacements, qualities, variances = zip(*results, strict=True)
    weight = inverse_variance_weight(*variances)
    # A way may be known of which the variance is not, as after a step of quality 0.
    forward, backward = (np.isfinite(each).all(-1) for each in displacements)
    weight[forward & ~backward], weight[backward & ~forward] = 1.0, 0.0
    return Path(
        weighted_mean(weight[..., None], *displacements),
        weighted_mean(weight, *qualities),
        combined_variance(*variances),
        length(displacements[0] - displacements[1]),
    )


def variance(quality: np.ndarray) -> np.ndarray:
    """Variance sum(1 / rho^2 - 1) of a sum of steps, up to a constant factor.

    The least variance of a shift found by correlation is proportional to the term of that step (Walker and Trahey 1995,
    IEEE Trans Ultrason Ferroelectr Freq Control 42:301).

    Parameters
    ----------
    quality : ndarray of shape (frame, n)
        Correlation rho of the images of each step, in the order of addition; NaN where the point is lost.

    Returns
    -------
    ndarray of shape (frame, n)
        Infinite from the step on in which the point is lost.
    """
    return np.cumsum(step_variance(quality), axis=0)


def step_variance(quality: np.ndarray) -> np.ndarray:
    """Variance 1 / rho^2 - 1 of single steps with correlations rho, up to a constant factor; infinite without one."""
    rho = np.where(quality > 0, np.minimum(quality, 1), np.nan)
    return np.nan_to_num(1 / rho**2 - 1, nan=np.inf)


def length(vectors: np.ndarray) -> np.ndarray:
    """Length of vectors along the last axis, in the plane or in space."""
    first, second, *third = np.moveaxis(vectors, -1, 0)
    plane = np.hypot(first, second)
    return np.hypot(plane, *third) if third else plane


def _accumulate(tracker: PairTracker, images: Iterator[Any], points: np.ndarray, stepwise: bool):
    """Displacement and quality from prepared images in the given order, step by step or against the first image."""
    displacement, quality = [np.zeros_like(points)], [np.ones(len(points))]
    first = next(images)
    for second in images:
        start = displacement[-1] if stepwise else displacement[0]
        step, step_quality = tracker.match(first, second, points + start)
        displacement.append(start + step)
        quality.append(np.where(np.isnan(displacement[-1]).any(-1), np.nan, step_quality))
        if stepwise:
            first = second
    return np.array(displacement), np.array(quality)
