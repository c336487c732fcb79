"""What a view shows of a modelled heart: strain of segments along the wall, and rotation, as trackers are scored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.evaluation.courses import rotation
from echotruth.evaluation.displacement_error import SEGMENTS
from echotruth.evaluation.segment_strain import COMPONENTS
from echotruth.evaluation.strain import engineering
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, gradient, interpolate
from echotruth.heart import Heart
from echotruth.imaging.truth import IMAGE_AXES, labels, wall_axes
from echotruth.imaging.view import Plane, imaging_plane
from echotruth.mechanics.fibres import axes_from_normal
from echotruth.mechanics.kinematics import IMAGE_COMPONENTS, strain
from echotruth.tracking.point_grid import grid_positions

ROTATION = "rotation"
Kind = Literal["short_axis", "long_axis", "volume"]


def quantity(kind: str) -> str:
    """Strain along the wall that a plane shows: `circumferential` or `longitudinal`."""
    return COMPONENTS[kind][1]


@dataclass(frozen=True)
class ImagedWall:
    """Points of a wall that are in an imaging plane at end-diastole.

    Attributes
    ----------
    plane : Plane
    kind : {"short_axis", "long_axis"}
    points : MaterialPoints of length n
    segment : ndarray of shape (n,)
        AHA segment 1..17 of the points.
    """

    plane: Plane
    kind: Kind
    points: MaterialPoints
    segment: NDArray[np.integer]

    @classmethod
    def of(cls, heart: Heart, config: Config, view: str) -> ImagedWall:
        """Wall of a heart in a view, at the points that trackers follow there."""
        section = config.views[view]
        plane = imaging_plane(section, config.rf, heart.endo_at_ed)
        position = grid_positions(config).reshape(-1, 2)
        in_plane = np.column_stack([position, np.zeros(len(position))])
        found = locate(heart.positions(0), heart.cells, plane.to_heart(in_plane))
        inside = np.flatnonzero(found.cell >= 0)
        points = MaterialPoints(found.cell[inside], found.xi[inside])
        segment = labels(heart, points)["segment"].astype(int)
        return cls(plane, section.plane, points, segment)

    def seen(self, heart: Heart, at_ed: Floats, at_es: Floats) -> Floats:
        """Strain of the segments and rotation at end-systole of these points.

        Strain is engineering strain since end-diastole, of the part of the deformation gradient in the plane, along the
        axes of the wall there: the reference `plane` of :mod:`echotruth.evaluation.agreement`.

        Parameters
        ----------
        heart : Heart
            Its cells and wall depth count.
        at_ed, at_es : ndarray of shape (n_nodes, 3), m
            Nodes at end-diastole and end-systole.

        Returns
        -------
        ndarray of shape (18,)
            Rotation, rad, NaN in a long axis, and the strain of segments 1..17, NaN where the view does not show them.
        """
        values = np.column_stack([at_es, heart.wall_depth])
        gradients = gradient(values, at_ed, heart.cells, self.points)
        normal = axes_from_normal(gradients[:, 3])[:, IMAGE_AXES[self.kind]]
        rows = self.plane.axes[:2]
        in_plane = np.einsum("ai,nij,bj->nab", rows, gradients[:, :3], rows)
        tangential = engineering(strain(in_plane, wall_axes(normal, self.plane), IMAGE_COMPONENTS))[:, 1]
        count = np.bincount(self.segment, minlength=SEGMENTS + 1)[: SEGMENTS + 1]
        total = np.bincount(self.segment, tangential, minlength=SEGMENTS + 1)[: SEGMENTS + 1]
        found = np.where(count > 0, total / np.maximum(count, 1), np.nan)
        found[0] = self._rotation(heart, at_ed, at_es) if self.kind == "short_axis" else np.nan
        return found

    def _rotation(self, heart: Heart, at_ed: Floats, at_es: Floats) -> float:
        ed, es = (self.plane.to_image(interpolate(nodes, heart.cells, self.points))[:, :2] for nodes in (at_ed, at_es))
        return float(rotation(ed, (es - ed)[None])[0])
