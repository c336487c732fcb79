"""Comparison of tracked strain with that of the heart, of its plane, and of the operator on the true displacement.

The error of a strain has three parts: a wall oblique to the image plane thickens partly out of it (`plane` minus
`heart`); the operator smooths over its radius (`operator` minus `plane`); the rest is the tracker's (tracked minus
`operator`).
"""

import numpy as np

from echotruth.evaluation import statistics
from echotruth.evaluation.displacement_error import WallPoints
from echotruth.repository.rounding import STRAIN

REFERENCES = ("heart", "plane", "operator")
"""Reference strains, all at the same material points: E = (F^T F - I) / 2 in space along the wall's axes; E of the part
of F in the image plane along the wall's axes there; the strain operator applied to the true displacement."""

Z = 1.96
"""Limits of agreement are so many standard deviations from the bias; 95 % of normal differences lie between them."""

STRAIN_ROUNDING = STRAIN
"""Standard deviation of strain that rounding can cause. Displacements rounded to 1/256 pixel give half of it through
the operator, whose radius is 19 pixels at 512 px."""


def compare(tracked: np.ndarray, true: np.ndarray, wall: WallPoints, es: int) -> dict[str, np.ndarray]:
    """Compare tracked strain with each reference.

    Parameters
    ----------
    tracked : ndarray of shape (frame, point, 3)
        Radial, tangential, shear; NaN where unknown.
    true : ndarray of shape (reference, frame, point, 3)
        In the order of `REFERENCES`.
    wall : WallPoints
    es : int
        Frame of end-systole.

    Returns
    -------
    dict of ndarray
        strain_bias, strain_rms, strain_correlation (reference, region, 3)
            Mean and RMS of tracked minus true strain at ES, and the correlation of tracked with true strain, over the
            points of a region; region 0 is the whole wall, the others are its layers.
        frame_strain_rms (reference, frame, 3)
            RMS over the whole wall in every frame.
        segment_strain_error (reference, 3)
            Mean absolute difference of the segment means at ES.
        segment_agreement (reference, 4, 3)
            Over the segments of the view at ES: as :func:`limits_of_agreement` returns them.
        All over the points at which both strains are known; NaN where there are none, and for the correlation of a
        strain that is constant.
    """
    known = np.isfinite(tracked) & np.isfinite(true).all(0)
    tracked, true = np.where(known, tracked, np.nan), np.where(known, true, np.nan)
    error, regions = tracked - true, wall.regions
    all_segments = np.ones((1, len(wall.segments)), bool)
    at_es = np.broadcast_to(tracked, true.shape)[:, es], true[:, es]
    tracked_segments, true_segments = (statistics.mean(strain, wall.segments) for strain in at_es)
    segment_error = np.abs(tracked_segments - true_segments)
    return {
        "strain_bias": statistics.mean(error[:, es], regions),
        "strain_rms": statistics.rms(error[:, es], regions),
        "strain_correlation": statistics.correlation(*at_es, regions, STRAIN_ROUNDING),
        "frame_strain_rms": statistics.rms(error, regions[:1])[..., 0, :],
        "segment_strain_error": statistics.mean(segment_error, all_segments)[:, 0],
        "segment_agreement": limits_of_agreement(tracked_segments, true_segments),
    }


def limits_of_agreement(tracked: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Bias, limits of agreement and correlation of two methods of measurement (Bland & Altman, Lancet 1986; 327:307).

    The limits are bias -/+ 1.96 sd sqrt(n / (n - 1)), with bias and sd the mean and the standard deviation of the
    difference over n rows.

    Parameters
    ----------
    tracked, true : ndarray of shape (..., n, k)
        One row per segment; NaN where unknown.

    Returns
    -------
    ndarray of shape (..., 4, k)
        Bias, lower limit, upper limit and correlation; NaN where there are fewer than two rows, and for the
        correlation of a strain that is constant.
    """
    difference = tracked - true
    all_rows = np.ones((1, difference.shape[-2]), bool)
    count = np.isfinite(difference).sum(-2, keepdims=True)
    bias, deviation = statistics.mean(difference, all_rows), statistics.standard_deviation(difference, all_rows)
    half_width = Z * deviation * np.sqrt(statistics.ratio(count, count - 1.0))
    tracked = np.broadcast_to(tracked, difference.shape)
    correlation = statistics.correlation(tracked, true, all_rows, STRAIN_ROUNDING)
    return np.concatenate([bias, bias - half_width, bias + half_width, correlation], -2)
