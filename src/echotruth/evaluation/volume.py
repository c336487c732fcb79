"""Scores of a motion that was tracked in a volume, against that of the heart.

Strain is that of one operator (:mod:`.strain`), of the tracked and of the true motion; the true strain of segments is
that of the elements. Global measures are those of the heart, by the same functions, with its nodes moved as the tracked
points about them (:mod:`.local_fit`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.config import Config
from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.clip import tracker_seed
from echotruth.evaluation.statistics import ratio
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, gradient
from echotruth.fem.volume import cell_volumes
from echotruth.heart import Heart
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.truth import displacement as true_displacement
from echotruth.imaging.truth import labels, strain
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import frame_times
from echotruth.mechanics.contours import global_longitudinal_strain
from echotruth.mechanics.fibres import axes_from_normal
from echotruth.mechanics.twist import APICAL_SLICE, BASAL_SLICE, rotation
from echotruth.repository.datasets import as_stored
from echotruth.section import Section
from echotruth.tracking.point_grid import grid_voxels, voxel_positions
from echotruth.units import mm

COMPONENTS = ("rr", "cc", "ll", "rc", "rl", "cl")
"""Components of strain, in the order of the arrays."""
FEWEST = 8
"""Points of a segment from which on it has a mean."""
POINT_SPACING = 0.45
"""Distance of the points that trackers follow, over the radius of the strain operator."""


@dataclass(frozen=True)
class VolumeClip:
    """Volumes of one view of one heart, as trackers receive them; they count lateral first, as in an image.

    Attributes
    ----------
    case : Case
    view : str
    frames : ndarray of shape (frame, axial, elevation, lateral), uint8
        B-mode; frame 0 is end-diastole.
    mask : ndarray of shape (axial, elevation, lateral), bool
        The wall at end-diastole.
    """

    case: Case
    view: str
    frames: NDArray[np.uint8]
    mask: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """The most voxels along a side."""
        return max(self.mask.shape)

    @cached_property
    def voxels(self) -> NDArray[np.int64]:
        """Voxels that are followed: those of the grid in the wall, (point, 3); axial, elevation, lateral."""
        grid: NDArray[np.int64] = grid_voxels(self.case.config, POINT_SPACING * strain_radius(self.case.config))
        return grid[self.mask[tuple(grid.T)]]

    @property
    def positions(self) -> Floats:
        """Positions of the points at end-diastole, (point, 3), m: lateral, axial, elevation."""
        return voxel_positions(self.case.config, self.voxels)

    @property
    def spacing(self) -> Floats:
        """Sides of a voxel, (3,), m: lateral, elevation, axial."""
        return np.array(self.case.config.volume.voxel_mm)[::-1] * mm

    @property
    def tracker_arguments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, int]:
        """Arguments of a tracker, in the order of :func:`echotruth.tracking.tracker.track`."""
        points, time = self.voxels[:, ::-1].astype(float), frame_times(self.case.config.loop)
        return self.frames, points, self.mask, self.spacing, time, tracker_seed(self.case, self.view)

    def suited(self, settings: Section) -> Section:
        """Settings of a tracker; that a cycle is open `bspline_dic` does not see in volumes: it goes forwards only."""
        if isinstance(settings, BsplineDic) and not self.case.config.views[self.view].motion.is_closed:
            return settings.model_copy(update={"reference": "previous"})
        return settings

    @property
    def no_estimate(self) -> tuple[Floats, Floats]:
        """Displacement (frame, point, 3) and quality (frame, point) of a tracker that failed, all NaN."""
        shape = len(self.frames), len(self.voxels)
        return np.full((*shape, 3), np.nan), np.full(shape, np.nan)

    def arrays(self, displacement: Floats, quality: Floats) -> dict[str, Floats]:
        """Displacement (frame, point, 3), m, and quality of what a tracker found: lateral, axial, elevation."""
        return {"displacement": (displacement * self.spacing)[..., [0, 2, 1]], "quality": quality}


def strain_radius(config: Config) -> float:
    """Radius of the strain operator, m: that in the image of a slice."""
    return RADIUS * config.bmode.field_of_view_mm * mm


def volume_points(heart: Heart, plane: Plane, config: Config) -> VolumePoints:
    """Points that trackers follow in the volumes of a heart, as it moves before the probe."""
    grid = voxel_positions(config, grid_voxels(config, POINT_SPACING * strain_radius(config)))
    every = VolumePoints(heart, plane, grid, strain_radius(config))
    return replace(every, position=grid[every.is_in_wall])


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
        """Whether each point is in the left wall at end-diastole, (point,)."""
        return (self._material.cell >= 0) & ~self.heart.right_wall[self._material.cell]

    @cached_property
    def displacement(self) -> Floats:
        """True displacement since end-diastole, (frame, point, 3), m: lateral, axial, elevation."""
        frames = range(len(self.heart.displacement))
        return np.stack([true_displacement(self.heart, frame, self._material) @ self.plane.axes.T for frame in frames])

    @cached_property
    def labels(self) -> dict[str, NDArray[np.generic]]:
        """Layer, AHA segment and region of disease of each point, (point,)."""
        return labels(self.heart, self._material)

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """Arrays of the group `points`."""
        found = {"position": self.position, "true_displacement": self.displacement, "es_frame": np.array(self.heart.es)}
        return found | {name: self.labels[name] for name in ("layer", "segment")}

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


def scored_volumes(
    clip: VolumeClip, estimate: tuple[Floats, Floats], heart: Heart, plane: Plane
) -> dict[str, NDArray[Any] | list[Any]]:
    """What a tracker found in volumes, as the store has it, and how it compares with the motion of the heart.

    Parameters
    ----------
    clip : VolumeClip
    estimate : tuple
        What :func:`echotruth.tracking.tracker.track` returns of it.
    heart, plane
        As of :class:`VolumePoints`.

    Returns
    -------
    dict
        Arrays of a group `tracking/TRACKER`, and the coordinate `score` of its scores.
    """
    found = as_stored(clip.case, {"tracking/TRACKER": clip.arrays(*estimate)})["tracking/TRACKER"]
    points = VolumePoints(heart, plane, clip.positions, strain_radius(clip.case.config))
    scores = metrics(found["displacement"], points, heart.es)
    return found | {"score": list(scores), "scores": list(scores.values())}


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
    true, displacement = points.displacement, np.asarray(displacement, float)
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
        own = strains[points.labels["segment"] == number + 1]
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
