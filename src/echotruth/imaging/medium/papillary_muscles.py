"""Papillary muscles: two bodies of muscle in the cavity, attached to the free wall and carried by its endocardium.

They are no part of the wall that is solved. In the short axis the anterolateral one is at four o'clock and the
posteromedial one at half past seven, as seen in echoes. In adults they are 19 +- 4 and 22 +- 4 mm long (Anatomical
variations of mitral papillary muscles, Madras Medical College). Width, height and azimuth were chosen by eye.
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
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.medium.body import CavityBody, Scene

AZIMUTHS = (7 * pi / 6, 7 * pi / 4)
"""Of the anterolateral and of the posteromedial muscle, rad."""
HEIGHT, HALF_LENGTH = 0.58, 0.14
"""Depth of the middle below the base, and half the length, over the length of the cavity."""
HALF_WIDTH, EMBEDDED = 0.22, 0.35
"""Half the width over the radius of the endocardium there, and the share of it that the wall covers."""
NEAREST = 8
"""Nodes of the endocardium whose mean motion a muscle has."""


@dataclass(frozen=True, eq=False)
class PapillaryMuscles(CavityBody):
    """Scatterers in the two muscles, each of which moves as the endocardium at its root.

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
        random, heart = scene.random(cls.name), scene.heart
        cavity, parts = Cavity(heart.endo), []
        nodes = cavity.positions(heart.positions(0))
        for muscle, azimuth in enumerate(AZIMUTHS):
            middle, axes, half = _body(heart, azimuth)
            number = random.poisson(scene.config.phantom.si().density * 8 * half.prod())
            ball = random.uniform(-1, 1, (number, 3))
            position = middle + (ball[np.linalg.norm(ball, axis=1) < 1] * half) @ axes
            position = position[locate(nodes, cavity.cells, position).cell >= 0]
            parts.append((position, np.full(len(position), muscle, np.uint8)))
        position, muscles = map(np.concatenate, zip(*parts, strict=True))
        amplitude = 10 ** (cls.level_dB(scene.config) / 20) * random.standard_normal(len(position))
        return cls(scene, position, muscles, amplitude)

    def in_heart(self, frame: int) -> Floats:
        return self.position + self._displacement[frame, self.muscle]

    def amplitudes(self, frame: int) -> Floats:
        return self.amplitude

    @cached_property
    def _displacement(self) -> Floats:
        return np.stack([_displacement(self.scene.heart, azimuth) for azimuth in AZIMUTHS], axis=1)


class PapillaryMuscle:
    """Where one of the muscles is.

    Parameters
    ----------
    heart : Heart
    azimuth : float, rad
        One of `AZIMUTHS`.
    """

    def __init__(self, heart: Heart, azimuth: float) -> None:
        self._body, self._displacement = _body(heart, azimuth), _displacement(heart, azimuth)
        self._cavity = Cavity(heart.endo)
        self._start = self._cavity.positions(heart.positions(0))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates, (3,), m, in the heart frame, that the muscle reaches in any frame."""
        middle, _, half = self._body
        moved = middle + self._displacement
        return moved.min(axis=0) - half.max(), moved.max(axis=0) + half.max()

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, in the heart frame are in the muscle in a frame, (n,)."""
        middle, axes, half = self._body
        at_ed = position - self._displacement[frame]
        inside = np.linalg.norm((at_ed - middle) @ axes.T / half, axis=1) < 1
        inside[inside] = locate(self._start, self._cavity.cells, at_ed[inside]).cell >= 0
        return inside


def _displacement(heart: Heart, azimuth: float) -> Floats:
    """Displacement of a muscle since end-diastole, (frame, 3), m: the mean of the endocardium at its root."""
    endo = np.unique(heart.endo)
    start, moved = heart.positions(0)[endo], (heart.displacement - heart.displacement[0])[:, endo]
    distance = np.linalg.norm(start - _root(heart, azimuth), axis=1)
    return moved[:, np.argsort(distance, kind="stable")[:NEAREST]].mean(axis=1)


def _root(heart: Heart, azimuth: float) -> Floats:
    """Point of the endocardium, (3,), m, at end-diastole, to which the muscle at an azimuth, rad, is attached."""
    nodes = heart.positions(0)
    rim, endo = nodes[Cavity(heart.endo).rim].mean(axis=0), nodes[np.unique(heart.endo)]
    radial = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    height = rim[2] + HEIGHT * (endo[:, 2].min() - rim[2])
    # Of the nodes on that side, the one nearest to the ray from the axis.
    outward = (endo - rim) @ radial
    beside = endo - rim - outward[:, None] * radial
    beside[:, 2] = endo[:, 2] - height
    distance = np.where(outward > 0, np.linalg.norm(beside, axis=1), np.inf)
    return np.array([rim[0], rim[1], height]) + outward[np.argmin(distance)] * radial


def _body(heart: Heart, azimuth: float) -> tuple[Floats, Floats, Floats]:
    """Middle (3,), m, axes (3, 3), rows radial, circumferential, longitudinal, and half axes (3,), m, of a muscle."""
    root, endo = _root(heart, azimuth), heart.endo_at_ed[:, 2]
    radial = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    axes = np.stack([radial, np.cross([0, 0, 1.0], radial), [0, 0, 1.0]])
    width = HALF_WIDTH * float(np.hypot(*root[:2]))
    half = np.array([width, width, HALF_LENGTH * float(np.ptp(endo))])
    return root - (1 - EMBEDDED) * width * radial, axes, half
