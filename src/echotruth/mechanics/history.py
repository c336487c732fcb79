"""The history of a wall: all that is kept of it and of how it moved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.config import Config, Fibres
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh, shape
from echotruth.mechanics import angles, fibres, kinematics
from echotruth.mechanics.solver.wall import Wall

Arrays = dict[str, NDArray]


def history(config: Config, heart: Wall, mechanics: Arrays) -> dict[str, Arrays]:
    """Arrays of a heart from its wall and its course.

    Parameters
    ----------
    config : Config
        Of which the seed and the section fibres are used.
    heart : Wall
        Unloaded.
    mechanics : dict of ndarray
        The group `mechanics`; its `displacement` (frame, n_nodes, 3), m, is from unloaded.

    Returns
    -------
    dict of dict of ndarray
        Groups `geometry`, `fibres`, `pathology`, `mechanics` and `kinematics`; the arrays, their
        shapes and units are those of docs/schema.md.

    Raises
    ------
    FibreError
        If the fibres are to come with the mesh and do not.
    """
    mesh, depth = heart.mesh, heart.depth
    return {
        "geometry": {
            "node_position": mesh.nodes,
            "cell_node": mesh.cells,
            **{side: getattr(mesh, side) for side in ("endo", "epi", "base")},
        },
        "fibres": _architecture(mesh, depth, config.fibres, config.seed),
        "pathology": dict(vars(heart.tissue)),
        "mechanics": mechanics,
        "kinematics": _kinematics(mesh, mechanics["displacement"], depth, config),
    }


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
    strains = kinematics.wall_strain(mesh, displacement, fibres.wall_axes(mesh, depth, xi))
    strains = strains.reshape(len(displacement), -1, len(kinematics.RCL))
    mean, sd = kinematics.weighted(strains, volume)
    layer = fibres.layer(fibres.at_points(mesh, depth, xi), layers).ravel()
    by_layer = kinematics.layer_strain(strains, volume, layer, layers)
    return {"strain_mean": mean, "strain_sd": sd, "layer_strain": by_layer}
