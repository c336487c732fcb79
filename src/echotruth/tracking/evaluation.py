"""How far tracked motion is from the truth: errors, transmural spread and segment means at end-systole.

Every figure is taken over the points that have both a truth and an estimate, so that like is compared with like;
`coverage` tells how many of the wall's points those are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.tracking.polar import COMPONENTS, resolve

ERRORS = (*COMPONENTS, "total")
"""Order of the last axis of error arrays: the two components and the whole vector."""

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
        tracked_polar, true_polar (frame, point, 2)
            Radial, tangential displacement, m.
        rms_error (region, 3)
            RMS of tracked minus true at ES, radial, tangential, total, m; region 0 is the whole wall, the others
            are its layers.
        nrmse (region, 3)
            The same over the RMS of the true displacement.
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
    polar = {"tracked": _polar(tracked, wall), "true": _polar(true, wall)}
    inside = np.isfinite(polar["true"][es]).all(-1) & (wall.layer > 0)
    both = inside & np.isfinite(polar["tracked"][es]).all(-1)
    regions = np.stack([both] + [both & (wall.layer == k) for k in range(1, wall.layers + 1)])
    segments = np.stack([both & (wall.segment == k) for k in range(1, SEGMENTS + 1)])
    result = _errors(polar["tracked"][es], polar["true"][es], regions)
    result["coverage"] = _ratio(np.sum(both, dtype=float), np.sum(inside, dtype=float))
    for name, value in polar.items():
        spread = _deviation(value[es], regions)
        result[f"{name}_polar"] = value
        result[f"{name}_spread"] = spread
        result[f"{name}_spread_change"] = spread_change(spread[1, 1], spread[-1, 1])
        result[f"{name}_segment"] = _mean(value[es], segments)
    return result


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
    return 100 * _ratio(np.asarray(endo) - epi, np.asarray(endo))


def _polar(vector: np.ndarray, wall: Wall) -> np.ndarray:
    return resolve(np.asarray(vector, float), wall.position, wall.origin, wall.plane)


def _errors(tracked: np.ndarray, true: np.ndarray, masks: np.ndarray) -> dict[str, np.ndarray]:
    """RMS error (m) and its ratio to the RMS truth for every mask, shape (mask, 3)."""
    square = {}
    for name, value in (("error", tracked - true), ("true", true)):
        squares = value**2
        square[name] = _mean(np.concatenate([squares, squares.sum(-1, keepdims=True)], -1), masks)
    rms = np.sqrt(square["error"])
    return {"rms_error": rms, "nrmse": _ratio(rms, np.sqrt(square["true"]))}


def _mean(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Mean over the points of each mask: (point, k) and (mask, point) to (mask, k), NaN for an empty mask."""
    return np.stack([value[mask].mean(0) if mask.any() else np.full(value.shape[1], np.nan) for mask in masks])


def _deviation(value: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Standard deviation over the points of each mask, shaped as :func:`_mean`; one point has no spread (NaN)."""
    return np.stack([value[mask].std(0) if mask.sum() > 1 else np.full(value.shape[1], np.nan) for mask in masks])


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Quotient, NaN where the divisor is zero or NaN."""
    whole = np.asarray(whole, float)
    return np.divide(part, whole, out=np.full(whole.shape, np.nan), where=whole > 0)
