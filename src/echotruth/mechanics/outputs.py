"""The output arrays of a heart: geometry, fibres, pathology, mechanics and kinematics."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.config import Config
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh, shape
from echotruth.heart import in_right_wall
from echotruth.mechanics import fibres, kinematics
from echotruth.mechanics.solver.wall import Wall

Arrays = dict[str, NDArray]

LEVELS = 5
"""Levels of the wall from base to apex."""
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
    smallest, mean, rms_change = kinematics.volume_ratios(mesh, displacement)
    gradient = kinematics.deformation_gradient(mesh, displacement)[:, :, 0]
    strain = kinematics.strain_since_ed(gradient, axes)
    return {
        "geometry": {
            "node_position": mesh.nodes,
            "cell_node": mesh.cells,
            **{side: getattr(mesh, side) for side in ("endo", "epi", "base")},
            **({"right_endo": mesh.right_endo} if len(mesh.right_endo) else {}),
        },
        "fibres": _fibre_arrays(mesh, depth, frames, config.fibres.layers),
        "pathology": {name: values for name, values in vars(wall.tissue).items() if name != "taut_stiffness"},
        "mechanics": mechanics,
        "kinematics": {
            "strain": strain.astype(np.float32),
            **_wall_strain_statistics(config, wall, displacement),
            "volume_ratio_min": smallest,
            "volume_ratio_mean": mean,
            "volume_change_rms": rms_change,
        },
    }


def _fibre_arrays(mesh: Mesh, depth: Floats, frames: Floats, layers: int) -> Arrays:
    centroid = shape(fibres.CENTROID)[0] @ mesh.nodes[mesh.cells]
    return {
        "wall_depth": depth,
        "fibre": frames[:, 0],
        "sheet": frames[:, 1],
        "layer": fibres.layer(fibres.interpolate_in_cells(mesh, depth, fibres.CENTROID)[:, 0], layers).astype(np.uint8),
        "segment": segment(centroid, mesh.nodes[mesh.endo, 2].min()) * ~in_right_wall(depth, mesh.cells),
    }


class WallPoints(NamedTuple):
    """Quadrature points of a wall, one after the other, and what is known of them at end-diastole.

    Attributes
    ----------
    volume : ndarray of shape (n_points,), m^3
        Unloaded; 0 in the free wall of a right ventricle, so that means are those of the left one.
    axes : ndarray of shape (n_cells, n_points of a cell, 3, 3)
        Rows R, C, L of the wall at ED.
    fibre : ndarray of shape (n_points, 3)
        Direction of the fibres at ED; components along R, C, L.
    layer, level : ndarray of shape (n_points,)
        1 at the endocardium, and at the base.
    """

    volume: Floats
    axes: Floats
    fibre: Floats
    layer: NDArray[np.integer]
    level: NDArray[np.integer]


def _wall_points(config: Config, wall: Wall, at_ed: Floats) -> WallPoints:
    """The quadrature points; a layer may be thinner than a cell and hold no centroid."""
    mesh, depth, (xi, weight) = wall.mesh, wall.depth, tetrahedron()
    gradient = kinematics.deformation_gradient(mesh, at_ed, xi)
    axes = kinematics.deformed_wall_axes(fibres.wall_axes(mesh, depth, xi), gradient)
    frames = fibres.fibre_frames(mesh, depth, config.fibres, xi, config.seed)
    fibre = kinematics.deformed_fibre_frames(frames, gradient)[..., 0, :]
    return WallPoints(
        volume=(fibres.material_gradients(mesh, xi)[1] * weight * ~in_right_wall(depth, mesh.cells)[:, None]).ravel(),
        axes=axes,
        fibre=np.einsum("...ij,...j->...i", axes, fibre).reshape(-1, 3),
        layer=fibres.layer(fibres.interpolate_in_cells(mesh, depth, xi), config.fibres.layers).ravel(),
        level=level(fibres.interpolate_in_cells(mesh, mesh.nodes[:, 2], xi), mesh).ravel(),
    )


def level(z: Floats, mesh: Mesh) -> NDArray[np.integer]:
    """Number of the level, 1 at the base and `LEVELS` at the apex, at heights z (m) of any shape in the unloaded wall.

    The levels share the height from the highest node to the lowest evenly.
    """
    top, bottom = mesh.nodes[:, 2].max(), mesh.nodes[:, 2].min()
    return np.clip((LEVELS * (top - z) / (top - bottom)).astype(int) + 1, 1, LEVELS)


def _wall_strain_statistics(config: Config, wall: Wall, displacement: Floats) -> Arrays:
    points = _wall_points(config, wall, displacement[0])
    volume, layers = points.volume, config.fibres.layers
    parts: list[Arrays] = []
    # A fine mesh has gigabytes of strain.
    frames = max(1, MAX_VALUES // (volume.size * len(kinematics.RCL_COMPONENTS)))
    for start in range(0, len(displacement), frames):
        part = displacement[start : start + frames]
        strains = kinematics.wall_strain(wall.mesh, part, points.axes, displacement[0])
        strains = strains.reshape(len(part), volume.size, -1)
        along = kinematics.strain_along(strains, points.fibre)[..., None]
        mean, sd = kinematics.weighted_mean_sd(strains, volume)
        fibre_mean, fibre_sd = kinematics.weighted_mean_sd(along, volume)
        parts.append(
            {
                "strain_mean": mean,
                "strain_sd": sd,
                "layer_strain": kinematics.group_means(strains, volume, points.layer, layers),
                "level_strain": kinematics.group_means(strains, volume, points.level, LEVELS),
                "fibre_strain_mean": fibre_mean[:, 0],
                "fibre_strain_sd": fibre_sd[:, 0],
                "layer_fibre_strain": kinematics.group_means(along, volume, points.layer, layers)[..., 0],
                "level_fibre_strain": kinematics.group_means(along, volume, points.level, LEVELS)[..., 0],
            }
        )
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
