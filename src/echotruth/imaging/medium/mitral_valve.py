"""The mitral valve: two leaflets hinged at the annulus, the fibrous ring there, and chordae from their edges.

In every plane across the line on which they meet, a leaflet is an arc from the annulus that keeps its length whatever
it does. Shut, the leaflets meet below the annulus and are convex towards the atrium. They open while the cavity fills,
base first, half open they are convex towards the ventricle, and fully open both point into it. The anterior leaflet,
beside the aortic root, spans two thirds of the annulus. Over the distance between both sides of the annulus they meet
at a depth of 0.28, and are 0.73 and 0.46 long. In 748 adults these are 0.29, 0.8 and 0.45: per height of the body,
20 mm/m from front to back, tenting of 5.8 +- 1.7, leaflets of 16 +- 2 and 9 +- 2 (table 4 of PMC10257802). All of it is
in proportion to the rim, which narrows more than that of people, by a third, as the wall that is solved has no fibrous
ring. Other angles, the turn of a leaflet, thickness, unevenness, the annulus and the chordae were chosen by eye.

Leaflets are smooth sheets of collagen between blood and blood, so that they echo as the borders of the wall do: their
scatterers lie on their middle surfaces and have amplitudes of one sign, which add up in phase where a leaflet faces the
probe and not where it is oblique (:mod:`echotruth.imaging.medium.borders`). The surfaces are wavy, the leaflets of
uneven thickness and their edges rough. Annulus and chordae scatter as muscle does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from math import atan2, hypot, pi, radians
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.heart import Heart
from echotruth.imaging.medium import arc
from echotruth.imaging.medium.annulus import Rim, annulus_distance, box_of, hinge, span
from echotruth.imaging.medium.body import CavityBody, Scene
from echotruth.imaging.medium.borders import border_amplitude, border_density
from echotruth.imaging.medium.filling import course, opening
from echotruth.imaging.medium.papillary_muscles import AZIMUTHS, PapillaryMuscle
from echotruth.units import per_mm3

MEETING, TENTING = 2 / 3, 0.28
"""Share of the annulus that the anterior leaflet spans, and depth at which both meet, over the distance between both
sides of the annulus."""
TURN = {1: radians(25), -1: radians(45)}
"""How far the anterior, 1, and the posterior leaflet, -1, turn from annulus to edge when shut, rad."""
OPEN = {1: (radians(105), radians(80)), -1: (radians(95), radians(85))}
"""Angles below the annulus of their base and edge when open, rad."""
THICKNESS = 0.08
"""Mean thickness over the radius of the rim: 2 mm in the human preset."""
WAVES = (((9.0, 2.0), 0.5, 0.012), ((3.0, 7.0), 2.0, 0.015), ((14.0, -8.0), 4.0, 0.006))
"""Of the surfaces: wave numbers along the leaflet, over its length, and across, over the radius of the rim; phase; and
amplitude over the distance between both sides of the annulus."""
RIPPLE = sum(amplitude for *_, amplitude in WAVES)
"""What they cannot exceed."""
UNEVENNESS = (((4.0, 5.0), 1.0, 0.2), ((11.0, -3.0), 3.0, 0.15))
"""Waves of the thickness, alike, with amplitudes over the mean one."""
EDGE = 0.6
"""How much thicker the edge is than the base, over the mean thickness: the rough zone."""
ROUGHNESS, NOTCHES = 0.1, 17.0
"""Share of the length that the edge draws back in places, and their wave number over the radius of the rim."""
ANNULUS, ANNULUS_DB = 0.07, -6.0
"""Radius of the ring over that of the rim, and its mean echo power relative to the level of the leaflets, dB."""
DEEPEST = 1.3
"""Depth below the rim that no leaflet exceeds, over its radius."""
CHORDAE, CHORDAE_SPACING, CHORDAE_DB = 4, 0.5, -14.0
"""Number between a papillary muscle and a leaflet; distance between their scatterers over the wavelength; and their
power over that of one in a leaflet, dB."""


class Part(IntEnum):
    """Parts of the valve; those of a leaflet are also the side of the annulus that it is on."""

    POSTERIOR = -1
    ANNULUS = 0
    ANTERIOR = 1
    CHORDA = 2


LEAFLETS = (Part.ANTERIOR, Part.POSTERIOR)


class MitralValve:
    """Where the valve is.

    Attributes
    ----------
    opening : ndarray of shape (frame,)
        As of :func:`echotruth.imaging.medium.filling.opening`.
    rim : Rim

    Parameters
    ----------
    heart : Heart
    between : sequence of float
        As of :class:`echotruth.imaging.medium.body.Scene`. Between frames the opening is linear.
    """

    def __init__(self, heart: Heart, between: Sequence[float] = ()) -> None:
        self.rim, self.opening = Rim(heart), course(opening, heart, between)

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the valve reaches in any frame."""
        beside = 1 + ANNULUS
        rims = [self.rim(frame) for frame in range(len(self.opening))]
        return box_of(rims, np.array([-beside, -beside, -DEEPEST]), np.array([beside, beside, ANNULUS]))

    def leaflet(self, frame: int, side: Part, commissural: Floats, share: Floats) -> Floats:
        """Points of a leaflet in a frame, (n, 3), in coordinates of the rim.

        They are at commissural coordinates (n,), and at shares (n,) of the length from the annulus.
        """
        angles = self._angles(frame, side)
        profile = _length(side) * arc.points(*angles, share)
        profile += _ripple(commissural, share)[:, None] * arc.normals(*angles, share)
        inward, down = (span(commissural)[:, None] * profile).T
        anterior = hinge(commissural, np.full_like(commissural, side)) - side * inward
        return np.column_stack([anterior, commissural, -down])

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in a leaflet or the annulus in a frame, (n,)."""
        place = self.rim(frame).to_ring(position)
        near = np.flatnonzero((place[:, 2] < ANNULUS) & (np.hypot(place[:, 0], place[:, 1]) < 1 + ANNULUS))
        inside = np.zeros(len(position), bool)
        inside[near] = annulus_distance(place[near]) < ANNULUS
        near = near[np.abs(place[near, 1]) < 1]
        for side in LEAFLETS:
            inside[near] |= self._in_leaflet(frame, side, place[near])
        return inside

    def _in_leaflet(self, frame: int, side: Part, place: Floats) -> NDArray[np.bool_]:
        """Whether coordinates (n, 3) in the rim are in a leaflet in a frame, (n,)."""
        anterior, commissural, up = place.T
        width = np.maximum(span(commissural), 1e-9)
        inward = side * (hinge(commissural, np.full_like(commissural, side)) - anterior)
        profile = np.column_stack([inward, -up]) / (width * _length(side))[:, None]
        share, across = arc.inverse(*self._angles(frame, side), profile)
        inside = (share > 0) & (share < 1) & (np.abs(across) * _length(side) < RIPPLE + THICKNESS / width)
        commissural, share, width = commissural[inside], share[inside], width[inside]
        distance = width * np.abs(across[inside] * _length(side) - _ripple(commissural, share))
        is_thick = distance < thickness(commissural, share) * THICKNESS / 2
        inside[inside] = is_thick & (share < edge(commissural))
        return inside

    def _angles(self, frame: int, side: Part) -> tuple[float, float]:
        """Angles of a leaflet below the annulus at base and edge in a frame, rad: the base opens before the edge."""
        share, first = float(self.opening[frame]), _shut(side)[0] - TURN[side] / 2
        opened = OPEN[side]
        base = first + (opened[0] - first) * share * (2 - share)
        return base, first + TURN[side] + (opened[1] - first - TURN[side]) * share**2


@dataclass(frozen=True, eq=False)
class Leaflets(CavityBody):
    """Scatterers of the valve.

    Attributes
    ----------
    part : ndarray of shape (n,), int8
        A `Part`.
    place : ndarray of shape (n, 3)
        In a leaflet: commissural coordinate over the radius of the rim, share of the length from the annulus, and 0. In
        the annulus: angle, rad, around the middle of the rim, and radial and upward distance from the annulus over the
        radius of the rim. In a chorda: commissural coordinate of its end at a leaflet, share of its length from
        the papillary muscle, and 1 or -1, the side of the leaflet.
    amplitude : ndarray of shape (n,)
        At end-diastole.
    """

    name, level = "leaflets", "neighbours.leaflets_dB"
    part: NDArray[np.int8]
    place: Floats
    amplitude: Floats

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers of leaflets, annulus and chordae.

        Those of the leaflets are uniform over their surfaces. Their amplitudes are in proportion to the thickness, and
        on average those that give a leaflet the echo of a border of the level.
        """
        radius, random = Rim(scene.heart)(0).radius, scene.random
        level = cls.level_dB(scene.config)
        amplitude = border_amplitude(scene.config, level)
        parts = [_drawn_leaflet(scene, side, radius, amplitude) for side in LEAFLETS]
        density = scene.config.phantom.density_per_mm3 * per_mm3
        parts.append(_drawn_annulus(random("annulus"), density * radius**3, 10 ** ((level + ANNULUS_DB) / 20)))
        if scene.config.realism.neighbours.papillary_muscles_dB is not None:
            spacing = CHORDAE_SPACING * border_density(scene.config) ** -0.5 / radius
            parts.append(_drawn_chordae(random("chordae"), spacing, amplitude * 10 ** (CHORDAE_DB / 20)))
        part, place, amplitudes = map(np.concatenate, zip(*parts, strict=True))
        return cls(scene, part, place, amplitudes)

    def in_heart(self, frame: int) -> Floats:
        rim, place = self._valve.rim(frame), np.zeros_like(self.place)
        for side in LEAFLETS:
            of_it = self.part == side
            place[of_it] = self._valve.leaflet(frame, side, *self.place[of_it, :2].T)
        place[self.part == Part.ANNULUS] = _around(*self.place[self.part == Part.ANNULUS].T)
        position = rim.to_heart(place)
        for side in LEAFLETS:
            of_it = (self.part == Part.CHORDA) & (self.place[:, 2] == side)
            position[of_it] = self._chordae(frame, side, *self.place[of_it, :2].T)
        return position

    def amplitudes(self, frame: int) -> Floats:
        """Amplitudes in a frame, (n,): in proportion to the area of the leaflets, which that of the rim sets."""
        return self.amplitude * (self._valve.rim(frame).radius / self._valve.rim(0).radius) ** 2

    def _chordae(self, frame: int, side: Part, commissural: Floats, share: Floats) -> Floats:
        """Points of chordae, (n, 3), m, at shares (n,) of their lengths from papillary muscles to ends at a leaflet."""
        rim = self._valve.rim(frame)
        end = rim.to_heart(self._valve.leaflet(frame, side, commissural, np.full_like(commissural, 1 - ROUGHNESS)))
        # The anterolateral muscle is on the side where the commissural coordinate is positive.
        tips = np.stack([muscle.tip(frame) for muscle in self._muscles])[(commissural < 0).astype(int)]
        return tips + share[:, None] * (end - tips)

    @cached_property
    def _valve(self) -> MitralValve:
        return MitralValve(self.scene.heart, self.scene.between)

    @cached_property
    def _muscles(self) -> list[PapillaryMuscle]:
        return [PapillaryMuscle(self.scene.heart, azimuth) for azimuth in AZIMUTHS]


