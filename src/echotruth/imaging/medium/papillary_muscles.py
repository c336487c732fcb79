"""Papillary muscles: two fingers of muscle in the cavity, which rise from its wall towards the mitral valve.

They are no part of the wall that is solved. A muscle is round in cross-section, wide at its root in the wall and
pointed at its tip, which stands free. It lies along a line in the endocardium from the depth of its root to that of
its tip: it moves and turns with this line, is shortened as much, and becomes thicker so that its volume is kept. In
adults muscles are 19 +- 4 and 22 +- 4 mm long (Anatomical variations of mitral papillary muscles, Madras Medical
College) and shorten by 21 +- 9 % (anterolateral) and 17 +- 6 % (posteromedial) from end-diastole to end-systole (Madu
et al., Med Sci Monit 7 (2001) CR1212).

The anterolateral one is at the anterolateral wall, at half past two o'clock in a short axis, and the posteromedial one
at the inferior wall, at six o'clock. So four- and two-chamber view show a finger, and the three-chamber view lies
between both. Azimuths, depths, widths and shape were chosen by eye.
"""

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.location import locate
from echotruth.heart import Heart
from echotruth.imaging.medium.anatomy import sampled
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.medium.body import CavityBody, Scene
from echotruth.units import per_mm3

AZIMUTHS = (0.9 * pi, 1.47 * pi)
"""Of the anterolateral and of the posteromedial muscle, rad."""
ROOT, TIP = 0.64, 0.36
"""Depth of root and tip below the base, over the length of the cavity."""
HALF_WIDTH = 0.28
"""Half the width at the root, over the distance of the endocardium from the axis there."""
AWAY, LEANING = 0.35, 0.75
"""Distance of the middle line from the line in the endocardium at the root, and how much more at the tip, over half
the width: the muscle leans towards the axis of the cavity."""
TAPER = 0.45
"""Power of the distance from the tip that the width follows."""
BELOW = 0.3
"""Length of the rounded end below the root, over the distance from root to tip."""


