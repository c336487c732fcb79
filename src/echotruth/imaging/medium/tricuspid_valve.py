"""The tricuspid valve: two sheets between right atrium and right ventricle, open while the left ventricle fills.

It has three leaflets in life; in the four-chamber view two of them are seen, and here there are two, alike, which meet
across that view. In every plane across the line on which they meet, a leaflet is an arc that keeps its length
(:mod:`.arc`): shut, they meet below the annulus and are convex towards the atrium; open, they point into the ventricle.
They follow the base. In people the septal leaflet is hinged up to 8 mm per m^2 of body surface nearer to the apex than
the mitral valve; here the whole annulus is, by 5 mm. All lengths and angles were chosen by eye.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, hypot, pi, radians
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium import arc
from echotruth.imaging.medium.anatomy import RIGHT_ATRIUM, Anatomy
from echotruth.imaging.medium.annulus import Ring
from echotruth.imaging.medium.body import CavityBody, Scene
from echotruth.imaging.medium.borders import border_amplitude, border_density
from echotruth.imaging.medium.filling import course, opening
from echotruth.imaging.medium.surroundings import SurroundingsMotion

APICAL = 0.15
"""Distance of the annulus below the base, in R."""
TENTING, TURN, OPEN = 0.15, radians(25), radians(80)
"""Depth at which the leaflets meet, over the distance between both sides of the annulus; how far they turn from annulus
to edge when shut; and their angle below the annulus when open, rad."""
THICKNESS = 0.06
"""Over the radius of the annulus: 1 mm in the human preset."""
POINTS = 12
"""Of the annulus, by which its motion is known."""


class TricuspidValve:
    """Where the leaflets are.

    Attributes
    ----------
    opening : ndarray of shape (frame,)
        As of :func:`echotruth.imaging.medium.filling.opening`.

    Parameters
    ----------
    heart : Heart
    between : sequence of float
        As of :class:`echotruth.imaging.medium.body.Scene`.
    """

    def __init__(self, heart: Heart, between: Sequence[float] = ()) -> None:
        self.opening, anatomy = course(opening, heart, between), Anatomy(heart)
        distance, radius = anatomy.right_atrium
        self._azimuth = np.linspace(0, 2 * pi, POINTS, endpoint=False)
        angle = self._azimuth + RIGHT_ATRIUM
        middle = distance * np.array([np.cos(RIGHT_ATRIUM), np.sin(RIGHT_ATRIUM), 0.0])
        around = radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        points = anatomy.base + middle + around - [0, 0, APICAL * anatomy.radius]
        # With the base, as the atrium does; a decay length has no part in that.
        self._motion = SurroundingsMotion(heart, points, 1.0, np.full(POINTS, TissueLabel.RIGHT_ATRIUM, np.uint8))

    def ring(self, frame: int) -> Ring:
        """The tricuspid annulus in a frame: its first axis is away from the left ventricle."""
        points = self._motion(frame)
        area = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
        return Ring.of(points, self._azimuth, area / np.linalg.norm(area))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the leaflets reach in any frame."""
        rings = [self.ring(frame) for frame in range(len(self.opening))]
        middles, reach = np.stack([ring.middle for ring in rings]), 2 * max(ring.radius for ring in rings)
        return middles.min(axis=0) - reach, middles.max(axis=0) + reach

    def leaflet(self, frame: int, side: Floats, across: Floats, share: Floats) -> Floats:
        """Points of the leaflets in a frame, (n, 3), m.

        They are on the side of the free wall, 1, or of the septum, -1, (n,), at distances (n,) across the line between
        both sides, over the radius of the annulus, and at shares (n,) of the length from the annulus.
        """
        half = np.sqrt(np.maximum(1 - across**2, 0))
        inward, down = 2 * half * _length() * arc.points(*self._angles(frame), share).T
        return self.ring(frame).to_heart(np.column_stack([side * (half - inward), across, -down]))

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in a leaflet in a frame, (n,)."""
        outward, across, up = self.ring(frame).to_ring(position).T
        half = np.sqrt(np.maximum(1 - across**2, 1e-12))
        size = 2 * half * _length()
        inside = np.zeros(len(position), bool)
        for side in (-1, 1):
            profile = np.column_stack([half - side * outward, -up]) / size[:, None]
            share, normal = arc.inverse(*self._angles(frame), profile)
            inside |= (share > 0) & (share < 1) & (np.abs(normal) * size < THICKNESS / 2)
        return inside & (np.abs(across) < 1)

    def _angles(self, frame: int) -> tuple[float, float]:
        """Angles of a leaflet below the annulus at base and edge in a frame, rad."""
        share, middle = float(self.opening[frame]), atan2(TENTING, 0.5)
        first, last = middle - TURN / 2, middle + TURN / 2
        return first + (OPEN - first) * share, last + (OPEN - last) * share


@dataclass(frozen=True, eq=False)
class TricuspidLeaflets(CavityBody):
    """Scatterers of the tricuspid valve.

    Attributes
    ----------
    place : ndarray of shape (n, 3)
        Side, distance across and share of the length, as of :meth:`TricuspidValve.leaflet`.
    amplitude : ndarray of shape (n,)
    """

    name, level = "tricuspid_leaflets", "neighbours.leaflets_dB"
    place: Floats
    amplitude: Floats

    @classmethod
    def level_dB(cls, config: Config) -> Any:
        """As of the mitral leaflets, if there are chambers, between two of which the valve is."""
        return None if config.realism.neighbours.chambers_dB is None else super().level_dB(config)

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers over the leaflets, as dense as in mitral ones, with amplitudes of a border of the level."""
        random, radius = scene.random(cls.name), TricuspidValve(scene.heart).ring(0).radius
        number = random.poisson(border_density(scene.config) * 8 * _length() * radius**2)
        side, across = np.where(random.random(number) < 0.5, -1.0, 1.0), random.uniform(-1, 1, number)
        place = np.column_stack([side, across, random.random(number)])
        place = place[random.random(number) < np.sqrt(1 - across**2)]
        amplitude = border_amplitude(scene.config, cls.level_dB(scene.config))
        return cls(scene, place, np.full(len(place), amplitude))

    def in_heart(self, frame: int) -> Floats:
        return self._valve.leaflet(frame, *self.place.T)

    def amplitudes(self, frame: int) -> Floats:
        return self.amplitude

    @cached_property
    def _valve(self) -> TricuspidValve:
        return TricuspidValve(self.scene.heart, self.scene.between)


def _length() -> float:
    """Length of a leaflet over the distance between both sides of the annulus."""
    return hypot(TENTING, 0.5) / arc.chord(TURN)
