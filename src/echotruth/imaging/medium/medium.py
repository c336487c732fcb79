"""The medium: all scatterers in the frames of one view."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.imaging.medium.aortic_valve import AorticCusps
from echotruth.imaging.medium.blood import Blood
from echotruth.imaging.medium.body import Arrays, Body, Echoes, Scene
from echotruth.imaging.medium.borders import Endocardium, Epicardium
from echotruth.imaging.medium.mitral_valve import Leaflets
from echotruth.imaging.medium.papillary_muscles import PapillaryMuscles
from echotruth.imaging.medium.surroundings import Surroundings
from echotruth.imaging.medium.tricuspid_valve import TricuspidLeaflets
from echotruth.imaging.medium.wall import Wall

BODIES: tuple[type[Body], ...] = (
    *(Endocardium, Epicardium, Blood, Surroundings),
    *(Leaflets, AorticCusps, TricuspidLeaflets, PapillaryMuscles),
)
"""What there may be besides the wall, in the order of the scatterers."""


def bodies(config: Config) -> list[type[Body]]:
    """Bodies that a configuration has."""
    return [Wall, *(body for body in BODIES if body.level_dB(config) is not None)]


def seed_medium(scene: Scene, in_beam: Callable[[Floats], NDArray[np.bool_]]) -> Arrays:
    """Seed all scatterers of a view, as arrays that can be stored, omitting scatterers that never enter the beam.

    Parameters
    ----------
    scene : Scene
    in_beam : callable
        As :meth:`echotruth.imaging.rf.full_matrix.FullMatrix.in_beam`.

    Returns
    -------
    dict of ndarray
        Those of each body, as :meth:`echotruth.imaging.medium.body.Body.stored` returns them.
    """
    arrays: Arrays = {}
    for kind in bodies(scene.config):
        body, frames = kind.seed(scene), range(len(scene.heart.displacement))
        arrays |= body.stored(np.logical_or.reduce([in_beam(body.nearest(frame)) for frame in frames]))
    return arrays


class Medium:
    """All scatterers, frame by frame.

    Parameters
    ----------
    scene : Scene
    seeded : dict of ndarray
        As :func:`seed_medium` returns it.

    Attributes
    ----------
    wall : Wall
    """

    def __init__(self, scene: Scene, seeded: Arrays) -> None:
        self.wall = Wall.restored(scene, seeded)
        self._others = [kind.restored(scene, seeded) for kind in bodies(scene.config)[1:]]

    def __call__(self, frame: int) -> Echoes:
        """All scatterers that are present in a frame."""
        parts = [body(frame) for body in (self.wall, *self._others)]
        position, amplitude, exponent = map(np.concatenate, zip(*parts, strict=True))
        return position, amplitude, exponent
