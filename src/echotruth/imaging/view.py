"""Views: where the probe stands and which plane it images."""

from __future__ import annotations

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

    def image(self, positions: Floats) -> Floats:
        """Positions in the heart frame to lateral, axial, elevation; (..., 3) to (..., 3), m."""
        return (positions - self.origin) @ self.axes.T

    def heart(self, positions: Floats) -> Floats:
        """Lateral, axial, elevation to positions in the heart frame; (..., 3) to (..., 3), m."""
        return positions @ self.axes + self.origin


def plane(view: View, rf: Rf, endo_ed: Floats) -> Plane:
    """Place the probe before the heart at end-diastole.

    The heart stands at the transmit focus, where the beam is narrowest.

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
    apex = endo_ed[:, 2].min()
    depth = rf.si().focus
    if view.plane == "short_axis":
        axes = SHORT_AXIS
        middle = np.array([0, 0, view.position * apex])
    else:
        turn = view.si().rotation
        axes = np.array([[-np.cos(turn), -np.sin(turn), 0], [0, 0, 1.0], [-np.sin(turn), np.cos(turn), 0]])
        middle = np.array([0, 0, apex / 2])
    return Plane(middle - depth * axes[1], axes)
