"""Score of a tracker on one clip, and the metrics of the leaderboard made from it.

The formulas stand in :mod:`.displacement_error` (NRMSE and others), :mod:`.agreement` (strain), :mod:`.courses` and
:mod:`.contours` (strain and rotation over the cycle) and :mod:`.statistics`.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from echotruth.config import Config
from echotruth.evaluation import statistics
from echotruth.evaluation.agreement import REFERENCES, compare
from echotruth.evaluation.clip import Clip
from echotruth.evaluation.contours import Contours, contours
from echotruth.evaluation.courses import motion_courses, peak, strain_courses
from echotruth.evaluation.displacement_error import WallPoints, evaluate
from echotruth.evaluation.local_fit import LocalFit
from echotruth.evaluation.polar import UPRIGHT
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.heart import Heart
from echotruth.imaging.truth import cavity_centroid, material_truth
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import frame_times
from echotruth.repository import rounding, schema
from echotruth.repository.reader import Repository
from echotruth.repository.rounding import length_quantum
from echotruth.section import Section
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.point_grid import grid_positions
from echotruth.tracking.tracker import track

log = logging.getLogger("echotruth")

DISTANCE_ROUNDING = 1e-9
"""Standard deviation of distances that rounding can cause if they are not rounded to a quantum, m: that of a motion of
20 mm in single precision."""


@dataclass(frozen=True)
class Truth:
    """True motion of the tissue at the grid points of one view of one heart; the same for all image sizes.

    It is rounded as the store rounds it, so that whoever reads it there finds the same scores.

    Attributes
    ----------
    inside : ndarray of shape (grid rows, grid columns), bool
        Points of the grid in the wall at end-diastole; the other arrays hold only these.
    wall : WallPoints
    operator : StrainOperator
    displacement : ndarray of shape (frame, point, 2)
        Since end-diastole: lateral, axial, m.
    through_plane : ndarray of shape (frame, point)
        Displacement out of the plane, m.
    strain : ndarray of shape (reference, frame, point, 3)
        Radial, tangential, shear; references as in :data:`echotruth.evaluation.agreement.REFERENCES`.
    es : int
        Frame of end-systole.
    contours : Contours
    time : ndarray of shape (frame,)
        Since end-diastole, s.
    quantum : float
        Displacements are multiples of it, m; 0 if they are not rounded.
    """

    inside: np.ndarray
    wall: WallPoints
    operator: StrainOperator
    displacement: np.ndarray
    through_plane: np.ndarray
    strain: np.ndarray
    es: int
    contours: Contours
    time: np.ndarray
    quantum: float = 0.0

    def on_grid(self, values: np.ndarray, axis: int) -> np.ndarray:
        """Values of the points on the whole grid: (..., point, ...) to (..., grid rows, grid columns, ...).

        Outside the wall they are NaN, or 0 if they are integers.
        """
        values = np.moveaxis(np.asarray(values), axis, 0)
        fill = np.nan if values.dtype.kind == "f" else 0
        filled = np.full((*self.inside.shape, *values.shape[1:]), fill, values.dtype)
        filled[self.inside] = values
        return np.moveaxis(filled, (0, 1), (axis, axis + 1))

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the truth in the group `tracking`, on the grid."""
        operator = compare(self.strain[-1], self.strain, self.wall, self.es)
        return {
            "true_displacement": self.on_grid(np.dstack([self.displacement, self.through_plane]), 1),
            "true_strain": self.on_grid(self.strain, 2),
            "wall_axes": self.on_grid(self.operator.axes, 0),
            "through_plane_rms": statistics.rms(self.through_plane[self.es][:, None], self.wall.regions[:1])[0, 0],
            "operator_bias": operator["strain_bias"],
            "operator_rms": operator["strain_rms"],
            **{f"true_{name}": values for name, values in self.courses.items()},
        }

    @cached_property
    def courses(self) -> dict[str, np.ndarray]:
        """True strain and rotation over the cycle, by the names of :mod:`echotruth.evaluation.courses`."""
        strain = strain_courses(self.strain, self.wall)
        return _rounded(
            strain | motion_courses(self.displacement, self.contours.displacement, self.wall, self.contours)
        )

    @cached_property
    def contour_fit(self) -> LocalFit:
        """The fit of a displacement at the ends of the pieces of the contours."""
        return self.operator.at(self.contours.position.reshape(-1, 2))


