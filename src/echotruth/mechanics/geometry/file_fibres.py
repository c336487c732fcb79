"""Fibre and sheet directions that came with a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.cut import array_of
from echotruth.mechanics.geometry.frame import Frame
from echotruth.mechanics.geometry.imported_mesh import Body
from echotruth.mechanics.geometry.mesh_quality import GeometryError

ONE_WAY = 0.999
"""Mean squared cosine of fibres to their common direction above which they are no heart's: 1 for a constant."""


def carried(mesh: Mesh, body: Body, frame: Frame, geometry: Geometry) -> Mesh:
    """The mesh with the directions of the file, where they are asked for.

    Parameters
    ----------
    mesh : Mesh
    body : Body
        The wall as read.
    frame : Frame
        In which the mesh stands.
    geometry : Geometry

    Returns
    -------
    Mesh
        New elements take the directions of the tetrahedron of the file whose centroid is nearest to theirs.
    """
    if geometry.fibre is None:
        return mesh
    fibre = _directions(body, geometry.fibre, "geometry.fibre")
    spread = np.linalg.eigvalsh(fibre.T @ fibre / len(fibre))
    if spread[-1] > ONE_WAY:
        raise GeometryError(
            f"{body.source}: geometry.fibre = {geometry.fibre!r} points one way in all of the wall, a placeholder: "
            "leave it out and the rule of the section fibres holds"
        )
    nearest = np.arange(len(body.cells))
    if len(mesh.cells) != len(body.cells) or geometry.remesh:
        centre = frame.points(body.nodes)[body.cells[:, :4]].mean(axis=1)
        nearest = cKDTree(centre).query(mesh.nodes[mesh.cells[:, :4]].mean(axis=1))[1]
    fibre = frame.directions(fibre)[nearest]
    if geometry.sheet is None:
        return replace(mesh, fibre=fibre)
    sheet = frame.directions(_directions(body, geometry.sheet, "geometry.sheet"))[nearest]
    across = sheet - np.einsum("ci,ci->c", sheet, fibre)[:, None] * fibre
    length = np.linalg.norm(across, axis=1, keepdims=True)
    if length.min() < 1e-3:
        raise GeometryError(
            f"{body.source}: geometry.sheet = {geometry.sheet!r} lies along the fibres in {np.sum(length < 1e-3)} "
            "cells: leave it out"
        )
    return replace(mesh, fibre=fibre, sheet=across / length)


def _directions(body: Body, name: str, key: str) -> Floats:
    """Vectors of length one over the cells, (n_cells, 3)."""
    vectors = array_of(body.cell_arrays, name, body.source, key, "cells").astype(float)
    if vectors.shape != (len(body.cells), 3):
        raise GeometryError(f"{body.source}: {key} = {name!r} is not an array of three components: choose one that is")
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    if not (length > 1e-6).all() or not np.isfinite(vectors).all():
        raise GeometryError(
            f"{body.source}: {key} = {name!r} is nought in {np.sum(~(length > 1e-6))} cells of the wall: leave it out "
            "and the rule of the section fibres holds"
        )
    return vectors / length
