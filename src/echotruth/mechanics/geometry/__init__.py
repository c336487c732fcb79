"""Meshes of the left ventricle: an ellipsoid, the wall in a file, or a tube in its place."""

import numpy as np

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.geometry.ellipsoid import ellipsoid
from echotruth.mechanics.geometry.lattice import tube
from echotruth.mechanics.geometry.mesh_quality import GeometryError

__all__ = ["GeometryError", "epicardial_apex", "left_ventricle"]


def left_ventricle(geometry: Geometry) -> Mesh:
    """Mesh of the left ventricle.

    Parameters
    ----------
    geometry : Geometry

    Returns
    -------
    Mesh
        Wall in the heart frame, in metres: long axis z from apex to base, the base in or about the plane z = 0,
        in the state that `geometry.given_state` names.

    Raises
    ------
    GeometryError
        If the ventricle cannot be meshed, in one sentence with the remedy.
    """
    if geometry.file is None:
        return tube(geometry) if geometry.shape == "tube" else ellipsoid(geometry)
    from echotruth.mechanics.geometry.file import ventricle_from_file

    return ventricle_from_file(geometry)


def epicardial_apex(mesh: Mesh) -> int:
    """Node of the epicardium that is farthest from the base."""
    return int(mesh.epi.ravel()[np.argmin(mesh.nodes[mesh.epi, 2])])
