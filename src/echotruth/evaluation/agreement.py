"""How far tracked strain is from that of the heart, of its plane, and of the operator on the true displacement.

The error of a strain has three parts. What the plane shows is not what the heart does, for a wall that leans to the
plane thickens partly out of it (`plane` less `heart`); the operator smooths over its radius (`operator` less `plane`);
the rest is the tracker's (tracked less `operator`).
"""

from __future__ import annotations

import numpy as np

from echotruth.evaluation import statistics
from echotruth.evaluation.displacement import Wall

REFERENCES = ("heart", "plane", "operator")
"""What strain is compared with, all at the same material points: E of F in space along the wall's axes; E of the part
of F in the image plane along the wall's axes there; what the operator makes of the true displacement."""

ALIKE = 1e-6
"""Standard deviation up to which strains are alike. The operator makes 1e-7 of the rounding of a shift by 1 mm that is
kept in single precision (radius 0.45 mm, 35 points)."""


def compare(tracked: np.ndarray, true: np.ndarray, wall: Wall, es: int) -> dict[str, np.ndarray]:
    """Compare tracked strain with each reference.

    Parameters
    ----------
    tracked : ndarray of shape (frame, point, 3)
        Radial, tangential, shear; NaN where there is none.
    true : ndarray of shape (reference, frame, point, 3)
        In the order of `REFERENCES`.
    wall : Wall
        The points.
    es : int
        Frame of end-systole.

    Returns
    -------
    dict of ndarray
        strain_bias, strain_rms, strain_correlation (reference, region, 3)
            Mean and RMS of tracked minus true strain at ES, and their correlation, over the points of a region;
            region 0 is the whole wall, the others are its layers.
        frame_strain_rms (reference, frame, 3)
            RMS over the whole wall in every frame.
        tracked_segment_strain (frame, 17, 3), true_segment_strain (reference, frame, 17, 3)
            Mean of the AHA segments.
        tracked_global_strain (frame, 3), true_global_strain (reference, frame, 3)
            Mean of the whole wall.
        segment_strain_error (reference, 3)
            Mean size of the difference of a segment at ES.
        segment_agreement (reference, 4, 3)
            Over the segments of the view at ES: mean difference, its limits of agreement (Bland & Altman, Lancet 1986;
            327:307: 1.96 standard deviations, of n - 1 degrees of freedom, to either side), and the correlation.
        All over the points at which both are known; NaN where there are none. Strains that are alike have no
        correlation.
    """
    known = np.isfinite(tracked) & np.isfinite(true).all(0)
    tracked, true = np.where(known, tracked, np.nan), np.where(known, true, np.nan)
    error, regions = tracked - true, wall.regions
    every = np.ones((1, len(wall.segments)), bool)
    at_es = np.broadcast_to(tracked, true.shape)[:, es], true[:, es]
    segments = {name: statistics.mean(each, wall.segments) for name, each in (("tracked", tracked), ("true", true))}
    return {
        "strain_bias": statistics.mean(error[:, es], regions),
        "strain_rms": statistics.rms(error[:, es], regions),
        "strain_correlation": statistics.correlation(*at_es, regions, ALIKE),
        "frame_strain_rms": statistics.rms(error, regions[:1])[..., 0, :],
        "tracked_segment_strain": segments["tracked"],
        "true_segment_strain": segments["true"],
        "tracked_global_strain": statistics.mean(tracked, regions[:1])[..., 0, :],
        "true_global_strain": statistics.mean(true, regions[:1])[..., 0, :],
        "segment_strain_error": statistics.mean(np.abs(segments["tracked"] - segments["true"])[:, es], every)[:, 0],
        "segment_agreement": limits(segments["tracked"][es], segments["true"][:, es]),
    }


def limits(tracked: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Bias, limits of agreement and correlation of two ways to measure.

    Parameters
    ----------
    tracked, true : ndarray of shape (..., n, k)
        One row a segment; NaN where there is none.

    Returns
    -------
    ndarray of shape (..., 4, k)
        Mean difference, it less and plus 1.96 standard deviations, and the correlation; NaN where there are fewer than
        two rows. There is no correlation of strains that are alike.
    """
    difference = tracked - true
    every = np.ones((1, difference.shape[-2]), bool)
    count = np.isfinite(difference).sum(-2, keepdims=True)
    bias, spread = statistics.mean(difference, every), statistics.deviation(difference, every)
    reach = 1.96 * spread * np.sqrt(statistics.ratio(count, count - 1.0))
    together = statistics.correlation(np.broadcast_to(tracked, difference.shape), true, every, ALIKE)
    return np.concatenate([bias, bias - reach, bias + reach, together], -2)
