"""Fibre and sheet directions of a file, mapped to the mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.cut import named_array
from echotruth.mechanics.geometry.frame import HeartFrame
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh
from echotruth.mechanics.geometry.mesh_quality import GeometryError

MAX_ALIGNMENT = 0.999
"""Mean squared cosine of fibres to their common direction above which they are no heart's: 1 for a constant."""


def map_fibres(mesh: Mesh, imported: ImportedMesh, frame: HeartFrame, geometry: Geometry) -> Mesh:
    """Add the directions of the file to the mesh, where the configuration names them.

    Parameters
    ----------
    mesh : Mesh
    imported : ImportedMesh
        The wall as read.
    frame : HeartFrame
        In which the mesh stands.
    geometry : Geometry

    Returns
    -------
    Mesh
        New elements take the directions of the tetrahedron of the file whose centroid is nearest to theirs.
    """
    if geometry.fibre is None:
        return mesh
    fibre = _unit_vectors(imported, geometry.fibre, "geometry.fibre")
    alignment = np.linalg.eigvalsh(fibre.T @ fibre / len(fibre))[-1]
    if alignment > MAX_ALIGNMENT:
        raise GeometryError(
            f"{imported.source}: geometry.fibre = {geometry.fibre!r} has one direction in all of the wall, a "
            "placeholder: leave it out to use the rule of the section fibres"
        )
    nearest = np.arange(len(imported.cells))
    if len(mesh.cells) != len(imported.cells) or geometry.remesh:
        centroid = frame.transform_points(imported.nodes)[imported.cells[:, :4]].mean(axis=1)
        nearest = cKDTree(centroid).query(mesh.nodes[mesh.cells[:, :4]].mean(axis=1))[1]
    fibre = frame.transform_vectors(fibre)[nearest]
    if geometry.sheet is None:
        return replace(mesh, fibre=fibre)
    sheet = frame.transform_vectors(_unit_vectors(imported, geometry.sheet, "geometry.sheet"))[nearest]
    orthogonal = sheet - np.einsum("ci,ci->c", sheet, fibre)[:, None] * fibre
    length = np.linalg.norm(orthogonal, axis=1, keepdims=True)
    if length.min() < 1e-3:
        raise GeometryError(
            f"{imported.source}: geometry.sheet = {geometry.sheet!r} lies along the fibres in "
            f"{np.sum(length < 1e-3)} cells: leave it out"
        )
    return replace(mesh, fibre=fibre, sheet=orthogonal / length)


def _unit_vectors(imported: ImportedMesh, name: str, key: str) -> Floats:
    """Array of vectors over the cells, divided by their lengths, (n_cells, 3)."""
    vectors = named_array(imported.cell_arrays, name, imported.source, key, "cells").astype(float)
    if vectors.shape != (len(imported.cells), 3):
        raise GeometryError(
            f"{imported.source}: {key} = {name!r} is not an array of three components: choose one that is"
        )
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    if not (length > 1e-6).all() or not np.isfinite(vectors).all():
        raise GeometryError(
            f"{imported.source}: {key} = {name!r} is zero in {np.sum(~(length > 1e-6))} cells of the wall: leave it "
            "out to use the rule of the section fibres"
        )
    return vectors / length
