"""Extraction of the wall from the tetrahedra of a file, with a clean cut surface."""

import logging
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from echotruth.config.geometry import CellLabels
from echotruth.fem.tetrahedra import Integers
from echotruth.mechanics.geometry.boundary import (
    adjacent_cells,
    boundary,
    component_labels,
    count_nonmanifold_faces,
    largest_component,
    triangle_edges,
)
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh
from echotruth.mechanics.geometry.mesh_quality import GeometryError, right_handed

logger = logging.getLogger("echotruth.mechanics")

MAX_SPLINTERS = 0.01
"""Largest fraction of the cells that is left out where a cut disconnects it from the rest."""


def extract_wall(mesh: ImportedMesh, wall_cells: CellLabels | None) -> ImportedMesh:
    """The tetrahedra of the wall, as one manifold mesh.

    Parameters
    ----------
    mesh : ImportedMesh
        With tetrahedra.
    wall_cells : CellLabels or None
        Cells to keep; all if None.

    Raises
    ------
    GeometryError
        If they are folded, in several parts, or hang together by less than a face.
    """
    selected = (
        select_cells(mesh, wall_cells, "geometry.wall_cells") if wall_cells else np.ones(len(mesh.cells), dtype=bool)
    )
    if not selected.any():
        raise GeometryError(f"{mesh.source}: geometry.wall_cells leaves no cell: choose others of its values")
    # Files use either order of vertices, which says nothing about the shape.
    mesh = replace(mesh, cells=right_handed(mesh.nodes, mesh.cells))
    _check_folds(mesh)
    if not selected.all():
        selected = _trim_cut(mesh, selected)
    mesh = submesh(mesh, selected)
    _check_manifold(mesh)
    return mesh


def select_cells(mesh: ImportedMesh, labels: CellLabels, key: str) -> NDArray[np.bool_]:
    """Which tetrahedra have one of the values, bool of shape (n_cells,)."""
    values = named_array(mesh.cell_arrays, labels.array, mesh.source, f"{key}.array", "cells")
    return np.isin(values, group_numbers(labels.values, mesh, f"{key}.values"))


def named_array(arrays: dict[str, NDArray], name: str, source: str, key: str, domain: str) -> NDArray:
    """Array over a domain of the file, by the name that a key of the configuration gives."""
    if name not in arrays:
        found = f"its arrays over {domain} are {', '.join(sorted(arrays))}" if arrays else f"it has none over {domain}"
        raise GeometryError(f"{source}: {key} = {name!r} is no array of the file: {found}")
    return np.asarray(arrays[name])


def group_numbers(values: list[int | str], mesh: ImportedMesh, key: str) -> list[int]:
    """Values, with the names of physical groups replaced by their numbers."""
    groups = mesh.physical_groups
    for value in values:
        if isinstance(value, str) and value not in groups:
            found = f"its groups are {', '.join(groups)}" if groups else "it names no groups: give numbers"
            raise GeometryError(f"{mesh.source}: {key} = {value!r} is no physical group of the file: {found}")
    return [groups[value] if isinstance(value, str) else value for value in values]


def submesh(mesh: ImportedMesh, selected: NDArray[np.bool_]) -> ImportedMesh:
    """Some of the tetrahedra, with the nodes and triangles that they use."""
    cells = mesh.cells[selected]
    used = np.unique(cells)
    new = np.full(len(mesh.nodes), -1, dtype=np.int32)
    new[used] = np.arange(len(used))
    inside = (new[mesh.triangles] >= 0).all(axis=1)
    return replace(
        mesh,
        nodes=mesh.nodes[used],
        cells=new[cells],
        triangles=new[mesh.triangles[inside]],
        cell_arrays={name: values[selected] for name, values in mesh.cell_arrays.items()},
        triangle_arrays={name: values[inside] for name, values in mesh.triangle_arrays.items()},
        node_arrays={name: values[used] for name, values in mesh.node_arrays.items()},
    )


def _check_folds(mesh: ImportedMesh) -> None:
    """Refuse tetrahedra that overlap their neighbours."""
    overfull = count_nonmanifold_faces(mesh.cells)
    if overfull:
        raise GeometryError(
            f"{mesh.source}: {overfull} faces belong to more than two tetrahedra: leave out duplicate cells"
        )
    pairs, faces = adjacent_cells(mesh.cells)
    # Two right-handed cells on either side of a face list its vertices in opposite directions.
    first, second = faces[:, 0], faces[:, 1]
    start = np.argmax(second == first[:, :1], axis=1)
    following = second[np.arange(len(second)), (start + 1) % 3]
    folded = following == first[:, 1]
    if folded.any():
        raise GeometryError(
            f"{mesh.source}: {len(np.unique(pairs[folded]))} tetrahedra are inverted, they overlap their neighbours: "
            "mesh the wall again"
        )


def _trim_cut(mesh: ImportedMesh, selected: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Selected cells without the protruding and disconnected ones that cutting along cells leaves at the cut."""
    pairs, _ = adjacent_cells(mesh.cells)
    total, before = int(selected.sum()), selected
    at_cut = np.zeros(len(mesh.nodes), dtype=bool)
    at_cut[mesh.cells[_cells_at_cut(pairs, selected), :4]] = True
    for _ in range(20):
        cells = np.flatnonzero(selected)
        loose = cells[_on_one_face(mesh.cells[cells]) | _at_nonmanifold_edge(mesh.cells[cells])]
        loose = loose[at_cut[mesh.cells[loose, :4]].any(axis=1)]
        splinters = selected & ~largest_component(selected, pairs)
        if splinters.sum() > MAX_SPLINTERS * total:
            splinters[:] = False
        if not len(loose) and not splinters.any():
            break
        selected = selected & ~splinters
        selected[loose] = False
        at_cut[mesh.cells[loose, :4]] = True
    removed = int((before & ~selected).sum())
    logger.info("%s: %d of %d cells that protruded from the cut left out", mesh.source, removed, total)
    return selected


def _cells_at_cut(pairs: Integers, selected: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Selected cells that have a neighbour that is not selected."""
    at_cut = np.zeros(len(selected), dtype=bool)
    at_cut[pairs[selected[pairs[:, 0]] != selected[pairs[:, 1]]]] = True
    return at_cut & selected


def _on_one_face(cells: Integers) -> NDArray[np.bool_]:
    """Cells that are attached by one face only."""
    return np.bincount(boundary(cells)[1], minlength=len(cells)) >= 3


def _at_nonmanifold_edge(cells: Integers) -> NDArray[np.bool_]:
    """Cells on the boundary at edges where it touches itself."""
    facets, owner = boundary(cells)
    _, number, count = triangle_edges(facets)
    at_edge = np.zeros(len(cells), dtype=bool)
    at_edge[np.repeat(owner, 3)[count[number] > 2]] = True
    return at_edge


def _check_manifold(mesh: ImportedMesh) -> None:
    """Refuse a wall in several parts, or one that touches itself along an edge."""
    component = component_labels(len(mesh.cells), adjacent_cells(mesh.cells)[0])
    if component.max() > 0:
        sizes = ", ".join(map(str, np.bincount(component)[:5]))
        raise GeometryError(
            f"{mesh.source}: the wall is in {component.max() + 1} parts (of {sizes} tetrahedra): choose one with "
            "geometry.wall_cells, or join them in the file"
        )
    _, _, count = triangle_edges(boundary(mesh.cells)[0])
    if (count > 2).any():
        raise GeometryError(
            f"{mesh.source}: the wall touches itself along {np.count_nonzero(count > 2)} edges (non-manifold): leave "
            "out cells that hang by an edge, or mesh the wall again"
        )
