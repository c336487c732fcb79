"""The points that trackers follow in a view, and the true motion of their tissue: the stage points.

It is the same for all image sizes and trackers, and rounded as the store rounds it, so that whoever reads it there
finds the same scores.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from echotruth.config import Config
from echotruth.evaluation.agreement import REFERENCES, compare
from echotruth.evaluation.contours import Contours, contours
from echotruth.evaluation.courses import motion_courses, strain_courses
from echotruth.evaluation.displacement_error import WallPoints
from echotruth.evaluation.local_fit import LocalFit
from echotruth.evaluation.polar import UPRIGHT
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.heart import Heart
from echotruth.imaging.truth import cavity_centroid, material_truth
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import frame_times
from echotruth.repository import rounding
from echotruth.repository.rounding import length_quantum
from echotruth.tracking.point_grid import grid_positions
from echotruth.units import mm

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository


@dataclass(frozen=True)
class Truth:
    """True motion of the tissue at the grid points of one view of one heart.

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
    beat : int, optional
        Frames of the first beat, in which peaks are sought. Default: all.
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
    beat: int | None = None

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
        """Arrays of the group `points`, those of the points on the grid."""
        operator = compare(self.strain[-1], self.strain, self.wall, self.es)
        return {
            "layer": self.on_grid(self.wall.layer, 0),
            "segment": self.on_grid(self.wall.segment, 0),
            "true_displacement": self.on_grid(np.dstack([self.displacement, self.through_plane]), 1),
            "true_strain": self.on_grid(self.strain, 2),
            "wall_axes": self.on_grid(self.operator.axes, 0),
            "polar_origin": self.wall.origin,
            "long_axis": np.array(self.wall.long_axis),
            "contour_position": self.contours.position,
            "contour_displacement": self.contours.displacement,
            "contour_index": self.contours.contour,
            "es_frame": np.array(self.es),
            "operator_bias": operator["strain_bias"],
            "operator_rms": operator["strain_rms"],
            **{f"true_{name}": values for name, values in self.courses.items()},
        }

    @cached_property
    def courses(self) -> dict[str, np.ndarray]:
        """True strain and rotation over the cycle, by the names of :mod:`echotruth.evaluation.courses`."""
        strain = strain_courses(self.strain, self.wall)
        motion = motion_courses(self.displacement, self.contours.displacement, self.wall, self.contours)
        return rounded_curves(strain | motion)

    @cached_property
    def contour_fit(self) -> LocalFit:
        """The fit of a displacement at the ends of the pieces of the contours."""
        return self.operator.at(self.contours.position.reshape(-1, 2))


def ground_truth(heart: Heart, plane: Plane, kind: str, config: Config) -> Truth:
    """True motion of a heart at the points that trackers follow in one view; the parameters of :func:`truth_at`."""
    return truth_at(heart, plane, kind, grid_positions(config), config)


def stored_truth(arrays: Mapping[str, Any], kind: str, config: Config) -> Truth:
    """True motion at the points of a view, given the arrays of its group `points`.

    Parameters
    ----------
    arrays : mapping
    kind : {"short_axis", "long_axis"}
        Orientation of the plane.
    config : Config
        Of the case.
    """
    inside, position = arrays["layer"] > 0, grid_positions(config)
    motion = np.asarray(arrays["true_displacement"][:, inside], float)
    layer, segment = (arrays[name][inside] for name in ("layer", "segment"))
    long_axis = tuple(float(length) for length in arrays["long_axis"])
    origin, layers = arrays["polar_origin"], config.fibres.layers
    wall = WallPoints(position[inside], layer, segment, origin, kind, layers, long_axis)
    axes = np.asarray(arrays["wall_axes"][inside], float)
    return Truth(
        inside=inside,
        wall=wall,
        operator=StrainOperator(wall.position, axes, RADIUS * (config.bmode.field_of_view_mm * mm)),
        displacement=motion[..., :2],
        through_plane=motion[..., 2],
        strain=np.asarray(arrays["true_strain"][:, :, inside], float),
        es=int(arrays["es_frame"]),
        contours=Contours(*(arrays[f"contour_{name}"] for name in ("position", "displacement", "index"))),
        time=frame_times(config.loop)[: len(motion)],
        quantum=length_quantum(config),
        beat=config.loop.beat_starts[1],
    )


def read_truth(repository: Repository, case: str, view: str) -> Truth:
    """True motion at the points of one view of a repository."""
    config = repository.case(case).config
    return stored_truth(repository.arrays("points", case, view), config.views[view].plane, config)


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
    radius = RADIUS * (config.bmode.field_of_view_mm * mm)
    operator = StrainOperator(wall.position, single(motion["wall_axes"][inside]), radius)
    displacement, through_plane = (
        single(motion[name][:, inside], quantum) for name in ("true_displacement", "through_plane")
    )
    strain = [motion[f"{name}_strain"][:, inside] for name in REFERENCES[:2]]
    strain.append(operator.strain(displacement))
    stored = single(np.stack(strain), rounding.STRAIN)
    lines, time = contours(heart, plane), frame_times(config.loop)[: len(heart.displacement)]
    beat = config.loop.beat_starts[1]
    return Truth(inside, wall, operator, displacement, through_plane, stored, heart.es, lines, time, quantum, beat)


def single(values: np.ndarray, quantum: float | None = None) -> np.ndarray:
    """Values as the store has them: of single precision, and rounded to a quantum."""
    return rounding.rounded(np.asarray(values, np.float32), quantum).astype(float)


def rounded_curves(courses: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Curves rounded to their quantum, the tracked ones too: what is equal must not differ by rounding."""
    return {name: rounding.rounded(values, rounding.CURVE) for name, values in courses.items()}
