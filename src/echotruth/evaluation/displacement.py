"""How far tracked displacement is from the truth: errors, drift, transmural spread and segment means.

Every figure is taken over the points that have both a truth and an estimate, so that like is compared with like;
`coverage` tells how many of the wall's points those are, and `nrmse_all` what becomes of the error when the lost ones
count as points that stood still.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.evaluation import statistics
from echotruth.evaluation.polar import resolve
from echotruth.evaluation.statistics import ratio

SEGMENTS = 17


@dataclass(frozen=True)
class Wall:
    """Where the points of one view lie at end-diastole.

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
    """

    position: np.ndarray
    layer: np.ndarray
    segment: np.ndarray
    origin: np.ndarray
    plane: str
    layers: int = 6

    @property
    def regions(self) -> np.ndarray:
        """Points of the whole wall, and of each of its layers; (1 + layers, point), bool."""
        return np.stack([self.layer > 0, *(self.layer == k for k in range(1, self.layers + 1))])

    @property
    def segments(self) -> np.ndarray:
        """Points of each AHA segment; (17, point), bool."""
        return np.stack([(self.layer > 0) & (self.segment == k) for k in range(1, SEGMENTS + 1)])


def evaluate(tracked: np.ndarray, true: np.ndarray, wall: Wall, es: int) -> dict[str, np.ndarray]:
    """Compare tracked with true displacement of one clip.

    Parameters
    ----------
    tracked, true : ndarray of shape (frame, point, 2)
        Displacement since end-diastole: lateral, axial, m; NaN where there is none.
    wall : Wall
        The points.
    es : int
        Frame of end-systole.

    Returns
    -------
    dict of ndarray
        rms_error (region, 3)
            RMS of tracked minus true at ES, radial, tangential, total, m; region 0 is the whole wall, the others
            are its layers.
        nrmse (region, 3)
            The same over the RMS of the true displacement.
        nrmse_all ()
            That of the whole vector over the whole wall, points without an estimate counted as still.
        segment_rms_error, segment_nrmse (17, 3)
            As `rms_error` and `nrmse`, of the AHA segments.
        frame_rms_error, frame_nrmse (frame, 3)
            As `rms_error` and `nrmse`, of the whole wall in every frame.
        nrmse_cycle ()
            RMS error of the whole vector over the whole wall and cycle, over the RMS of the true displacement.
        end_point_error (region, 3)
            Mean, median and 95th percentile of the length of the error at ES, m.
        drift ()
            RMS of the error in the last frame, when the tissue is all but back, m.
        tracked_spread, true_spread (region, 2)
            Standard deviation of radial and tangential displacement over a region at ES, m.
        tracked_spread_change, true_spread_change ()
            Fall of the tangential spread from endo- to epicardium, %.
        tracked_segment, true_segment (17, 2)
            Mean radial, tangential displacement of the AHA segments at ES, m.
        coverage ()
            Share of the wall's points at ES that have an estimate.
        NaN wherever there is no point.
    """
    tracked, true = (np.asarray(each, float) for each in (tracked, true))
    both = np.isfinite(tracked - true).all(-1, keepdims=True)
    alike = {"tracked": np.where(both, tracked, np.nan), "true": np.where(both, true, np.nan)}
    polar = {name: resolve(each, wall.position, wall.origin, wall.plane) for name, each in alike.items()}
    whole = wall.regions[0]
    inside = np.isfinite(true[es]).all(-1) & whole
    return {
        **_errors(polar["tracked"] - polar["true"], polar["true"], wall, es),
        **_spreads(polar, wall, es),
        "nrmse_all": _relative(np.where(both, tracked, 0)[es] - true[es], true[es], inside[None])[0, -1],
        "coverage": ratio(np.sum(both[es, :, 0] & inside, dtype=float), np.sum(inside, dtype=float)),
    }


def spread_change(endo: float, epi: float) -> np.ndarray:
    """Fall of the transmural spread from the innermost to the outermost layer.

    Parameters
    ----------
    endo, epi : float or ndarray of one shape
        Standard deviation of a displacement in the innermost and outermost layer, m.

    Returns
    -------
    ndarray of the same shape
        (endo - epi) / endo in %; negative when the spread grows outwards.
    """
    return 100 * ratio(np.asarray(endo) - epi, np.asarray(endo))


def _errors(error: np.ndarray, true: np.ndarray, wall: Wall, es: int) -> dict[str, np.ndarray]:
    """Figures of the error, radial and tangential, m, (frame, point, 2)."""
    regions, segments, length = wall.regions, wall.segments, np.linalg.norm(error[es], axis=-1)
    frames, every = _rms(error, regions[:1])[:, 0], np.ones((1, len(error) * regions[0].sum()), bool)
    quantiles = (statistics.quantile(length, regions, share) for share in (0.5, 0.95))
    return {
        "rms_error": _rms(error[es], regions),
        "nrmse": _relative(error[es], true[es], regions),
        "segment_rms_error": _rms(error[es], segments),
        "segment_nrmse": _relative(error[es], true[es], segments),
        "frame_rms_error": frames,
        "frame_nrmse": _relative(error, true, regions[:1])[:, 0],
        "nrmse_cycle": _relative(*(each[:, regions[0]].reshape(-1, 2) for each in (error, true)), every)[0, -1],
        "end_point_error": np.stack([statistics.mean(length[:, None], regions)[:, 0], *quantiles], -1),
        "drift": frames[-1, -1],
    }


def _spreads(polar: dict[str, np.ndarray], wall: Wall, es: int) -> dict[str, np.ndarray]:
    """Transmural spread and segment means of the tracked and the true motion."""
    result = {}
    for name, value in polar.items():
        spread = statistics.deviation(value[es], wall.regions)
        result[f"{name}_spread"] = spread
        result[f"{name}_spread_change"] = spread_change(spread[1, 1], spread[-1, 1])
        result[f"{name}_segment"] = statistics.mean(value[es], wall.segments)
    return result


def _rms(vector: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """RMS of both components and of the whole vector, (..., mask, 3)."""
    square = statistics.mean(vector**2, masks)
    return np.sqrt(np.concatenate([square, square.sum(-1, keepdims=True)], -1))


def _relative(error: np.ndarray, true: np.ndarray, masks: np.ndarray) -> np.ndarray:
    return ratio(_rms(error, masks), _rms(true, masks))
