"""One beat of one heart: geometry, fibres, mechanics and kinematics."""

from __future__ import annotations

import logging
import pickle
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.config import Config, Fibres
from echotruth.mechanics import angles, drive, fibres, kinematics, phases
from echotruth.mechanics.activation import Activation
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.loop import Cycle, read_loop
from echotruth.mechanics.progress import Progress
from echotruth.mechanics.quadrature import tetrahedron
from echotruth.mechanics.unloaded import unloaded
from echotruth.mechanics.wall import Wall, equilibrium, wall
from echotruth.tetrahedra import Floats, Mesh, shape

Arrays = dict[str, NDArray]
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
    mesh, depth = heart.mesh, heart.depth
    solved = _solved(config, heart, cycle, scratch)
    return {
        "geometry": {
            "node_position": mesh.nodes,
            "cell_node": mesh.cells,
            **{side: getattr(mesh, side) for side in ("endo", "epi", "base")},
        },
        "fibres": _architecture(mesh, depth, config.fibres, config.seed),
        "pathology": dict(vars(heart.tissue)),
        "mechanics": _course(solved, cycle),
        "kinematics": _kinematics(mesh, solved.displacement, depth, config),
    }


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


def _architecture(mesh: Mesh, depth: Floats, section: Fibres, seed: int) -> Arrays:
    axes = fibres.wall_axes(mesh, depth, fibres.CENTROID)[:, 0]
    frames = fibres.fibre_frames(mesh, depth, section, fibres.CENTROID, seed)[:, 0]
    helix, transverse, sheet = angles.read(frames, axes)
    centre = shape(fibres.CENTROID)[0] @ mesh.nodes[mesh.cells]
    return {
        "wall_depth": depth,
        "fibre": frames[:, 0],
        "sheet": frames[:, 1],
        "helix_angle": helix,
        "transverse_angle": transverse,
        "sheet_angle": sheet,
        "layer": fibres.layer(fibres.at_points(mesh, depth, fibres.CENTROID)[:, 0], section.layers).astype(np.uint8),
        "segment": segment(centre, mesh.nodes[mesh.endo, 2].min()),
    }


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


def _kinematics(mesh: Mesh, displacement: Floats, depth: Floats, config: Config) -> Arrays:
    axes = fibres.wall_axes(mesh, depth, fibres.CENTROID)[:, 0]
    frames = fibres.fibre_frames(mesh, depth, config.fibres, fibres.CENTROID, config.seed)[:, 0]
    motion = kinematics.motion(mesh, displacement, axes, frames)
    smallest, ratio = kinematics.volume_ratios(mesh, displacement)
    return {
        **{name: values.astype(np.float32) for name, values in motion.items()},
        **_wall_strain(mesh, displacement, depth, config.fibres.layers),
        "volume_ratio_min": smallest,
        "volume_ratio_mean": ratio,
    }


def _wall_strain(mesh: Mesh, displacement: Floats, depth: Floats, layers: int) -> Arrays:
    """Statistics over the quadrature points: a layer may be thinner than a cell and hold no centroid."""
    xi, weight = tetrahedron()
    volume = (fibres.gradients(mesh, xi)[1] * weight).ravel()
    axes = fibres.wall_axes(mesh, depth, xi)
    at_ed = kinematics.deformation_gradient(mesh, displacement[0], xi)
    carried, back = kinematics.carried_axes(axes, at_ed), np.linalg.inv(at_ed)
    strains = np.stack(
        [
            kinematics.strain(kinematics.deformation_gradient(mesh, moved, xi) @ back, carried, kinematics.RCL)
            for moved in displacement
        ]
    ).reshape(len(displacement), -1, len(kinematics.RCL))
    mean, sd = kinematics.weighted(strains, volume)
    layer = fibres.layer(fibres.at_points(mesh, depth, xi), layers).ravel()
    by_layer = kinematics.layer_strain(strains, volume, layer, layers)
    return {"strain_mean": mean, "strain_sd": sd, "layer_strain": by_layer}
