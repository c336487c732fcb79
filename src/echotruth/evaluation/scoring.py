"""The score of one clip, the same for every tracker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from echotruth.evaluation import statistics
from echotruth.evaluation.agreement import REFERENCES, compare
from echotruth.evaluation.clip import places
from echotruth.evaluation.displacement import Wall, evaluate
from echotruth.evaluation.strain import RADIUS, Operator
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import follow
from echotruth.imaging.view import Plane

if TYPE_CHECKING:
    from echotruth.workflow.job import Job

ALIKE = 1e-9
"""Standard deviation of distances that are alike, m: what rounding in single precision makes of 20 mm moved."""


@dataclass(frozen=True)
class Truth:
    """What the tissue at the points of one view of one heart has done; the same for all image sizes.

    Attributes
    ----------
    inside : ndarray of shape (grid rows, grid columns), bool
        Points of the grid in the wall at end-diastole; the other arrays hold these alone.
    wall : Wall
    operator : Operator
        The strain operator at the points.
    displacement : ndarray of shape (frame, point, 2)
        Since end-diastole: lateral, axial, m.
    through_plane : ndarray of shape (frame, point)
        Displacement out of the plane, m.
    strain : ndarray of shape (reference, frame, point, 3)
        Radial, tangential, shear; references as in :data:`echotruth.evaluation.agreement.REFERENCES`.
    es : int
        Frame of end-systole.
    """

    inside: np.ndarray
    wall: Wall
    operator: Operator
    displacement: np.ndarray
    through_plane: np.ndarray
    strain: np.ndarray
    es: int

    def on_grid(self, values: np.ndarray, axis: int) -> np.ndarray:
        """Values at the points on the whole grid, whose two axes take the place of one; NaN or 0 outside."""
        values = np.moveaxis(np.asarray(values), axis, 0)
        filled = np.full((*self.inside.shape, *values.shape[1:]), _nothing(values), values.dtype)
        filled[self.inside] = values
        return np.moveaxis(filled, (0, 1), (axis, axis + 1))

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """What the store keeps of it, on the grid."""
        es, reach = self.es, compare(self.strain[-1], self.strain, self.wall, self.es)
        return {
            "true_displacement": self.on_grid(self.displacement, 1),
            "through_plane": self.on_grid(self.through_plane, 1),
            "true_strain": self.on_grid(self.strain, 2),
            "wall_axes": self.on_grid(self.operator.axes, 0),
            "layer": self.on_grid(self.wall.layer, 0),
            "segment": self.on_grid(self.wall.segment, 0),
            "through_plane_rms": statistics.rms(self.through_plane[es][:, None], self.wall.regions[:1])[0, 0],
            "operator_bias": reach["strain_bias"],
            "operator_rms": reach["strain_rms"],
        }


def ground_truth(job: Job) -> Truth:
    """The truth of a job's heart and view.

    Parameters
    ----------
    job : Job
        Of any stage of one view; geometry, mechanics and phantom are read.

    Returns
    -------
    Truth
    """
    heart, config = job.heart, job.case.config
    phantom, largest = job.read("phantom", "origin", "axes", "centre"), config.bmode.sizes[0]
    axial, lateral = pixel_centres(config.bmode, largest)
    points = places(config, largest).round().astype(int)
    position = np.stack([lateral[points[..., 0]], axial[points[..., 1]]], axis=-1)
    motion = follow(heart, Plane(phantom["origin"], phantom["axes"]), position, job.view.plane)
    inside = motion["layer"] > 0
    labels = (motion[name][inside] for name in ("layer", "segment"))
    wall = Wall(position[inside], *labels, phantom["centre"], job.view.plane, heart.layers)
    operator = Operator(wall.position, motion["wall_axes"][inside], RADIUS * config.bmode.si().field_of_view)
    displacement = motion["true_displacement"][:, inside]
    strain = [motion[f"{name}_strain"][:, inside] for name in REFERENCES[:2]]
    strain.append(operator.strain(displacement))
    return Truth(inside, wall, operator, displacement, motion["through_plane"][:, inside], np.stack(strain), heart.es)


def score(tracked: np.ndarray, truth: Truth) -> dict[str, np.ndarray]:
    """Everything that is told of one tracker on one clip.

    Parameters
    ----------
    tracked : ndarray of shape (frame, grid rows, grid columns, 2)
        Displacement since end-diastole: lateral, axial, m; NaN where there is none.
    truth : Truth
        Of the view.

    Returns
    -------
    dict of ndarray
        What :func:`.displacement.evaluate` and :func:`.agreement.compare`
        return, and tracked_strain (frame, grid rows, grid columns, 3: radial, tangential, shear) and
        through_plane_correlation (): of the error's length with the distance moved out of the plane, at ES; NaN where
        either is the same at all points.
    """
    moved = np.asarray(tracked, float)[:, truth.inside]
    strain, es = truth.operator.strain(moved), truth.es
    away = np.linalg.norm(moved[es] - truth.displacement[es], axis=-1)
    out = np.abs(truth.through_plane[es])
    together = statistics.correlation(away[:, None], out[:, None], truth.wall.regions[:1], ALIKE)
    return {
        **evaluate(moved, truth.displacement, truth.wall, es),
        **compare(strain, truth.strain, truth.wall, es),
        "tracked_strain": truth.on_grid(strain, 1),
        "through_plane_correlation": together[0, 0],
    }


def row(score: dict[str, np.ndarray], plane: str) -> dict[str, float]:
    """The figures of one line of the leaderboard.

    Parameters
    ----------
    score : dict of ndarray
        As of :func:`score`.
    plane : {"short_axis", "long_axis"}
        Of the view: its tangential strain is the circumferential (`ecc`) or the longitudinal one (`ell`).

    Returns
    -------
    dict
        Figure to value, its unit at the end of its name; NaN for the strain that the plane does not show. All at ES but
        `nrmse_cycle_percent` and `drift_um`.
    """
    tangential = {"short_axis": "ecc", "long_axis": "ell"}[plane]
    tracked_change, true_change = (score[f"{name}_spread_change"] for name in ("tracked", "true"))
    strains = {"err": 0, "ecc": None, "ell": None, tangential: 1}
    figures = {
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
        "spread_change_percent": tracked_change,
        "true_spread_change_percent": true_change,
        "spread_returned_percent": 100 * tracked_change / true_change if true_change else np.nan,
        "through_plane_correlation": score["through_plane_correlation"],
        "coverage_percent": 100 * score["coverage"],
    }
    for name, axis in strains.items():
        figures |= {key: np.nan if axis is None else value for key, value in _strain(score, name, axis or 0).items()}
    return {name: float(value) for name, value in figures.items()}


def _strain(score: dict[str, np.ndarray], name: str, axis: int) -> dict[str, float]:
    """Figures of one strain, in points (hundredths of strain)."""
    heart, operator = (REFERENCES.index(each) for each in ("heart", "operator"))
    _, lower, upper, _ = score["segment_agreement"][heart, :, axis]
    return {
        f"global_{name}_bias_points": 100 * score["strain_bias"][heart, 0, axis],
        f"{name}_rms_points": 100 * score["strain_rms"][heart, 0, axis],
        f"{name}_correlation": score["strain_correlation"][heart, 0, axis],
        f"segment_{name}_error_points": 100 * score["segment_strain_error"][heart, axis],
        f"segment_{name}_limits_points": 100 * (upper - lower) / 2,
        f"tracker_{name}_bias_points": 100 * score["strain_bias"][operator, 0, axis],
        f"tracker_{name}_rms_points": 100 * score["strain_rms"][operator, 0, axis],
    }


def _nothing(values: np.ndarray) -> float:
    return np.nan if values.dtype.kind == "f" else 0