@dataclass(frozen=True, eq=False)
class PapillaryMuscles(CavityBody):
    """Scatterers in the two muscles.

    Attributes
    ----------
    position : ndarray of shape (n, 3), m
        At end-diastole in the heart frame.
    muscle : ndarray of shape (n,), uint8
        0 for the anterolateral, 1 for the posteromedial one.
    amplitude : ndarray of shape (n,)
    """

    name, level = "papillary_muscles", "neighbours.papillary_muscles_dB"
    position: Floats
    muscle: NDArray[np.uint8]
    amplitude: Floats

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers uniformly over the two muscles in the cavity, as many in a volume as in the wall.

        Their amplitudes are normally distributed; their variance in a volume is that of muscle times the level.
        """
        random, parts = scene.random(cls.name), []
        for number, azimuth in enumerate(AZIMUTHS):
            muscle = PapillaryMuscle(scene.heart, azimuth)
            low, high = muscle.extent
            candidates = random.poisson(scene.config.phantom.density_per_mm3 * per_mm3 * (high - low).prod())
            position = muscle.to_heart(0, random.uniform(low, high, (candidates, 3)))
            position = position[muscle.contains(0, position)]
            parts.append((position, np.full(len(position), number, np.uint8)))
        position, muscles = map(np.concatenate, zip(*parts, strict=True))
        amplitude = 10 ** (cls.level_dB(scene.config) / 20) * random.standard_normal(len(position))
        return cls(scene, position, muscles, amplitude)

    def in_heart(self, frame: int) -> Floats:
        position = np.empty_like(self.position)
        for number, muscle in enumerate(self._muscles):
            of_it = self.muscle == number
            position[of_it] = muscle.to_heart(frame, muscle.to_muscle(0, self.position[of_it]))
        return position

    def amplitudes(self, frame: int) -> Floats:
        return self.amplitude

    @cached_property
    def _muscles(self) -> list["PapillaryMuscle"]:
        return [PapillaryMuscle(self.scene.heart, azimuth) for azimuth in AZIMUTHS]


class PapillaryMuscle:
    """Where one of the muscles is.

    Its coordinates, m, are those of end-diastole: along the line from root to tip, from there towards the axis of the
    cavity, and across both.

    Parameters
    ----------
    heart : Heart
    azimuth : float, rad
        One of `AZIMUTHS`.

    Attributes
    ----------
    stretch : ndarray of shape (frame,)
        Length of the muscle over that at end-diastole.
    """

    def __init__(self, heart: Heart, azimuth: float) -> None:
        frames, endo = range(len(heart.displacement)), np.unique(heart.endo)
        positions = np.stack([heart.positions(frame)[endo] for frame in frames])
        (self._root, width), (top, _) = (_wall_line(heart, azimuth, depth) for depth in (ROOT, TIP))
        along = top - self._root
        length = np.linalg.norm(along, axis=1)
        self._length, self._half_width, self.stretch = float(length[0]), HALF_WIDTH * width, length / length[0]
        self._axes = _axes(along / length[:, None], positions.mean(axis=1) - self._root)
        self._cavity = Cavity(heart.endo)
        self._start = self._cavity.positions(heart.positions(0))

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, of the muscle."""
        width, reach = self._half_width, (1 + AWAY + LEANING) * self._half_width
        return np.array([-BELOW * self._length, -width, -width]), np.array([self._length, reach, width])

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the muscle reaches in any frame."""
        corners = np.array(np.meshgrid(*np.stack(self.extent).T)).reshape(3, -1).T
        reached = np.concatenate([self.to_heart(frame, corners) for frame in range(len(self.stretch))])
        return reached.min(axis=0), reached.max(axis=0)

    def tip(self, frame: int) -> Floats:
        """Position of the tip in the heart frame in a frame, (3,), m."""
        return self.to_heart(frame, np.array([self._length, (AWAY + LEANING) * self._half_width, 0.0]))

    def to_heart(self, frame: int, place: Floats) -> Floats:
        """Positions (n, 3), m, in the heart frame of coordinates (n, 3), m, in a frame."""
        return self._root[frame] + (place * self._scale(frame)) @ self._axes[frame]

    def to_muscle(self, frame: int, position: Floats) -> Floats:
        """Coordinates (n, 3), m, of positions (n, 3), m, in the heart frame in a frame."""
        return (position - self._root[frame]) @ self._axes[frame].T / self._scale(frame)

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in the muscle in a frame, (n,)."""
        place = self.to_muscle(frame, position)
        along = place[:, 0] / self._length
        above = np.clip(1 - np.maximum(along, 0), 0, None) ** TAPER
        below = np.sqrt(np.maximum(1 - (np.minimum(along, 0) / BELOW) ** 2, 0))
        middle = (AWAY + LEANING * np.maximum(along, 0)) * self._half_width
        inside = np.hypot(place[:, 1] - middle, place[:, 2]) < self._half_width * above * below
        at_ed = self.to_heart(0, place[inside])
        inside[inside] = locate(self._start, self._cavity.cells, at_ed).cell >= 0
        return inside

    def _scale(self, frame: int) -> Floats:
        """Stretch along the axes of the muscle, (3,); their product is 1."""
        stretch = self.stretch[frame]
        return np.array([stretch, stretch**-0.5, stretch**-0.5])


def _axes(along: Floats, inwards: Floats) -> Floats:
    """Unit vectors (frame, 3, 3), rows, along unit vectors (frame, 3), most inwards of those across, and the third."""
    inwards = inwards - np.sum(inwards * along, axis=1, keepdims=True) * along
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    return np.stack([along, inwards, np.cross(along, inwards)], axis=1)


def _wall_line(heart: Heart, azimuth: float, depth: float) -> tuple[Floats, float]:
    """Positions (frame, 3), m, of a point of the endocardium, and its distance from the axis at end-diastole, m.

    At end-diastole it is at an azimuth, rad, and a depth below the base over the length of the cavity.
    """
    nodes = heart.positions(0)
    rim, points = nodes[Cavity(heart.endo).rim].mean(axis=0), sampled(nodes, heart.endo)
    radial, height = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]), depth * (points[:, 2].min() - rim[2])
    # Of the points on that side, the one nearest to the ray from the axis.
    outward = (points - rim) @ radial
    beside = points - rim - outward[:, None] * radial - [0, 0, height]
    nearest = int(np.argmin(np.where(outward > 0, np.linalg.norm(beside, axis=1), np.inf)))
    facet, point = divmod(nearest, len(points) // len(heart.endo))
    facets = heart.endo[facet : facet + 1]
    moved = [sampled(heart.positions(frame), facets)[point] for frame in range(len(heart.displacement))]
    return np.stack(moved), float(outward[nearest])