def edge(commissural: Floats) -> Floats:
    """Share (n,) of the length at which a leaflet ends, at commissural coordinates (n,)."""
    return 1 - ROUGHNESS * (1 + np.sin(NOTCHES * commissural) * np.sin(0.6 * NOTCHES * commissural)) / 2


def thickness(commissural: Floats, share: Floats) -> Floats:
    """Thickness (n,) of a leaflet over the mean one."""
    return 1 - EDGE / 3 + EDGE * share**2 + _waves(UNEVENNESS, commissural, share)


def _shut(side: Part) -> tuple[float, float]:
    """Angle below the annulus, rad, and distance of the edge of a leaflet when shut, over that of both sides."""
    across = MEETING if side == Part.ANTERIOR else 1 - MEETING
    return atan2(TENTING, across), hypot(TENTING, across)


def _length(side: Part) -> float:
    """Length of a leaflet over the distance between both sides of the annulus."""
    return _shut(side)[1] / arc.chord(TURN[side])


def _ripple(commissural: Floats, share: Floats) -> Floats:
    """Distance (n,) of a leaflet from its arc over that of both sides of the annulus: none at annulus and edge."""
    return np.sin(pi * np.clip(share, 0, 1)) * _waves(WAVES, commissural, share)


def _waves(waves: tuple[tuple[tuple[float, float], float, float], ...], commissural: Floats, share: Floats) -> Floats:
    """Sum of waves (n,) on a leaflet."""
    phases = (along * share + across * commissural + phase for (along, across), phase, _ in waves)
    return np.sum([height * np.sin(phase) for phase, (*_, height) in zip(phases, waves, strict=True)], axis=0)


