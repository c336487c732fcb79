"""Valves of the neighbouring chambers: hinged at a ring that follows the base, with leaflets that are arcs alike."""

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any, ClassVar, Self

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.annulus import Ring
from echotruth.imaging.medium.body import CavityBody, Scene
from echotruth.imaging.medium.borders import border_amplitude
from echotruth.imaging.medium.surroundings import SurroundingsMotion

AZIMUTH = np.linspace(0, 2 * pi, 12, endpoint=False)
"""Of the points of the annulus by which its motion is known, rad."""


class ChamberValve:
    """Where the leaflets are.

    Attributes
    ----------
    opening : ndarray of shape (frame,)
        How far the valve is open, 0 to 1.
    shut : float
        Angle between the annulus and the chord of a leaflet when shut, rad.
    turn : float
        How far a leaflet turns from annulus to edge when shut, rad.
    open_ : float
        Angle of an open leaflet to the annulus, rad.

    Parameters
    ----------
    heart : Heart
    annulus : ndarray of shape (12, 3), m
        At end-diastole, at the azimuths `AZIMUTH`.
    neighbour : TissueLabel
        Tissue that follows the base, as the annulus does.
    opening : ndarray of shape (frame,)
    """

    shut: ClassVar[float]
    turn: ClassVar[float]
    open_: ClassVar[float]

    def __init__(self, heart: Heart, annulus: Floats, neighbour: TissueLabel, opening: Floats) -> None:
        self.opening = opening
        # With the base; a decay length has no part in that.
        self._motion = SurroundingsMotion(heart, annulus, 1.0, np.full(len(annulus), neighbour, np.uint8))

    def ring(self, frame: int) -> Ring:
        """The annulus in a frame: its first axis is towards azimuth 0."""
        points = self._motion(frame)
        area = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
        return Ring.of(points, AZIMUTH, area / np.linalg.norm(area))

    @property
    def rings(self) -> list[Ring]:
        """The annulus in every frame."""
        return [self.ring(frame) for frame in range(len(self.opening))]

    def angles(self, frame: int) -> tuple[float, float]:
        """Angles of a leaflet to the annulus at base and edge in a frame, rad."""
        share = float(self.opening[frame])
        first, last = self.shut - self.turn / 2, self.shut + self.turn / 2
        return first + (self.open_ - first) * share, last + (self.open_ - last) * share


@dataclass(frozen=True, eq=False)
class ChamberLeaflets(CavityBody):
    """Scatterers of such a valve; they have the level of the mitral leaflets, if there are chambers."""

    level = "neighbours.leaflets_dB"
    valve: ClassVar[Any]
    place: Floats
    amplitude: Floats

    @classmethod
    def level_dB(cls, config: Config) -> Any:
        return None if config.realism.neighbours.chambers_dB is None else super().level_dB(config)

    @classmethod
    def at(cls, scene: Scene, place: Floats) -> Self:
        """Scatterers at places in the leaflets, with amplitudes of a border of the level."""
        return cls(scene, place, np.full(len(place), border_amplitude(scene.config, cls.level_dB(scene.config))))

    def in_heart(self, frame: int) -> Floats:
        return self._valve.leaflet(frame, *self.place.T)

    def amplitudes(self, frame: int) -> Floats:
        return self.amplitude

    @cached_property
    def _valve(self) -> Any:
        return self.valve(self.scene.heart, self.scene.between)
