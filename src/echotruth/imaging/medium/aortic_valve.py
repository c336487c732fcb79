"""The aortic valve: cusps hinged at the aortic annulus, open while the left ventricle empties.

In every plane through the axis of the root a cusp is an arc that keeps its length. Shut, the cusps meet on the axis,
below the widest part of the root, and are convex towards the ventricle; open they stand beside its walls. They echo as
mitral leaflets do. Adults have cusps some 17 to 20 mm high; here they are 16 mm. That the cusps are a surface of
revolution, angles and thickness were chosen by eye.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi, radians
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.heart import Heart
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium import arc
from echotruth.imaging.medium.annulus import Rim, box_of
from echotruth.imaging.medium.aortic_root import valve_ring
from echotruth.imaging.medium.body import Scene
from echotruth.imaging.medium.borders import border_density
from echotruth.imaging.medium.chamber_valve import AZIMUTH, ChamberLeaflets, ChamberValve
from echotruth.imaging.medium.filling import aortic_opening, course

MEETING = (0.97, 0.75)
"""Where the edges are when shut, from the annulus towards the axis and along it, over the radius of the annulus."""
TURN = radians(60)
"""How far a cusp turns from base to edge when shut, rad."""
OPEN = radians(88)
"""Angle of a cusp above the annulus when open, rad."""
NARROWING = 0.7
"""How much less of a cusp there is at its edge than at its base."""
THICKNESS = 0.08
"""Over the radius of the annulus: 1 mm in the human preset."""


class AorticValve(ChamberValve):
    """Where the cusps are.

    Parameters
    ----------
    heart : Heart
    between : sequence of float
        As of :class:`echotruth.imaging.medium.body.Scene`.
    """

    shut, turn, open_ = atan2(MEETING[1], MEETING[0]), TURN, OPEN

    def __init__(self, heart: Heart, between: Sequence[float] = ()) -> None:
        annulus = valve_ring(Rim(heart)(0), AZIMUTH)
        super().__init__(heart, annulus, TissueLabel.AORTIC_WALL, course(aortic_opening, heart, between))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the cusps reach in any frame."""
        return box_of(self.rings, np.array([-1.1, -1.1, -0.1]), np.array([1.1, 1.1, _length() + 0.1]))

    def leaflet(self, frame: int, azimuth: Floats, share: Floats) -> Floats:
        """Points of the cusps in a frame, (n, 3), m, at azimuths (n,), rad, and shares (n,) of their length."""
        inward, up = (_length() * arc.points(*self.angles(frame), share)).T
        radius = 1 - inward
        return self.ring(frame).to_heart(np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), up]))

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in a cusp in a frame, (n,)."""
        place = self.ring(frame).to_ring(position)
        profile = np.column_stack([1 - np.hypot(place[:, 0], place[:, 1]), place[:, 2]]) / _length()
        inside: NDArray[np.bool_] = np.abs(profile - 0.5).max(axis=1) < 0.6
        share, across = arc.inverse(*self.angles(frame), profile[inside])
        inside[inside] = (share > 0) & (share < 1) & (np.abs(across) * _length() < THICKNESS / 2)
        return inside


@dataclass(frozen=True, eq=False)
class AorticCusps(ChamberLeaflets):
    """Scatterers of the aortic valve.

    Attributes
    ----------
    place : ndarray of shape (n, 2)
        Azimuth around the root, rad, and share of the length from the annulus.
    amplitude : ndarray of shape (n,)
    """

    name = "aortic_cusps"
    valve = AorticValve

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers over the cusps, as dense as in mitral leaflets, with amplitudes of a border of the level."""
        random, radius = scene.random(cls.name), AorticValve(scene.heart).ring(0).radius
        number = random.poisson(border_density(scene.config) * 2 * pi * _length() * radius**2)
        azimuth, share = random.uniform(0, 2 * pi, number), random.random(number)
        return cls.at(scene, np.column_stack([azimuth, share])[random.random(number) > NARROWING * share])


def _length() -> float:
    """Length of a cusp over the radius of the annulus."""
    return hypot(*MEETING) / arc.chord(TURN)
