"""One beat of one heart: geometry, fibres, mechanics and kinematics."""

from __future__ import annotations

import logging
import pickle
from hashlib import sha256
from pathlib import Path

import numpy as np

from echotruth.config import Config
from echotruth.loop import phases
from echotruth.loop.cycle import Cycle, read_loop
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.history import Arrays, history
from echotruth.mechanics.solver import drive
from echotruth.mechanics.solver.activation import Activation
from echotruth.mechanics.solver.checkpoint import Progress
from echotruth.mechanics.solver.unloaded import unloaded
from echotruth.mechanics.solver.wall import Wall, equilibrium, wall

logger = logging.getLogger("echotruth.mechanics")


def beat(config: Config, scratch: Path | None = None) -> dict[str, Arrays]:
    """Solve one cycle of the heart of a configuration.

    Parameters
    ----------
    config : Config
        Of which the seed and the sections geometry, fibres, pathology, loop and mechanics are used.
    scratch : Path, optional
        Folder in which solved frames are kept until the beat is whole, so that a stopped run goes on there.

    Returns
    -------
    dict of dict of ndarray
        Groups `geometry`, `fibres`, `pathology`, `mechanics` and `kinematics`; the arrays, their
        shapes and units are those of docs/schema.md. Numba's number of threads is the caller's
        to set; the arrays do not depend on it.

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, Diverged
        With one sentence, if there is no such heart, no such loop or no equilibrium.
    """
    cycle = read_loop(config.loop)
    heart = unloaded_wall(config, cycle)
    return history(config, heart, _course(_solved(config, heart, cycle, scratch), cycle))


def unloaded_wall(config: Config, cycle: Cycle) -> Wall:
    """The unloaded wall of a configuration, solved where its geometry is that of end-diastole."""
    mesh = left_ventricle(config.geometry)
    logger.info("%d tetrahedra, %d nodes", len(mesh.cells), len(mesh.nodes))
    if config.geometry.state == "end_diastole":
        stiffness = config.mechanics.material.si().stiffness
        mesh = unloaded(mesh, lambda guess: equilibrium(config, wall(config, guess)), cycle.pressure[0], stiffness)
    return wall(config, mesh)


def _solved(config: Config, heart: Wall, cycle: Cycle, scratch: Path | None) -> drive.Beat:
    tissue = heart.tissue
    activation = Activation(tissue.tension_scale, tissue.activation_delay, cycle.period / len(cycle.time))
    equations = equilibrium(config, heart)
    progress = Progress(scratch / _fingerprint(config, heart, cycle)) if scratch else None
    try:
        return drive.solve(equations, cycle, activation, config.mechanics.material.si().stiffness, progress)
    finally:
        equations.close()


def _fingerprint(config: Config, heart: Wall, cycle: Cycle) -> str:
    """Hash of all that a solution depends on."""
    settings = config.fibres.model_dump(), config.seed, config.mechanics.model_dump()
    return sha256(pickle.dumps((settings, heart, cycle))).hexdigest()[:16]


def _course(solved: drive.Beat, cycle: Cycle) -> Arrays:
    return {
        "time": cycle.time,
        "pressure": solved.pressure,
        "volume": solved.volume,
        "pressure_asked": solved.pressure_asked,
        "volume_asked": solved.volume_asked,
        "active_tension": solved.tension,
        "displacement": solved.displacement,
        "stiffness": np.array(solved.stiffness),
        "es_frame": np.array(phases.es_frame(solved.pressure, solved.volume)),
        "phase": phases.phases(solved.pressure, solved.volume),
        "newton_steps": solved.newton_steps,
        "residual": solved.residual,
    }
