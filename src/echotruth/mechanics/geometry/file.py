"""The left ventricle in a file, brought into the heart frame."""

from __future__ import annotations

import logging

import numpy as np

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import EDGES, Floats, Integers, Mesh
from echotruth.mechanics.geometry import imported_mesh as reading
from echotruth.mechanics.geometry.boundary import beside, boundary, edges_of, pieces
from echotruth.mechanics.geometry.boundary_labels import NAMES, Skin, with_sides
from echotruth.mechanics.geometry.cut import marked, wall_of
from echotruth.mechanics.geometry.file_fibres import carried
from echotruth.mechanics.geometry.frame import Frame, frame_of
from echotruth.mechanics.geometry.imported_mesh import METRES, Body
from echotruth.mechanics.geometry.mesh_quality import GeometryError, check_cavity, check_flat, check_turned
from echotruth.mechanics.geometry.remeshing import refilled

logger = logging.getLogger("echotruth.mechanics")


def heart_of(geometry: Geometry) -> Mesh:
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
        Where the file holds no sound left ventricle.
    """
    source = str(geometry.file)
    body = reading.read(geometry)
    if len(body.cells):
        body = wall_of(body, geometry.keep)
        facets, _ = boundary(body.cells)
    else:
        _refuse_surface(geometry)
        facets = _closed(body)
    skin = with_sides(body, facets, geometry.sides)
    septum = _septum(body, geometry)
    if geometry.remesh:
        mesh, frame = refilled(skin, septum, geometry, source)
        check_turned(mesh, source, "change the numbers of elements, or cut deeper with geometry.cut_mm")
    else:
        mesh, frame = _as_it_is(body, skin, septum)
        check_flat(mesh, source, "mesh the wall anew with geometry.remesh: true")
        check_turned(mesh, source, "mesh the wall anew with geometry.remesh: true")
    check_cavity(mesh, source, f"set geometry.unit, now {geometry.unit}, to one of {', '.join(METRES)}")
    return carried(mesh, body, frame, geometry)


def _as_it_is(body: Body, skin: Skin, septum: Floats | None) -> tuple[Mesh, Frame]:
    """The tetrahedra of the file, made quadratic."""
    frame = frame_of(skin, septum)
    nodes, cells = quadratic(frame.points(body.nodes), body.cells)
    # The boundary comes in the same order from quadratic tetrahedra as from linear ones.
    facets, _ = boundary(cells)
    sides = {name: facets[skin.side == number] for number, name in enumerate(NAMES)}
    rim = np.unique(sides["base"])
    if np.ptp(nodes[rim, 2]) < 1e-4 * np.ptp(nodes[:, 2]):
        nodes[rim, 2] = 0.0
    return Mesh(nodes, cells, **sides), frame


def quadratic(nodes: Floats, cells: Integers) -> tuple[Floats, Integers]:
    """Straight middles added to the edges of linear tetrahedra; quadratic ones stay.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 4 or 10)

    Returns
    -------
    nodes : ndarray of shape (n_more_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)
    """
    if cells.shape[1] == 10:
        return nodes, cells
    ends = np.sort(cells[:, EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    middle = nodes[edges].mean(axis=1)
    return np.vstack([nodes, middle]), np.hstack([cells, len(nodes) + number.reshape(-1, 6)]).astype(np.int32)


def _refuse_surface(geometry: Geometry) -> None:
    for key in ("keep", "septum", "fibre"):
        if getattr(geometry, key) is not None:
            raise GeometryError(
                f"{geometry.file}: geometry.{key} chooses among tetrahedra, and a surface has none: leave it out"
            )
    if not geometry.remesh:
        raise GeometryError(
            f"{geometry.file}: holds a surface, not tetrahedra: set geometry.remesh: true to mesh its wall"
        )


def _closed(body: Body) -> Integers:
    """The triangles of a closed surface, their normals out of the wall."""
    corners = np.sort(body.triangles, axis=1)
    # Triangles whose corners were merged have shrunk to a line.
    facets = body.triangles[(corners[:, 1:] != corners[:, :-1]).all(axis=1)]
    _, _, count = edges_of(facets)
    if (count != 2).any():
        kinds = f"{np.sum(count == 1)} open and {np.sum(count > 2)} crowded edges"
        raise GeometryError(
            f"{body.source}: the surface does not close round the wall ({kinds} of {len(count)}): close its "
            "holes, the base included"
        )
    parts = pieces(len(facets), beside(facets)).max() + 1
    if parts > 1:
        raise GeometryError(
            f"{body.source}: holds {parts} surfaces that do not touch: join endocardium and epicardium by a base"
        )
    return _outward(body, facets)


def _outward(body: Body, facets: Integers) -> Integers:
    """Triangles turned so that neighbours agree and the volume inside is positive."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(body.nodes, facets)
    turned = surface.compute_normals(
        cell_normals=True, point_normals=False, consistent_normals=True, split_vertices=False, auto_orient_normals=False
    )
    facets = turned.regular_faces.astype(np.int32)
    corner = body.nodes[facets]
    inside = np.einsum("fi,fi->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    return facets if inside > 0 else facets[:, ::-1].copy()


def _septum(body: Body, geometry: Geometry) -> Floats | None:
    """A place in the septum, shape (3,), m."""
    if geometry.septum_point is not None:
        return np.array(geometry.septum_point) * METRES[geometry.unit] * geometry.scale
    if geometry.septum is None:
        logger.info("%s: septum not named, x is the file's own x axis", body.source)
        return None
    cells = body.cells[marked(body, geometry.septum, "geometry.septum")]
    if not len(cells):
        raise GeometryError(
            f"{body.source}: geometry.septum.values names no cell of the wall: choose others of its values"
        )
    return body.nodes[cells[:, :4]].mean(axis=(0, 1))
