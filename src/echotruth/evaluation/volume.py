"""Scores of a motion that was tracked in a volume, against that of the heart.

Strain is that of one operator (:mod:`.strain`), of the tracked and of the true motion; the true strain of segments is
that of the elements. Global measures are those of the heart, by the same functions, with its nodes moved as the tracked
points about them (:mod:`.local_fit`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.statistics import ratio
from echotruth.evaluation.strain import StrainOperator
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, gradient
from echotruth.fem.volume import cell_volumes
from echotruth.heart import Heart
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.truth import displacement as true_displacement
from echotruth.imaging.truth import labels, strain
from echotruth.imaging.view import Plane
from echotruth.mechanics.contours import global_longitudinal_strain
from echotruth.mechanics.fibres import axes_from_normal
from echotruth.mechanics.twist import APICAL_SLICE, BASAL_SLICE, rotation

COMPONENTS = ("rr", "cc", "ll", "rc", "rl", "cl")
"""Components of strain, in the order of the arrays."""
FEWEST = 8
"""Points of a segment from which on it has a mean."""


@dataclass(frozen=True)
class VolumePoints:
    """Points of the wall at end-diastole, and their true motion.

    Attributes
    ----------
    heart : Heart
        As it moves before the probe.
    plane : Plane
        Of the probe.
    position : ndarray of shape (point, 3), m
        At end-diastole: lateral, axial, elevation; all in the wall.
    radius : float, m
        Of the neighbourhood of the strain operator.
    """

    heart: Heart
    plane: Plane
    position: Floats
    radius: float

    @cached_property
    def _material(self) -> MaterialPoints:
        return locate(self.heart.positions(0), self.heart.cells, self.plane.to_heart(self.position))

    @property
    def is_in_wall(self) -> NDArray[np.bool_]:
        """Whether each point is in the wall at end-diastole, (point,)."""
        return self._material.cell >= 0

    @cached_property
    def displacement(self) -> Floats:
        """True displacement since end-diastole, (frame, point, 3), m: lateral, axial, elevation."""
        frames = range(len(self.heart.displacement))
        return np.stack([true_displacement(self.heart, frame, self._material) @ self.plane.axes.T for frame in frames])

    @cached_property
    def segment(self) -> NDArray[np.generic]:
        """AHA segment of each point, (point,)."""
        return labels(self.heart, self._material)["segment"]

    def strain(self, frame: int) -> Floats:
        """True Green-Lagrange strain since end-diastole in a frame, (point, 6): RR, CC, LL, RC, RL, CL."""
        return strain(self.heart, frame, self._material)

    @cached_property
    def operator(self) -> StrainOperator:
        """The strain operator at the points."""
        normal = gradient(self.heart.wall_depth, self.heart.positions(0), self.heart.cells, self._material)
        return StrainOperator(self.position, axes_from_normal(normal) @ self.plane.axes.T, self.radius)

    def nodes(self, displacement: Floats) -> Floats:
        """Nodes of the heart in each frame, (frame, node, 3), m, moved as the points about them.

        A node near which too few points are known moves as the known node next to it.
        """
        start = self.heart.positions(0)
        moved = self.operator.at(self.plane.to_image(start))(displacement)[:, :, 0] @ self.plane.axes
        known = np.isfinite(moved).all(axis=(0, 2))
        if not known.any():
            return start + moved
        from scipy.spatial import cKDTree  # takes 50 ms, and only volumes need it

        _, nearest = cKDTree(start[known]).query(start)
        return start + moved[:, known][:, nearest]


def metrics(displacement: Floats, points: VolumePoints, es: int) -> dict[str, float]:
    """Metrics of a tracked motion.

    Parameters
    ----------
    displacement : ndarray of shape (frame, point, 3), m
        Since end-diastole: lateral, axial, elevation; NaN where unknown.
    points : VolumePoints
    es : int
        Frame of end-systole.

    Returns
    -------
    dict
        Name of a metric, which ends in its unit, to its value, at ES but for drift and that of the cycle:
        `nrmse_percent`, of the components in the middle plane and of that through it apart, and
        `nrmse_all_percent`, for which unknown points count as at rest; bias and RMS error of the strain of AHA
        segments, all six components, against the strain of the elements; bias of GLS, of twist and of ejection
        fraction.
    """
    true: Floats = points.displacement
    known = np.asarray(np.isfinite(displacement).all(axis=-1))
    error = np.where(known[..., None], displacement - true, np.nan)
    at_rest = np.where(known[..., None], error, -true)
    values = {
        "nrmse_percent": _nrmse(error[es], true[es], known[es]),
        "nrmse_in_plane_percent": _nrmse(error[es, :, :2], true[es, :, :2], known[es]),
        "nrmse_through_plane_percent": _nrmse(error[es, :, 2:], true[es, :, 2:], known[es]),
        "nrmse_all_percent": _nrmse(at_rest[es], true[es], np.ones(len(true[es]), bool)),
        "nrmse_cycle_percent": _nrmse(error, true, known),
        "drift_um": 1e6 * _rms(error[-1][known[-1]]),
        "coverage_percent": 100 * float(known[es].mean()),
    }
    return values | _strain_metrics(displacement[es], points, es) | _global_metrics(displacement, points, es)


def _nrmse(error: Floats, true: Floats, known: NDArray[np.bool_]) -> float:
    """100 RMS(error) / RMS(true) over the known points."""
    return 100 * float(ratio(np.asarray(_rms(error[known])), np.asarray(_rms(true[known]))))


def _rms(vectors: Floats) -> float:
    """Root mean square of the length of vectors (..., d); NaN without any."""
    return float(np.sqrt((vectors**2).sum(axis=-1).mean())) if vectors.size else np.nan


def segment_strain(displacement: Floats, points: VolumePoints) -> Floats:
    """Means over AHA segments 1 to 17, (17, 6), of the operator's strain of a displacement (point, 3), m."""
    return _segment_means(points.operator.strain(displacement[None])[0], points)


