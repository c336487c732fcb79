"""The left ventricle from a file, as a mesh in the heart frame, with the fibre and sheet directions of the file."""

import logging
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Integers, Mesh
from echotruth.mechanics.geometry import imported_mesh
from echotruth.mechanics.geometry.boundary import (
    adjacent_triangles,
    boundary,
    component_labels,
    quadratic_cells,
    triangle_edges,
    with_midpoints,
)
from echotruth.mechanics.geometry.boundary_labels import NAMES, RIGHT_ENDO, BoundarySurface, label_boundary
from echotruth.mechanics.geometry.cut import extract_wall, named_array, select_cells
from echotruth.mechanics.geometry.frame import HeartFrame, heart_frame
from echotruth.mechanics.geometry.imported_mesh import METRES, ImportedMesh
from echotruth.mechanics.geometry.mesh_quality import GeometryError, check_cavity, check_flat, check_inverted
from echotruth.mechanics.geometry.remeshing import remesh

logger = logging.getLogger("echotruth.mechanics")

MAX_ALIGNMENT = 0.999
"""Mean squared cosine of fibres to their common direction above which they are no heart's: 1 for a constant."""


def ventricle_from_file(geometry: Geometry) -> Mesh:
    """Mesh of the wall in a file.

    Parameters
    ----------
    geometry : Geometry
        With a `file`.

    Returns
    -------
    Mesh

    Raises
    ------
    GeometryError
        Where the file holds no valid left ventricle.
    """
    source = str(geometry.file)
    imported = imported_mesh.read(geometry)
    if len(imported.cells):
        imported = extract_wall(imported, geometry.wall_cells)
        facets, _ = boundary(imported.cells)
    else:
        _check_surface_keys(geometry)
        facets = _closed_surface(imported)
    surface = label_boundary(imported, facets, geometry.surface_labels)
    septum = septum_point(imported, geometry, surface)
    if geometry.remesh:
        mesh, frame = remesh(surface, septum, geometry, source)
        check_inverted(mesh, source, "change the numbers of elements, or cut deeper with geometry.cut_mm")
    else:
        mesh, frame = _keep_cells(imported, surface, septum)
        check_flat(mesh, source, "mesh the wall again with geometry.remesh: true")
        check_inverted(mesh, source, "mesh the wall again with geometry.remesh: true")
    check_cavity(mesh, source, f"set geometry.unit, now {geometry.unit}, to one of {', '.join(METRES)}")
    return map_fibres(mesh, imported, frame, geometry)


def _keep_cells(imported: ImportedMesh, surface: BoundarySurface, septum: Floats | None) -> tuple[Mesh, HeartFrame]:
    """The tetrahedra of the file, made quadratic."""
    frame = heart_frame(surface, septum)
    edges, cells = quadratic_cells(imported.cells, len(imported.nodes))
    mesh = labelled_mesh(with_midpoints(frame.transform_points(imported.nodes), edges), cells, surface)
    base = np.unique(mesh.base)
    if np.ptp(mesh.nodes[base, 2]) < 1e-4 * np.ptp(mesh.nodes[:, 2]):
        mesh.nodes[base, 2] = 0.0
    return mesh, frame


def labelled_mesh(nodes: Floats, cells: Integers, surface: BoundarySurface) -> Mesh:
    """Mesh of quadratic tetrahedra, with the sides that were found on those of the file.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)
    surface : BoundarySurface
        Of the same cells, linear or quadratic.
    """
    # The boundary comes in the same order from quadratic tetrahedra as from linear ones.
    facets, _ = boundary(cells)
    return Mesh(nodes, cells, **{name: facets[surface.labels == number] for number, name in enumerate(NAMES)})


def _check_surface_keys(geometry: Geometry) -> None:
    """Refuse keys that a file without tetrahedra cannot have."""
    for key in ("wall_cells", "septum", "fibre"):
        if getattr(geometry, key) is not None:
            raise GeometryError(
                f"{geometry.file}: geometry.{key} selects tetrahedra, and the file holds a surface: leave it out"
            )
    if not geometry.remesh:
        raise GeometryError(
            f"{geometry.file}: holds a surface, not tetrahedra: set geometry.remesh: true to mesh its wall"
        )


def _closed_surface(imported: ImportedMesh) -> Integers:
    """The triangles of a closed surface, their normals out of the wall."""
    corners = np.sort(imported.triangles, axis=1)
    # Triangles whose corners were merged have shrunk to a line.
    facets = imported.triangles[(corners[:, 1:] != corners[:, :-1]).all(axis=1)]
    if not len(facets):
        raise GeometryError(
            f"{imported.source}: the corners of all its triangles coincide, as far as its largest coordinate tells "
            "them apart: write the file again"
        )
    _, _, count = triangle_edges(facets)
    if (count != 2).any():
        faults = f"{np.sum(count == 1)} open and {np.sum(count > 2)} non-manifold edges"
        raise GeometryError(
            f"{imported.source}: the surface does not close round the wall ({faults} of {len(count)}): close its "
            "holes, the base included"
        )
    parts = component_labels(len(facets), adjacent_triangles(facets)).max() + 1
    if parts > 1:
        raise GeometryError(
            f"{imported.source}: holds {parts} surfaces that do not touch: join endocardium and epicardium by a base"
        )
    return _outward(imported, facets)


def _outward(imported: ImportedMesh, facets: Integers) -> Integers:
    """Triangles in an order of vertices in which neighbours agree and the volume inside is positive."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(imported.nodes, facets)  # type: ignore[arg-type]  # any integers do
    oriented = surface.compute_normals(
        cell_normals=True, point_normals=False, consistent_normals=True, split_vertices=False, auto_orient_normals=False
    )
    facets = oriented.regular_faces.astype(np.int32)
    corner = imported.nodes[facets]
    volume = np.einsum("fi,fi->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    return facets if volume > 0 else facets[:, ::-1].copy()


def septum_point(imported: ImportedMesh, geometry: Geometry, surface: BoundarySurface) -> Floats | None:
    """A point in the septum or right of it, shape (3,), m."""
    if geometry.septum_point is not None:
        return np.array(geometry.septum_point) * METRES[geometry.unit] * geometry.scale
    if geometry.septum is None and geometry.has_right_ventricle:
        return surface.vertices(RIGHT_ENDO).mean(axis=0)
    if geometry.septum is None:
        logger.info("%s: septum not named, x is the file's own x axis", imported.source)
        return None
    cells = imported.cells[select_cells(imported, geometry.septum, "geometry.septum")]
    if not len(cells):
        raise GeometryError(
            f"{imported.source}: geometry.septum.values names no cell of the wall: choose others of its values"
        )
    return imported.nodes[cells[:, :4]].mean(axis=(0, 1))


def map_fibres(mesh: Mesh, imported: ImportedMesh, frame: HeartFrame, geometry: Geometry) -> Mesh:
    """Add the directions of the file to the mesh, where the configuration names them.

    New elements take the directions of the tetrahedron of the file whose centroid is nearest to theirs. `imported` is
    the wall as read, and the mesh stands in `frame`.
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