def _around(angle: Floats, radial: Floats, up: Floats) -> Floats:
    """Coordinates (n, 3) in the rim of points beside the annulus, at angles (n,), rad."""
    commissural = np.sin(angle)
    anterior = hinge(commissural, np.where(np.cos(angle) > 0, 1.0, -1.0))
    return np.column_stack([anterior + radial * np.cos(angle), commissural * (1 + radial), up])


Drawn = tuple[NDArray[np.int8], Floats, Floats]
"""Part (n,), place (n, 3) and amplitude (n,) of scatterers."""


def _drawn_leaflet(scene: Scene, side: Part, radius: float, amplitude: float) -> Drawn:
    """Scatterers of a leaflet at a rim of a radius, m, with a mean amplitude."""
    random = scene.random(f"{Leaflets.name} {side.name.lower()}")
    number = random.poisson(border_density(scene.config) * 4 * _length(side) * radius**2)
    commissural, share = random.uniform(-1, 1, number), random.random(number)
    kept = (2 * random.random(number) < span(commissural)) & (share < edge(commissural))
    commissural, share = commissural[kept], share[kept]
    place = np.column_stack([commissural, share, 0 * share])
    return np.full(len(place), side, np.int8), place, amplitude * thickness(commissural, share)


def _drawn_annulus(random: np.random.Generator, density: float, std: float) -> Drawn:
    """Scatterers of the annulus, of a density over the cubed radius of the rim, and the std of their amplitudes."""
    number = random.poisson(density * 2 * pi * (2 * ANNULUS) ** 2)
    angle, (radial, up) = random.uniform(-pi, pi, number), random.uniform(-ANNULUS, ANNULUS, (2, number))
    place = np.column_stack([angle, radial, up])
    place = place[annulus_distance(_around(*place.T)) < ANNULUS]
    return np.full(len(place), Part.ANNULUS, np.int8), place, std * random.standard_normal(len(place))


def _drawn_chordae(random: np.random.Generator, spacing: float, std: float) -> Drawn:
    """Scatterers of the chordae at a spacing over the radius of the rim, and the std of their amplitudes."""
    place = []
    for side in LEAFLETS:
        for commissural in np.concatenate([random.uniform(0.1, 0.8, CHORDAE), random.uniform(-0.8, -0.1, CHORDAE)]):
            number = random.poisson(1 / spacing)
            place.append(np.column_stack([np.full(number, commissural), random.random(number), np.full(number, side)]))
    joined = np.concatenate(place)
    return np.full(len(joined), Part.CHORDA, np.int8), joined, std * random.standard_normal(len(joined))
