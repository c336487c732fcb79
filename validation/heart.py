"""The heart that ships, solved on a mesh of any fineness, with all that its equations held at every frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from echotruth.config import Config, Geometry
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats
from echotruth.loop.cycle import read_loop
from echotruth.mechanics import fibres, kinematics
from echotruth.mechanics.fibres import gradients
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver import drive
from echotruth.mechanics.solver.activation import Activation
from echotruth.mechanics.solver.checkpoint import Frame
from echotruth.mechanics.solver.equilibrium import Equilibrium, Past
from echotruth.mechanics.solver.wall import Wall, equilibrium, wall

SHIPPED = (24, 12, 3)
"""Elements around, along and through the wall of the mesh that ships."""


@dataclass(frozen=True)
class Solved:
    """A solved beat.

    Attributes
    ----------
    config : Config
    wall : Wall
    beat : drive.Beat
    pasts : tuple of Past
        The state against which each frame was viscous; of the frame before, or of a part of the way from it.
    es : int
        Frame of end-systole.
    period : float, s
    spread : callable
        Solution of a state to the displacement (n_nodes, 3) of its nodes, m.
    """

    config: Config
    wall: Wall
    beat: drive.Beat
    pasts: tuple[Past, ...]
    es: int
    period: float
    spread: Callable[[Floats], Floats]

    def strain(self) -> tuple[Floats, Floats]:
        """Mean and standard deviation (6,) of the strain of the wall at end-systole, RR, CC, LL, RC, RL, CL."""
        mesh, (xi, weight) = self.wall.mesh, tetrahedron()
        at_ed, at_es = (
            kinematics.deformation_gradient(mesh, self.beat.displacement[frame], xi) for frame in (0, self.es)
        )
        axes = kinematics.carried_axes(fibres.wall_axes(mesh, self.wall.depth, xi), at_ed)
        strains = kinematics.strain(at_es @ np.linalg.inv(at_ed), axes, kinematics.RCL)
        volume = gradients(mesh, xi)[1] * weight
        mean, sd = kinematics.weighted(strains.reshape(1, -1, 6), volume.ravel())
        return mean[0], sd[0]


class _Record:
    """Stands in for the folder of an unfinished beat and keeps what the equations held at every frame."""

    def __init__(self, heart: Equilibrium) -> None:
        self._heart, self.pasts = heart, []

    def frames(self) -> list[Frame]:
        """None: the beat is solved from its start."""
        return []

    def add(self, _: Frame) -> None:
        """Keep what the last frame was solved against."""
        self.pasts.append(self._heart.past)


@cache
def solved(around: int, along: int, through: int) -> Solved:
    """The default heart on a mesh of some elements; solved once in a run."""
    counts = {"circumferential_elements": around, "longitudinal_elements": along, "transmural_elements": through}
    config = Config(geometry=Geometry(**counts))
    cycle, body = read_loop(config.loop), wall(config, left_ventricle(config.geometry))
    heart = equilibrium(config, body)
    record = _Record(heart)
    tissue = body.tissue
    activation = Activation(tissue.tension_scale, tissue.activation_delay, cycle.period / len(cycle.time))
    beat = drive.solve(heart, cycle, activation, progress=record)
    heart.close()
    es = int(np.argmax(cycle.pressure / cycle.volume))
    return Solved(config, body, beat, tuple(record.pasts), es, cycle.period, heart.assembly.spread)
