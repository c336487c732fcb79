"""Score of a tracker on one clip, and the metrics of the leaderboard made from it.

The formulas stand in :mod:`.displacement_error` (NRMSE and others), :mod:`.agreement` (strain), :mod:`.courses` and
:mod:`.contours` (strain and rotation over the cycle) and :mod:`.statistics`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from echotruth.evaluation import statistics
from echotruth.evaluation.agreement import REFERENCES, compare
from echotruth.evaluation.clip import Clip
from echotruth.evaluation.courses import motion_courses, peak, strain_courses
from echotruth.evaluation.displacement_error import evaluate
from echotruth.evaluation.points import Truth, rounded_curves, single
from echotruth.repository import schema
from echotruth.section import Section
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track

if TYPE_CHECKING:
    from echotruth.evaluation.volume import VolumeClip

Estimate = tuple[np.ndarray, np.ndarray]
"""Displacement and quality, as :func:`.track` returns them."""

DISTANCE_ROUNDING = 1e-9
"""Standard deviation of distances that rounding can cause if they are not rounded to a quantum, m: that of a motion of
20 mm in single precision."""


def score(tracked: np.ndarray, truth: Truth) -> dict[str, np.ndarray]:
    """Compare the displacement of one tracker on one clip with the truth.

    Parameters
    ----------
    tracked : ndarray of shape (frame, grid rows, grid columns, 2)
        Displacement since end-diastole: lateral, axial, m; NaN where unknown.
    truth : Truth
        True motion in the same view.

    Returns
    -------
    dict of ndarray
        The results of :func:`.displacement_error.evaluate` and :func:`.agreement.compare` on the displacement rounded
        as the store rounds it; through_plane_correlation (): of the length of the error with the displacement out
        of the plane, at ES, NaN where either is the same at all points; and those of :func:`curves`.
    """
    displacement = np.asarray(tracked, float)[:, truth.inside]
    if truth.quantum:
        displacement = single(displacement, truth.quantum)
    strain, es = truth.operator.strain(displacement), truth.es
    error = np.linalg.norm(displacement[es] - truth.displacement[es], axis=-1)[:, None]
    through_plane = np.abs(truth.through_plane[es])[:, None]
    correlation = statistics.correlation(
        error, through_plane, truth.wall.regions[:1], max(truth.quantum, DISTANCE_ROUNDING)
    )
    return {
        **evaluate(displacement, truth.displacement, truth.wall, es),
        **compare(strain, truth.strain, truth.wall, es),
        "through_plane_correlation": correlation[0, 0],
        **curves(displacement, strain, truth),
    }


def scored(clips: Iterable[Clip], truth: Truth, found: Iterable[Estimate]) -> dict[str, np.ndarray]:
    """What a tracker found in the clips of a view, in all sizes, and how it compares with the truth.

    Parameters
    ----------
    clips : iterable of Clip
        One of each size.
    truth : Truth
        True motion in the view.
    found : iterable of tuple
        What :func:`estimated` returns of each clip.

    Returns
    -------
    dict of ndarray
        displacement (size, frame, grid rows, grid columns, 2), m, quality (size, frame, grid rows, grid columns), and
        the results of :func:`score` with a leading dimension of the sizes.
    """
    rows = [scored_estimate(clip, truth, estimate) for clip, estimate in zip(clips, found, strict=True)]
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def estimated(clip: Clip | VolumeClip, settings: Section) -> tuple[Estimate, str]:
    """What a tracker finds in a clip, as :func:`.track` returns it, and why it failed, or ""."""
    frames, points, mask, spacing, time, seed = clip.tracker_arguments
    try:
        return track(frames, points, mask, spacing, time, seed, clip.suited(settings)), ""
    except TrackerFailed as error:
        return clip.no_estimate, str(error)


def scored_estimate(clip: Clip, truth: Truth, estimate: Estimate) -> dict[str, np.ndarray]:
    """What :func:`scored` returns, of one clip, given what the tracker found."""
    displacement, quality = clip.on_grid(*estimate)
    return {"displacement": displacement, "quality": quality} | score(displacement, truth)


def curves(displacement: np.ndarray, strain: np.ndarray, truth: Truth) -> dict[str, np.ndarray]:
    """Tracked strain and rotation over the cycle, and the errors of what is read from them.

    Parameters
    ----------
    displacement : ndarray of shape (frame, point, 2)
        Since end-diastole: lateral, axial, m; NaN where unknown.
    strain : ndarray of shape (frame, point, 3)
        Of that displacement, by the operator.
    truth : Truth

    Returns
    -------
    dict of ndarray
        tracked_region_strain (frame, measure, region, 3), tracked_segment_strain (frame, measure, 17, 3),
        tracked_line_strain (frame, 3) and tracked_rotation (frame,), rad, as :mod:`.courses` defines them; and tracked
        minus true: line_strain_error (3,) and rotation_error (), rad, at ES, peak_line_strain_error (3,) of the peaks
        and time_to_peak_error (3,), s, of their times.
    """
    pieces = truth.contour_fit(displacement)[:, :, 0].reshape(len(displacement), -1, 2, 2)
    motion = motion_courses(displacement, pieces, truth.wall, truth.contours)
    found = rounded_curves(strain_courses(strain, truth.wall) | motion)
    true, es = truth.courses, truth.es
    (tracked_peak, tracked_time), (true_peak, true_time) = (
        peak(course["line_strain"][: truth.beat], truth.time) for course in (found, true)
    )
    return {
        **{f"tracked_{name}": values for name, values in found.items()},
        "line_strain_error": (found["line_strain"] - true["line_strain"])[es],
        "peak_line_strain_error": tracked_peak - true_peak,
        "time_to_peak_error": tracked_time - true_time,
        "rotation_error": (found["rotation"] - true["rotation"])[es],
    }


def metrics(score: dict[str, np.ndarray], plane: str) -> dict[str, float]:
    """Metrics of one row of the leaderboard.

    Parameters
    ----------
    score : dict of ndarray
        As :func:`score` returns it.
    plane : {"short_axis", "long_axis"}
        Orientation of the view: its tangential strain is circumferential (`e_cc`) or longitudinal (`e_ll`).

    Returns
    -------
    dict
        Name of a metric, which ends in its unit, to its value; NaN for the strain that the plane does not show. All at
        ES except `nrmse_cycle_percent`, `drift_um`, and peak and time to peak. Strain is compared with that in the
        plane, so that a tracker is not blamed for what the plane does not show; `tracker_e_..._pp` with the operator's.
    """
    tangential = {"short_axis": "e_cc", "long_axis": "e_ll"}[plane]
    tracked_gradient, true_gradient = (score[f"{name}_transmural_gradient"] for name in ("tracked", "true"))
    components = {"e_rr": 0, "e_cc": None, "e_ll": None, tangential: 1}
    values = {
        "nrmse_percent": 100 * score["nrmse"][0, 2],
        "nrmse_all_percent": 100 * score["nrmse_all"],
        "nrmse_cycle_percent": 100 * score["nrmse_cycle"],
        "radial_nrmse_percent": 100 * score["nrmse"][0, 0],
        "tangential_nrmse_percent": 100 * score["nrmse"][0, 1],
        "rms_error_um": 1e6 * score["rms_error"][0, 2],
        "epe_um": 1e6 * score["end_point_error"][0, 0],
        "epe_median_um": 1e6 * score["end_point_error"][0, 1],
        "epe_p95_um": 1e6 * score["end_point_error"][0, 2],
        "drift_um": 1e6 * score["drift"],
        "transmural_gradient_percent": tracked_gradient,
        "true_transmural_gradient_percent": true_gradient,
        "transmural_gradient_recovered_percent": 100 * tracked_gradient / true_gradient if true_gradient else np.nan,
        "through_plane_correlation": score["through_plane_correlation"],
        "coverage_percent": 100 * score["coverage"],
    }
    values |= _line_metrics(score, plane)
    for name, component in components.items():
        strain = _strain_metrics(score, name, component or 0)
        values |= dict.fromkeys(strain, np.nan) if component is None else strain
    return {name: float(value) for name, value in values.items()}


def _line_metrics(score: dict[str, np.ndarray], plane: str) -> dict[str, float]:
    """Metrics of the strain of the middle contour, GCS or GLS, and of rotation; errors are absolute values."""
    middle = schema.LABELS["contour"].index("middle")
    bias, rotation = 100 * score["line_strain_error"][middle], score["rotation_error"]
    shown, other = ("gcs", "gls") if plane == "short_axis" else ("gls", "gcs")
    return {
        f"{name}_{what}_pp": value if name == shown else np.nan
        for name in sorted((shown, other))
        for what, value in (("bias", bias), ("error", np.abs(bias)))
    } | {
        "peak_strain_error_pp": 100 * np.abs(score["peak_line_strain_error"][middle]),
        "time_to_peak_error_ms": 1e3 * np.abs(score["time_to_peak_error"][middle]),
        "rotation_error_deg": np.degrees(np.abs(rotation)),
    }


def _strain_metrics(score: dict[str, np.ndarray], name: str, component: int) -> dict[str, float]:
    """Metrics of one strain component, in percentage points."""
    plane, operator = REFERENCES.index("plane"), REFERENCES.index("operator")
    _, lower, upper, _ = score["segment_agreement"][plane, :, component]
    return {
        f"global_{name}_bias_pp": 100 * score["strain_bias"][plane, 0, component],
        f"{name}_rms_pp": 100 * score["strain_rms"][plane, 0, component],
        f"{name}_correlation": score["strain_correlation"][plane, 0, component],
        f"segment_{name}_error_pp": 100 * score["segment_strain_error"][plane, component],
        f"segment_{name}_limits_pp": 100 * (upper - lower) / 2,
        f"tracker_{name}_bias_pp": 100 * score["strain_bias"][operator, 0, component],
        f"tracker_{name}_rms_pp": 100 * score["strain_rms"][operator, 0, component],
    }
