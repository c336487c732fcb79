"""Errors of tracked displacement, its drift, its spread within each layer and its segment means.

Every metric is taken over the points that have both a true and a tracked displacement. `coverage` is the fraction of
the wall's points that have one; in `nrmse_all` points without a tracked displacement count as points that did not move.
"""

from dataclasses import dataclass

import numpy as np

from echotruth.evaluation import statistics
from echotruth.evaluation.polar import UPRIGHT, resolve
from echotruth.evaluation.statistics import ratio

SEGMENTS = 17


@dataclass(frozen=True)
class WallPoints:
    """Points of one view at end-diastole.

    Attributes
    ----------
    position : ndarray of shape (point, 2)
        Lateral, axial, m.
    layer : ndarray of shape (point,), integer
        1 at the endocardium to `layers` at the epicardium; 0 outside the wall.
    segment : ndarray of shape (point,), integer
        AHA segment 1..17; 0 outside the wall.
    origin : ndarray of shape (2,)
        Origin of the polar components: lateral, axial, m.
    plane : {"short_axis", "long_axis"}
    layers : int
        Number of layers.
    long_axis : tuple of two float
        Unit vector along the long axis of the heart in the image of a long-axis view: lateral, axial.
    """

    position: np.ndarray
    layer: np.ndarray
    segment: np.ndarray
    origin: np.ndarray
    plane: str
    layers: int = 6
    long_axis: tuple[float, ...] = UPRIGHT

    @property
    def regions(self) -> np.ndarray:
        """Masks of the whole wall and of each of its layers, (1 + layers, point), bool."""
        return np.stack([self.layer > 0, *(self.layer == k for k in range(1, self.layers + 1))])

    @property
    def segments(self) -> np.ndarray:
        """Masks of the AHA segments, (17, point), bool."""
        return np.stack([(self.layer > 0) & (self.segment == k) for k in range(1, SEGMENTS + 1)])


def evaluate(tracked: np.ndarray, true: np.ndarray, wall: WallPoints, es: int) -> dict[str, np.ndarray]:
    """Compare tracked with true displacement of one clip.

    Parameters
    ----------
    tracked, true : ndarray of shape (frame, point, 2)
        Displacement since end-diastole: lateral, axial, m; NaN where unknown.
    wall : WallPoints
    es : int
        Frame of end-systole.

    Returns
    -------
    dict of ndarray
        rms_error (region, 3)
            RMS of tracked minus true at ES, radial, tangential, total, m; region 0 is the whole wall, the others
            are its layers.
        nrmse (region, 3)
            `rms_error` over the RMS of the true displacement of the same points.
        nrmse_all ()
            NRMSE of the whole vector over the whole wall; points without an estimate count as displaced by 0.
        segment_rms_error, segment_nrmse (17, 3)
            `rms_error` and `nrmse` of the AHA segments.
        frame_rms_error, frame_nrmse (frame, 3)
            `rms_error` and `nrmse` of the whole wall in every frame.
        nrmse_cycle ()
            RMS error of the whole vector over the whole wall and cycle, over the RMS of the true displacement.
        end_point_error (region, 3)
            Mean, median and 95th percentile of the length of the error at ES, m.
        drift ()
            RMS error in the last frame, when the tissue is almost back at its ED position, m.
        tracked_displacement_sd, true_displacement_sd (region, 2)
            Standard deviation of radial and tangential displacement over a region at ES, m.
        tracked_transmural_gradient, true_transmural_gradient ()
            :func:`transmural_gradient` of the tangential spread, %.
        tracked_segment_displacement, true_segment_displacement (17, 2)
            Mean radial, tangential displacement of the AHA segments at ES, m.
        coverage ()
            Fraction of the wall's points at ES that have an estimate.
        NaN where a region, segment or frame holds no such point.
    """
    tracked, true = np.asarray(tracked, float), np.asarray(true, float)
    known = np.isfinite(tracked - true).all(-1, keepdims=True)
    polar = {
        name: resolve(np.where(known, vector, np.nan), wall.position, wall.origin, wall.plane, wall.long_axis)
        for name, vector in (("tracked", tracked), ("true", true))
    }
    in_wall = np.isfinite(true[es]).all(-1) & wall.regions[0]
    return {
        **_errors(polar["tracked"] - polar["true"], polar["true"], wall, es),
        **_spreads(polar, wall, es),
        "nrmse_all": _nrmse(np.where(known, tracked, 0)[es] - true[es], true[es], in_wall[None])[0, -1],
        "coverage": ratio(np.sum(known[es, :, 0] & in_wall, dtype=float), np.sum(in_wall, dtype=float)),
    }


def transmural_gradient(endo: float, epi: float) -> np.ndarray:
    """Relative fall of the spread of displacement from the innermost to the outermost layer, (endo - epi) / endo.

    Parameters
    ----------
    endo, epi : float or ndarray of one shape
        Standard deviation of a displacement in the innermost and outermost layer, m.

    Returns
    -------
    ndarray of the same shape
        In %; negative where the spread increases outwards.
    """
    return 100 * ratio(np.asarray(endo) - epi, np.asarray(endo))


def _errors(error: np.ndarray, true: np.ndarray, wall: WallPoints, es: int) -> dict[str, np.ndarray]:
    """Metrics of the error; error and true displacement: radial, tangential, m, (frame, point, 2)."""
    regions, segments, length = wall.regions, wall.segments, np.linalg.norm(error[es], axis=-1)
    error_cycle, true_cycle = (vector[:, regions[0]].reshape(-1, 2) for vector in (error, true))
    frame_rms_error = _rms(error, regions[:1])[:, 0]
    quantiles = (statistics.quantile(length, regions, probability) for probability in (0.5, 0.95))
    return {
        "rms_error": _rms(error[es], regions),
        "nrmse": _nrmse(error[es], true[es], regions),
        "segment_rms_error": _rms(error[es], segments),
        "segment_nrmse": _nrmse(error[es], true[es], segments),
        "frame_rms_error": frame_rms_error,
        "frame_nrmse": _nrmse(error, true, regions[:1])[:, 0],
        "nrmse_cycle": _nrmse(error_cycle, true_cycle, np.ones((1, len(error_cycle)), bool))[0, -1],
        "end_point_error": np.stack([statistics.mean(length[:, None], regions)[:, 0], *quantiles], -1),
        "drift": frame_rms_error[-1, -1],
    }


def _spreads(polar: dict[str, np.ndarray], wall: WallPoints, es: int) -> dict[str, np.ndarray]:
    """Spread within each layer and segment means of the tracked and the true displacement at ES."""
    result = {}
    for name, value in polar.items():
        spread = statistics.standard_deviation(value[es], wall.regions)
        result[f"{name}_displacement_sd"] = spread
        result[f"{name}_transmural_gradient"] = transmural_gradient(spread[1, 1], spread[-1, 1])
        result[f"{name}_segment_displacement"] = statistics.mean(value[es], wall.segments)
    return result


def _rms(vector: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """RMS of the two components and of the whole vector, (..., mask, 3)."""
    square = statistics.mean(vector**2, masks)
    return np.sqrt(np.concatenate([square, square.sum(-1, keepdims=True)], -1))


def _nrmse(error: np.ndarray, true: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """NRMSE = RMS(error) / RMS(true)."""
    return ratio(_rms(error, masks), _rms(true, masks))
