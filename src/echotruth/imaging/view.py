"""Views: the pose of the probe and the plane it images."""

from dataclasses import dataclass

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Rf, View
from echotruth.heart import SHORT_AXIS


@dataclass(frozen=True)
class Plane:
    """An imaging plane in the heart frame.

    Attributes
    ----------
    origin : ndarray of shape (3,), m
        Centre of the array.
    axes : ndarray of shape (3, 3)
        Rows: unit vectors lateral, axial and elevation.
    """

    origin: Floats
    axes: Floats

    def to_image(self, positions: Floats) -> Floats:
        """Transform positions in the heart frame to lateral, axial, elevation; (..., 3) to (..., 3), m."""
        return (positions - self.origin) @ self.axes.T

    def to_heart(self, positions: Floats) -> Floats:
        """Transform lateral, axial, elevation to positions in the heart frame; (..., 3) to (..., 3), m."""
        return positions @ self.axes + self.origin


def imaging_plane(view: View, rf: Rf, endo_ed: Floats) -> Plane:
    """Plane of a view, with the heart at the transmit focus at end-diastole, where the beam is narrowest.

    Parameters
    ----------
    view : View
    rf : Rf
    endo_ed : ndarray of shape (n, 3), m
        Endocardial nodes at end-diastole.

    Returns
    -------
    Plane
    """
    apex, si = endo_ed[:, 2].min(), view.si()
    if view.plane == "short_axis":
        axes = tilted(SHORT_AXIS, si.tilt)
        centre = np.array([0, 0, view.position * apex])
    else:
        cos, sin = np.cos(si.rotation), np.sin(si.rotation)
        axes = tilted(np.array([[-cos, -sin, 0], [0, 0, 1.0], [-sin, cos, 0]]), si.tilt)
        # Half the length of the cavity from the middle of the base, which is the origin of the heart frame.
        centre = apex / 2 * axes[1] + 0.0  # no -0.0
    return Plane(centre - rf.si().focus * axes[1], axes)


def tilted(axes: Floats, angle: float) -> Floats:
    """Axes of a plane that is tilted about its lateral axis, so that its upper edge moves along the elevation axis.

    Parameters
    ----------
    axes : ndarray of shape (3, 3)
        Rows: unit vectors lateral, axial and elevation.
    angle : float, rad

    Returns
    -------
    ndarray of shape (3, 3)
    """
    if angle == 0:
        return axes
    lateral, axial, elevation = axes
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([lateral, cos * axial - sin * elevation, cos * elevation + sin * axial])
