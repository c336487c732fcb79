"""What follows from the stored arrays of a heart: deformation and strain of its cells, and angles of its fibres."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.heart import Heart
from echotruth.mechanics import fibres
from echotruth.mechanics.angles import angles_from_frames
from echotruth.mechanics.kinematics import centroid_strains

Arrays = dict[str, NDArray]
"""Arrays by name."""


def centroid_kinematics(heart: Heart, frames: Sequence[int] | None = None) -> Arrays:
    """Deformation and strain at the centroids of the cells.

    Parameters
    ----------
    heart : Heart
        With its groups geometry and fibres.
    frames : sequence of int, optional
        Frames that are asked for. Default: all.

    Returns
    -------
    dict of ndarray
        `deformation_gradient` (frame, cell, 3, 3) from unloaded; `strain_unloaded` and `strain` (frame, cell, 6: RR,
        CC, LL, RC, RL, CL) along the wall axes, from unloaded and from ED; `fibre_strain_unloaded` and `fibre_strain`
        (frame, cell, 6: ff, ss, nn, fs, fn, sn) along the fibre axes.
    """
    mesh, chosen = _mesh(heart), range(len(heart.displacement)) if frames is None else frames
    # Strain is from ED, which is frame 0.
    displacement = heart.displacement[[0, *chosen]]
    found = centroid_strains(mesh, displacement, _wall_axes(heart, mesh), _fibre_frames(heart))
    return {name: values[1:] for name, values in found.items()}


def fibre_angles(heart: Heart) -> Arrays:
    """Angles of the fibres and sheets at the centroids of the cells, as docs/conventions.md defines them.

    Parameters
    ----------
    heart : Heart
        With its groups geometry and fibres.

    Returns
    -------
    dict of ndarray
        `helix_angle`, `transverse_angle` and `sheet_angle` (cell,), rad.
    """
    names = ("helix_angle", "transverse_angle", "sheet_angle")
    return dict(zip(names, angles_from_frames(_fibre_frames(heart), _wall_axes(heart, _mesh(heart))), strict=True))


def _mesh(heart: Heart) -> Mesh:
    geometry = heart.arrays["geometry"]
    return Mesh(*(geometry[name] for name in ("node_position", "cell_node", "endo", "epi", "base")))


def _wall_axes(heart: Heart, mesh: Mesh) -> Floats:
    """Rows R, C, L of the unloaded wall, (cell, 3, 3)."""
    return fibres.wall_axes(mesh, heart.wall_depth, fibres.CENTROID)[:, 0]


def _fibre_frames(heart: Heart) -> Floats:
    """Rows f, s and n = f x s of the unloaded wall, (cell, 3, 3)."""
    fibre, sheet = (heart.arrays["fibres"][name] for name in ("fibre", "sheet"))
    return np.stack([fibre, sheet, np.cross(fibre, sheet)], axis=-2)
