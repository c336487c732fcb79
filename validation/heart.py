"""The default heart and the paper's, solved on a mesh of any size, with the frames that viscous forces depend on."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np

from echotruth.config import Config, Geometry
from echotruth.config.loading import load
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats
from echotruth.loop.cycle import heart_cycle, read_loop
from echotruth.mechanics import fibres, kinematics
from echotruth.mechanics.beat import unloaded_wall
from echotruth.mechanics.fibres import material_gradients
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.outputs import Arrays
from echotruth.mechanics.solver.cycle import SolvedCycle, filled_to_end_diastole, solved_cycle, solved_frames
from echotruth.mechanics.solver.wall import Wall, equilibrium, wall

PAPERS = Path(__file__).parents[1] / "config" / "paper.yaml"

COUNTS = {"circumferential_elements", "longitudinal_elements", "transmural_elements"}
DEFAULT_MESH = (24, 12, 3)
"""Elements around, along and through the wall."""


@dataclass(frozen=True)
class SolvedBeat:
    """A solved beat.

    Attributes
    ----------
    config : Config
    wall : Wall
    beat : SolvedCycle
    before : ndarray of shape (n_frames, n_nodes, 3), m
        The displacement relative to which each frame was viscous: that of the frame before, or of a substep from it.
    since : ndarray of shape (n_frames,), s
        Time since then; none at end-diastole.
    es : int
        Frame of end-systole.
    period : float, s
    """

    config: Config
    wall: Wall
    beat: SolvedCycle
    before: Floats
    since: Floats
    es: int
    period: float

    def strain(self) -> tuple[Floats, Floats]:
        """Mean and standard deviation (6,) of the strain of the wall at end-systole, RR, CC, LL, RC, RL, CL."""
        mesh, (xi, weight) = self.wall.mesh, tetrahedron()
        at_ed, at_es = (
            kinematics.deformation_gradient(mesh, self.beat.displacement[frame], xi) for frame in (0, self.es)
        )
        axes = kinematics.deformed_wall_axes(fibres.wall_axes(mesh, self.wall.depth, xi), at_ed)
        strains = kinematics.strain(at_es @ np.linalg.inv(at_ed), axes, kinematics.RCL_COMPONENTS)
        volume = material_gradients(mesh, xi)[1] * weight
        mean, sd = kinematics.weighted_mean_sd(strains.reshape(1, -1, 6), volume.ravel())
        return mean[0], sd[0]


@cache
def solved(around: int, along: int, through: int) -> SolvedBeat:
    """The default heart on a mesh of elements around, along and through the wall; solved once in a run."""
    return solved_heart(Config(geometry=_geometry(around, along, through)))


@cache
def solved_papers(around: int, along: int, through: int) -> SolvedBeat:
    """The paper's heart on such a mesh: its fibres pull along themselves alone, and nothing surrounds it."""
    config, counts = load(PAPERS), _geometry(around, along, through).model_dump(include=COUNTS)
    return solved_heart(config.model_copy(update={"geometry": config.geometry.model_copy(update=counts)}))


def _geometry(around: int, along: int, through: int) -> Geometry:
    return Geometry(circumferential_elements=around, longitudinal_elements=along, transmural_elements=through)


def solved_heart(config: Config) -> SolvedBeat:
    """The heart of a configuration."""
    cycle, unloaded = read_loop(config.loop), wall(config, left_ventricle(config.geometry))
    equations = equilibrium(config, unloaded)
    frames = solved_frames(filled_to_end_diastole(equations, cycle), cycle, unloaded.tissue.tension_scale)
    frames, previous = zip(*((frame, equations.previous) for frame in frames), strict=True)
    beat = solved_cycle(equations, cycle, frames)
    equations.close()
    es = int(np.argmax(cycle.pressure / cycle.volume))
    before = np.array([equations.assembly.displacement(one.state.solution) for one in previous])
    return SolvedBeat(config, unloaded, beat, before, np.array([one.time for one in previous]), es, cycle.period)


def stored_heart(config: Config, arrays: Arrays) -> SolvedBeat:
    """A heart from the arrays of its group `mechanics`, if it is held at its base and no step was halved."""
    cycle = heart_cycle(config)
    beat = SolvedCycle(**{field.name: arrays[field.name] for field in fields(SolvedCycle)})
    before = np.concatenate([beat.displacement[:1], beat.displacement[:-1]])
    since = np.diff(arrays["time"], prepend=arrays["time"][0])
    return SolvedBeat(config, unloaded_wall(config, cycle), beat, before, since, int(arrays["es_frame"]), cycle.period)
