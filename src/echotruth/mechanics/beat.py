"""One beat of one heart: geometry, fibres, mechanics and kinematics."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.config import Config, Fibres, Material
from echotruth.mechanics import element, fibres, kinematics, material, solver
from echotruth.mechanics.equilibrium import Equilibrium
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.loop import PressureVolume, read_loop
from echotruth.mechanics.quadrature import tetrahedron
from echotruth.tetrahedra import Floats, Mesh, shape

Arrays = dict[str, NDArray]
logger = logging.getLogger("echotruth.mechanics")


def beat(config: Config) -> dict[str, Arrays]:
    """Solve one cycle of the heart of a configuration.

    Parameters
    ----------
    config : Config
        Of which the sections geometry, fibres, loop and mechanics are used.

    Returns
    -------
    dict of dict of ndarray
        Groups `geometry`, `fibres`, `mechanics` and `kinematics`; the arrays, their shapes and
        units are those of docs/schema.md. Numba's number of threads is the caller's to set;
        the arrays do not depend on it.

    Raises
    ------
    GeometryError, LoopError, Diverged
        With one sentence, if there is no such heart, no such loop or no equilibrium.
    """
    loop = read_loop(config.loop)
    mesh = left_ventricle(config.geometry)
    logger.info("%d tetrahedra, %d nodes", len(mesh.cells), len(mesh.nodes))
    depth = fibres.wall_depth(mesh)
    solved = _solved(config, mesh, depth, loop)
    return {
        "geometry": {
            "node_position": mesh.nodes,
            "cell_node": mesh.cells,
            **{side: getattr(mesh, side) for side in ("endo", "epi", "base")},
        },
        "fibres": _architecture(mesh, depth, config.fibres),
        "mechanics": _course(solved, loop),
        "kinematics": _kinematics(mesh, solved.displacement, depth, config.fibres),
    }


def law(constants: Material) -> element.Law:
    """Constants of the wall, SI, from their section of the configuration."""
    values = constants.si()
    moduli = material.moduli(values.fibre, values.transverse, values.shear)
    return element.Law(moduli, values.length_dependence, values.bulk_modulus)


def _solved(config: Config, mesh: Mesh, depth: Floats, loop: PressureVolume) -> solver.Beat:
    frames = fibres.fibre_frames(mesh, depth, config.fibres, tetrahedron()[0])
    constants = config.mechanics.material
    heart = Equilibrium(mesh, frames, law(constants), config.mechanics.base)
    try:
        return solver.solve(heart, loop, constants.si().stiffness)
    finally:
        heart.close()


def _architecture(mesh: Mesh, depth: Floats, section: Fibres) -> Arrays:
    axes = fibres.wall_axes(mesh, depth, fibres.CENTROID)[:, 0]
    frames = fibres.fibre_frames(mesh, depth, section, fibres.CENTROID)[:, 0]
    centre = shape(fibres.CENTROID)[0] @ mesh.nodes[mesh.cells]
    return {
        "wall_depth": depth,
        "fibre": frames[:, 0],
        "sheet": frames[:, 1],
        "helix_angle": fibres.angle_of(frames[:, 0], axes),
        "layer": fibres.layer(fibres.at_points(mesh, depth, fibres.CENTROID)[:, 0], section.layers).astype(np.uint8),
        "segment": segment(centre, mesh.nodes[mesh.endo, 2].min()),
    }


def _course(solved: solver.Beat, loop: PressureVolume) -> Arrays:
    return {
        "time": loop.time,
        "pressure": solved.pressure,
        "volume": solved.volume,
        "pressure_asked": loop.pressure,
        "volume_asked": solved.volume_asked,
        "active_tension": solved.tension,
        "displacement": solved.displacement,
        "stiffness": np.array(solved.stiffness),
        "es_frame": np.array(loop.es_frame),
        "newton_steps": solved.newton_steps,
    }


def _kinematics(mesh: Mesh, displacement: Floats, depth: Floats, section: Fibres) -> Arrays:
    axes = fibres.wall_axes(mesh, depth, fibres.CENTROID)[:, 0]
    frames = fibres.fibre_frames(mesh, depth, section, fibres.CENTROID)[:, 0]
    motion = kinematics.motion(mesh, displacement, axes, frames)
    smallest, ratio = kinematics.volume_ratios(mesh, displacement)
    return {
        **{name: values.astype(np.float32) for name, values in motion.items()},
        **_wall_strain(mesh, displacement, depth, section.layers),
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
