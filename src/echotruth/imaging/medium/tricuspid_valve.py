"""The tricuspid valve: two sheets between right atrium and right ventricle, open while the left ventricle fills.

It has three leaflets in life; in the four-chamber view two of them are seen, and here there are two, alike, which meet
across that view. In every plane across the line on which they meet, a leaflet is an arc that keeps its length
(:mod:`.arc`): shut, they meet below the annulus and are convex towards the atrium; open, they point into the ventricle.
They follow the base. In people the septal leaflet is hinged up to 8 mm per m^2 of body surface nearer to the apex than
the mitral valve; here the whole annulus is, by 5 mm. All lengths and angles were chosen by eye.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, radians
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.heart import Heart
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium import arc
from echotruth.imaging.medium.anatomy import RIGHT_ATRIUM, anatomy_of
from echotruth.imaging.medium.annulus import box_of
from echotruth.imaging.medium.body import Scene
from echotruth.imaging.medium.borders import border_density
from echotruth.imaging.medium.chamber_valve import AZIMUTH, ChamberLeaflets, ChamberValve
from echotruth.imaging.medium.filling import course, opening

APICAL = 0.15
"""Distance of the annulus below the base, in R."""
TENTING, TURN, OPEN = 0.15, radians(25), radians(80)
"""Depth at which the leaflets meet, over the distance between both sides of the annulus; how far they turn from annulus
to edge when shut; and their angle below the annulus when open, rad."""
THICKNESS = 0.06
"""Over the radius of the annulus: 1 mm in the human preset."""


class TricuspidValve(ChamberValve):
    """Where the leaflets are.

    Parameters
    ----------
    heart : Heart
    between : sequence of float
        As of :class:`echotruth.imaging.medium.body.Scene`.
    """

    shut, turn, open_ = atan2(TENTING, 0.5), TURN, OPEN

    def __init__(self, heart: Heart, between: Sequence[float] = ()) -> None:
        anatomy, angle = anatomy_of(heart), AZIMUTH + RIGHT_ATRIUM
        distance, radius = anatomy.right_atrium
        middle = distance * np.array([np.cos(RIGHT_ATRIUM), np.sin(RIGHT_ATRIUM), 0.0])
        around = radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        points = anatomy.base + middle + around - [0, 0, APICAL * anatomy.radius]
        super().__init__(heart, points, TissueLabel.RIGHT_ATRIUM, course(opening, heart, between))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the leaflets reach in any frame."""
        return box_of(self.rings, np.array([-1.1, -1.1, -2 * _length() - 0.1]), np.array([1.1, 1.1, 0.1]))

    def leaflet(self, frame: int, side: Floats, across: Floats, share: Floats) -> Floats:
        """Points of the leaflets in a frame, (n, 3), m.

        They are on the side of the free wall, 1, or of the septum, -1, (n,), at distances (n,) across the line between
        both sides, over the radius of the annulus, and at shares (n,) of the length from the annulus.
        """
        half = np.sqrt(np.maximum(1 - across**2, 0))
        inward, down = 2 * half * _length() * arc.points(*self.angles(frame), share).T
        return self.ring(frame).to_heart(np.column_stack([side * (half - inward), across, -down]))

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in a leaflet in a frame, (n,)."""
        outward, across, up = self.ring(frame).to_ring(position).T
        half = np.sqrt(np.maximum(1 - across**2, 1e-12))
        size = 2 * half * _length()
        inside = np.zeros(len(position), bool)
        for side in (-1, 1):
            profile = np.column_stack([half - side * outward, -up]) / size[:, None]
            share, normal = arc.inverse(*self.angles(frame), profile)
            inside |= (share > 0) & (share < 1) & (np.abs(normal) * size < THICKNESS / 2)
        return inside & (np.abs(across) < 1)


@dataclass(frozen=True, eq=False)
class TricuspidLeaflets(ChamberLeaflets):
    """Scatterers of the tricuspid valve.

    Attributes
    ----------
    place : ndarray of shape (n, 3)
        Side, distance across and share of the length, as of :meth:`TricuspidValve.leaflet`.
    amplitude : ndarray of shape (n,)
    """

    name = "tricuspid_leaflets"
    valve = TricuspidValve

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers over the leaflets, as dense as in mitral ones, with amplitudes of a border of the level."""
        random, radius = scene.random(cls.name), TricuspidValve(scene.heart).ring(0).radius
        number = random.poisson(border_density(scene.config) * 8 * _length() * radius**2)
        side, across = np.where(random.random(number) < 0.5, -1.0, 1.0), random.uniform(-1, 1, number)
        place = np.column_stack([side, across, random.random(number)])
        return cls.at(scene, place[random.random(number) < np.sqrt(1 - across**2)])


def _length() -> float:
    """Length of a leaflet over the distance between both sides of the annulus."""
    return hypot(TENTING, 0.5) / arc.chord(TURN)
