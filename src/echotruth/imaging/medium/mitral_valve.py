"""The mitral valve: two leaflets hinged at the rim of the cavity, open while it fills.

In every plane across the line on which they meet, a leaflet is a strip from the rim. Shut, the two meet below the base
at a third of the radius on the lateral side: the anterior leaflet, on the septal side, is twice as long as the
posterior one, as in adults (e-echocardiography.com, Anatomy of the mitral valve). Open, both point into the cavity. The
angles and the thickness were chosen by eye. There are no chordae.

Leaflets are smooth sheets of collagen between blood and blood, so that they echo as the borders of the wall do: their
scatterers lie on their middle surfaces and have equal amplitudes, which add up in phase where a leaflet faces the probe
and not where it is oblique (:mod:`echotruth.imaging.medium.borders`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.heart import Heart
from echotruth.imaging.medium.anatomy import rim
from echotruth.imaging.medium.body import CavityBody, Scene
from echotruth.imaging.medium.borders import border_amplitude, border_density
from echotruth.imaging.medium.filling import opening, volumes

SHUT, OPEN = pi / 15, 5 * pi / 12
"""Angles of the leaflets below the base, rad."""
MEETING = -1 / 3
"""Where they meet, over half the chord of the rim; the septum is on the positive side."""
THICKNESS = 0.08
"""Thickness over the radius of the rim: 1.7 mm in the human preset."""


class MitralValve:
    """Where the two leaflets are.

    Attributes
    ----------
    opening : ndarray of shape (frame,)
        As of :func:`echotruth.imaging.medium.filling.opening`.

    Parameters
    ----------
    heart : Heart
    between : sequence of float
        As of :class:`echotruth.imaging.medium.body.Scene`. Between frames the opening is linear.
    """

    def __init__(self, heart: Heart, between: Sequence[float] = ()) -> None:
        cycle = len(heart.displacement) - len(between)
        of_frames = opening(volumes(heart)[:cycle])
        of_others = np.interp(np.asarray(between), np.arange(cycle), of_frames, period=cycle)
        self._heart, self.opening = heart, np.append(of_frames, of_others)

    def hinge(self, frame: int) -> tuple[Floats, float, float]:
        """Centre (3,), m, and radius, m, of the rim, and angle of the leaflets below the base, rad, in a frame."""
        centre, radius = rim(self._heart.positions(frame), self._heart.endo)
        return centre, radius, SHUT + (OPEN - SHUT) * float(self.opening[frame])

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the leaflets reach in any frame."""
        hinges = [self.hinge(frame)[:2] for frame in range(len(self.opening))]
        reach = max((radius for _, radius in hinges)) * (1 + THICKNESS - MEETING)
        centres = np.stack([centre for centre, _ in hinges])
        return centres.min(axis=0) - reach, centres.max(axis=0) + reach

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in a leaflet in a frame, (n,)."""
        centre, radius, angle = self.hinge(frame)
        x, along, z = ((position - centre) / radius).T
        inside = np.zeros(len(position), bool)
        chord = np.sqrt(np.maximum(1 - along**2, 0))
        for side in (-1, 1):
            inward = chord - side * x
            length = inward * np.cos(angle) - z * np.sin(angle)
            across = inward * np.sin(angle) + z * np.cos(angle)
            inside |= (length > 0) & (length < _length(side, chord)) & (np.abs(across) < THICKNESS / 2)
        return inside


@dataclass(frozen=True, eq=False)
class Leaflets(CavityBody):
    """Scatterers in the leaflets.

    Attributes
    ----------
    place : ndarray of shape (n, 3)
        Coordinate along the line on which the leaflets meet, over the radius of the rim, -1 to 1; 1 in the anterior and
        -1 in the posterior leaflet; share of the length from the rim.
    amplitude : ndarray of shape (n,)
        At end-diastole.
    """

    name, level = "leaflets", "neighbours.leaflets_dB"
    place: Floats
    amplitude: Floats

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers uniformly over the middle surfaces of the leaflets, as many in an area as on a border.

        Their amplitudes are equal: those of a border of the level.
        """
        random = scene.random(cls.name)
        _, radius = rim(scene.heart.positions(0), scene.heart.endo)
        # Both together are as long as the chord; of the square around the rim, candidates in the circle are kept.
        number = random.poisson(border_density(scene.config) * 4 / np.cos(SHUT) * radius**2)
        along = random.uniform(-1, 1, number)
        side = np.where(random.random(number) < (1 - MEETING) / 2, 1.0, -1.0)
        kept = random.random(number) < np.sqrt(1 - along**2)
        place = np.column_stack([along, side, random.random(number)])[kept]
        return cls(scene, place, np.full(len(place), border_amplitude(scene.config, cls.level_dB(scene.config))))

    def in_heart(self, frame: int) -> Floats:
        centre, radius, angle = self._valve.hinge(frame)
        along, side, share = self.place.T
        chord = np.sqrt(1 - along**2)
        length = _length(side, chord) * share
        x, z = side * (chord - length * np.cos(angle)), -length * np.sin(angle)
        return centre + radius * np.column_stack([x, along, z])

    def amplitudes(self, frame: int) -> Floats:
        """Amplitudes in a frame, (n,): in proportion to the area of the leaflets, which that of the rim sets."""
        return self.amplitude * (self._valve.hinge(frame)[1] / self._valve.hinge(0)[1]) ** 2

    @cached_property
    def _valve(self) -> MitralValve:
        return MitralValve(self.scene.heart, self.scene.between)


def _length(side: Floats | int, chord: Floats) -> Floats:
    """Length of the leaflets over the radius of the rim: shut, they are as long as it takes to meet."""
    return (1 - side * MEETING) * chord / np.cos(SHUT)
