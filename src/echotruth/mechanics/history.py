"""The output arrays of a heart: geometry, fibres, pathology, mechanics and kinematics."""

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.config import Config
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh, shape
from echotruth.mechanics import fibres, kinematics
from echotruth.mechanics.solver.wall import Wall

Arrays = dict[str, NDArray]

MAX_VALUES = 50_000_000
"""Number of strains that are held at a time."""


def collect_outputs(config: Config, wall: Wall, mechanics: Arrays) -> dict[str, Arrays]:
    """Collect the output arrays of a heart from its wall and its motion.

    Parameters
    ----------
    config : Config
        Only the seed and the section fibres are used.
    wall : Wall
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
        If the fibres are to come from the mesh file and it lacks them.
    """
    mesh, depth = wall.mesh, wall.depth
    axes = fibres.wall_axes(mesh, depth, fibres.CENTROID)[:, 0]
    frames = fibres.fibre_frames(mesh, depth, config.fibres, fibres.CENTROID, config.seed)[:, 0]
    displacement = mechanics["displacement"]
    smallest, mean = kinematics.volume_ratios(mesh, displacement)
    gradient = kinematics.deformation_gradient(mesh, displacement)[:, :, 0]
    strain = kinematics.strain_since_ed(gradient, axes)
    return {
        "geometry": {
            "node_position": mesh.nodes,
            "cell_node": mesh.cells,
            **{side: getattr(mesh, side) for side in ("endo", "epi", "base")},
        },
        "fibres": _fibre_arrays(mesh, depth, frames, config.fibres.layers),
        "pathology": dict(vars(wall.tissue)),
        "mechanics": mechanics,
        "kinematics": {
            "strain": strain.astype(np.float32),
            **_wall_strain_statistics(mesh, displacement, depth, config.fibres.layers),
            "volume_ratio_min": smallest,
            "volume_ratio_mean": mean,
        },
    }


def _fibre_arrays(mesh: Mesh, depth: Floats, frames: Floats, layers: int) -> Arrays:
    centroid = shape(fibres.CENTROID)[0] @ mesh.nodes[mesh.cells]
    return {
        "wall_depth": depth,
        "fibre": frames[:, 0],
        "sheet": frames[:, 1],
        "layer": fibres.layer(fibres.interpolate_in_cells(mesh, depth, fibres.CENTROID)[:, 0], layers).astype(np.uint8),
        "segment": segment(centroid, mesh.nodes[mesh.endo, 2].min()),
    }


def _wall_strain_statistics(mesh: Mesh, displacement: Floats, depth: Floats, layers: int) -> Arrays:
    """Statistics over the quadrature points, for a layer may be thinner than a cell and hold no centroid."""
    xi, weight = tetrahedron()
    volume = (fibres.material_gradients(mesh, xi)[1] * weight).ravel()
    axes = fibres.wall_axes(mesh, depth, xi)
    layer = fibres.layer(fibres.interpolate_in_cells(mesh, depth, xi), layers).ravel()
    parts: dict[str, list[Floats]] = {"strain_mean": [], "strain_sd": [], "layer_strain": []}
    # A fine mesh has gigabytes of strain.
    frames = max(1, MAX_VALUES // (volume.size * len(kinematics.RCL_COMPONENTS)))
    for start in range(0, len(displacement), frames):
        part = displacement[start : start + frames]
        strains = kinematics.wall_strain(mesh, part, axes, displacement[0]).reshape(len(part), volume.size, -1)
        mean, sd = kinematics.weighted_mean_sd(strains, volume)
        by_layer = kinematics.layer_strain(strains, volume, layer, layers)
        for name, values in zip(parts, (mean, sd, by_layer), strict=True):
            parts[name].append(values)
    return {name: np.concatenate(values) for name, values in parts.items()}
