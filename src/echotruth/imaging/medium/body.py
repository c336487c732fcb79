"""A body: scatterers of one kind, which are seeded once, stored, and carried from frame to frame.

A new body is a dataclass that inherits from `Body`, and has a place in `BODIES` of :mod:`.medium`. Its fields are the
arrays that are stored of it, each with an entry for every scatterer; the group `phantom` has them as `NAME_FIELD`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config, Phantom
from echotruth.config.realism import Tissue
from echotruth.fem.location import locate
from echotruth.heart import Heart
from echotruth.imaging.medium.random_process import Random, ar1
from echotruth.imaging.view import Plane
from echotruth.units import ms

Arrays = dict[str, NDArray[Any]]
Echoes = tuple[Floats, Floats, Floats]
"""Positions in the image (n, 3), m, amplitudes (n,), and exponents (n,), powers of the frequency that they follow."""


@dataclass(frozen=True)
class Scene:
    """A heart before a probe.

    Attributes
    ----------
    config : Config
    heart : Heart
    plane : Plane
    random : Random
        Makes a generator of random numbers for each purpose.
    time : ndarray of shape (frame,), s
    between : tuple of float
        Frames of the heart that come after those of the cycle, as fractional numbers of these.
    """

    config: Config
    heart: Heart
    plane: Plane
    random: Random
    time: Floats
    between: tuple[float, ...] = ()

    def fading(self, amplitude: Floats, name: str) -> Callable[[int], Floats]:
        """Amplitudes (n,) of a body by frame: constant, or decorrelating."""
        time_ms = self.config.realism.decorrelation.time_ms
        return (lambda _: amplitude) if time_ms is None else ar1(amplitude, self.time, time_ms * ms, name, self.random)


@dataclass(frozen=True, eq=False)
class Body(ABC):
    """Scatterers of one kind.

    Attributes
    ----------
    name : str
        Of its arrays, and of its random numbers.
    level : str
        Key in `realism` of its echo power relative to muscle, dB; null for no such body.
    scene : Scene
    """

    name: ClassVar[str]
    level: ClassVar[str]
    scene: Scene

    @classmethod
    def level_dB(cls, config: Config) -> Any:
        """Its level in a configuration, dB, or None."""
        return attrgetter(cls.level)(config.realism)

    @classmethod
    @abstractmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw its scatterers."""

    @abstractmethod
    def positions(self, frame: int) -> Floats:
        """Positions of all its scatterers in the image in a frame, (n, 3), m."""

    @abstractmethod
    def __call__(self, frame: int) -> Echoes:
        """Those of its scatterers that are present in a frame."""

    def nearest(self, frame: int) -> Floats:
        """Positions (n, 3), m, as near to the imaging plane as they may be: those never in the beam are not stored."""
        return self.positions(frame)

    def stored(self, kept: NDArray[np.bool_]) -> Arrays:
        """Arrays that can be stored, of the scatterers that are kept (n,)."""
        return {f"{self.name}_{field.name}": getattr(self, field.name)[kept] for field in fields(self)[1:]}

    @classmethod
    def restored(cls, scene: Scene, stored: Arrays) -> Self:
        """Make it again from what :meth:`stored` returned, among other arrays."""
        return cls(scene, *(stored[f"{cls.name}_{field.name}"] for field in fields(cls)[1:]))


@dataclass(frozen=True, eq=False)
class CavityBody(Body):
    """A body of tissue in the cavity, whose scatterers are hidden while the wall is where they are."""

    @abstractmethod
    def in_heart(self, frame: int) -> Floats:
        """Positions in a frame, (n, 3), m, in the heart frame."""

    @abstractmethod
    def amplitudes(self, frame: int) -> Floats:
        """Amplitudes in a frame, (n,)."""

    def positions(self, frame: int) -> Floats:
        return self.scene.plane.to_image(self.in_heart(frame))

    def __call__(self, frame: int) -> Echoes:
        scene, position = self.scene, self.in_heart(frame)
        present = locate(scene.heart.positions(frame), scene.heart.cells, position).cell < 0
        amplitude = self.amplitudes(frame)[present]
        return echoes(scene.config.phantom, scene.plane.to_image(position[present]), amplitude)


def echoes(tissue: Phantom | Tissue, position: Floats, amplitude: Floats) -> Echoes:
    """Scatterers (n,) with the exponent of their tissue."""
    return position, amplitude, np.full(len(amplitude), tissue.scattering_exponent)