def _segment_means(strains: Floats, points: VolumePoints) -> Floats:
    means = np.full((17, strains.shape[1]), np.nan)
    for number in range(17):
        own = strains[points.segment == number + 1]
        own = own[np.isfinite(own).all(axis=1)]
        if len(own) >= FEWEST:
            means[number] = own.mean(axis=0)
    return means


def _strain_metrics(displacement: Floats, points: VolumePoints, es: int) -> dict[str, float]:
    """Bias and RMS error of the strain of segments, percentage points."""
    error = 100 * (segment_strain(displacement, points) - _segment_means(points.strain(es), points))
    error = error[np.isfinite(error).all(axis=1)]
    values = {}
    for number, name in enumerate(COMPONENTS):
        of = error[:, number]
        values[f"segment_e_{name}_bias_pp"] = float(of.mean()) if len(of) else np.nan
        values[f"segment_e_{name}_rms_pp"] = float(np.sqrt(np.mean(of**2))) if len(of) else np.nan
    return values


def _global_metrics(displacement: Floats, points: VolumePoints, es: int) -> dict[str, float]:
    """Errors of the global measures at ES."""
    heart = points.heart
    tracked, true = points.nodes(displacement[[0, es]]), np.stack([heart.positions(0), heart.positions(es)])
    known = np.isfinite(tracked).all()
    found = _global(tracked, points) - _global(true, points) if known else np.full(3, np.nan)
    names = ("gls_bias_pp", "twist_bias_deg", "ef_bias_pp")
    return dict(zip(names, map(float, found), strict=True))


def _global(nodes: Floats, points: VolumePoints) -> Floats:
    """GLS, %, twist, degrees, and ejection fraction, %, from nodes at ED and ES, (2, node, 3), m."""
    heart = points.heart
    gls = global_longitudinal_strain(heart.wall_depth, heart.cells, *nodes)
    base, apex = (rotation(heart.nodes, heart.endo, nodes, slice_)[1] for slice_ in (BASAL_SLICE, APICAL_SLICE))
    cavity = Cavity(heart.endo)
    ed, es = (cell_volumes(cavity.positions(each), cavity.cells).sum() for each in nodes)
    return np.array([100 * gls, np.degrees(apex - base), 100 * (1 - es / ed)])