def ground_truth(heart: Heart, plane: Plane, kind: str, config: Config) -> Truth:
    """True motion of a heart at the points that trackers follow in one view; the parameters of :func:`truth_at`."""
    return truth_at(heart, plane, kind, grid_positions(config), config)


def read_truth(repository: Repository, case: str, view: str) -> Truth:
    """True motion in one view of a repository."""
    config = repository.case(case).config
    return ground_truth(*repository.before_probe(case, view), config.views[view].plane, config)


def truth_at(heart: Heart, plane: Plane, kind: str, position: np.ndarray, config: Config) -> Truth:
    """True motion of the tissue at points of the image.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    kind : {"short_axis", "long_axis"}
        Orientation of the plane.
    position : ndarray of shape (grid rows, grid columns, 2), m
        Lateral, axial, at end-diastole.
    config : Config
        Its section bmode gives the field of view, and the quantum of lengths.
    """
    quantum = length_quantum(config)
    motion = material_truth(heart, plane, position, kind)
    inside = motion["layer"] > 0
    layer, segment = (motion[name][inside] for name in ("layer", "segment"))
    long_axis = tuple(plane.axes[:2, 2] / np.linalg.norm(plane.axes[:2, 2])) if kind == "long_axis" else UPRIGHT
    centre = cavity_centroid(heart, plane)
    wall = WallPoints(position[inside], layer, segment, centre, kind, heart.layers, long_axis)
    radius = RADIUS * config.bmode.si().field_of_view
    operator = StrainOperator(wall.position, _single(motion["wall_axes"][inside]), radius)
    displacement, through_plane = (
        _single(motion[name][:, inside], quantum) for name in ("true_displacement", "through_plane")
    )
    strain = [motion[f"{name}_strain"][:, inside] for name in REFERENCES[:2]]
    strain.append(operator.strain(displacement))
    stored = _single(np.stack(strain), rounding.STRAIN)
    lines, time = contours(heart, plane), frame_times(config.loop)[: len(heart.displacement)]
    return Truth(inside, wall, operator, displacement, through_plane, stored, heart.es, lines, time, quantum)


def _single(values: np.ndarray, quantum: float | None = None) -> np.ndarray:
    """Values as the store has them: of single precision, and rounded to a quantum."""
    return rounding.rounded(np.asarray(values, np.float32), quantum).astype(float)


def _rounded(courses: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Curves rounded to their quantum, the tracked ones too: what is equal must not differ by rounding."""
    return {name: rounding.rounded(values, rounding.CURVE) for name, values in courses.items()}


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
        displacement = _single(displacement, truth.quantum)
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


def scored(clip: Clip, truth: Truth, trackers: Mapping[str, Section]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Track a clip with every tracker, and compare what each finds with the truth.

    Parameters
    ----------
    clip : Clip
    truth : Truth
        True motion in the same view.
    trackers : mapping
        Name -> settings.

    Returns
    -------
    arrays : dict of ndarray
        displacement (tracker, frame, grid rows, grid columns, 2), m, quality (tracker, frame, grid rows, grid columns),
        and the results of :func:`score` with a leading dimension of the trackers.
    failures : dict
        Tracker -> why it found nothing.
    """
    found: list[dict[str, np.ndarray]] = []
    failures: dict[str, str] = {}
    for name, settings in trackers.items():
        log.info("%s", name)
        estimate, failure = estimated(clip, settings)
        if failure:
            log.warning("%s: %s", name, failure)
            failures[name] = failure
        found.append(scored_estimate(clip, truth, estimate))
    return {name: np.stack([one[name] for one in found]) for name in found[0]}, failures


def estimated(clip: Clip, settings: Section) -> tuple[tuple[np.ndarray, np.ndarray], str]:
    """What a tracker finds in a clip, as :func:`.track` returns it, and why it failed, or ""."""
    try:
        return track(*clip.tracker_arguments, settings), ""
    except TrackerFailed as error:
        return clip.no_estimate, str(error)


def scored_estimate(clip: Clip, truth: Truth, estimate: tuple[np.ndarray, np.ndarray]) -> dict[str, np.ndarray]:
    """What :func:`scored` returns of one tracker, without the dimension of the trackers, given what it found."""
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
    found = _rounded(strain_courses(strain, truth.wall) | motion)
    true, es = truth.courses, truth.es
    (tracked_peak, tracked_time), (true_peak, true_time) = (
        peak(course["line_strain"], truth.time) for course in (found, true)
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
