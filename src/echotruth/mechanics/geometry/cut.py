"""The wall cut out of a file: the cells kept, what the cut left ragged mended, and the rest refused."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from echotruth.config.geometry import Labels
from echotruth.fem.tetrahedra import Floats, Integers
from echotruth.mechanics.geometry.boundary import boundary, crowded_faces, edges_of, neighbours, pieces
from echotruth.mechanics.geometry.imported_mesh import Body
from echotruth.mechanics.geometry.mesh_quality import GeometryError

logger = logging.getLogger("echotruth.mechanics")

SPLINTERS = 0.01
"""Share of the cells that may hang off the rest after a cut and is then left out."""


def wall_of(body: Body, keep: Labels | None) -> Body:
    """The tetrahedra that are the wall, in one sound piece.

    Parameters
    ----------
    body : Body
        With tetrahedra.
    keep : Labels or None
        Cells to keep.

    Raises
    ------
    GeometryError
        If they are folded, in several parts, or hang together by less than a face.
    """
    chosen = marked(body, keep, "geometry.keep") if keep else np.ones(len(body.cells), dtype=bool)
    if not chosen.any():
        raise GeometryError(f"{body.source}: geometry.keep leaves no cell: choose others of its values")
    body = _oriented(body)
    _check_folds(body)
    if not chosen.all():
        chosen = _mended(body, chosen)
    body = kept(body, chosen)
    _check_one_piece(body)
    return body


def marked(body: Body, labels: Labels, key: str) -> NDArray[np.bool_]:
    """Which tetrahedra have one of the values, bool of shape (n_cells,)."""
    values = array_of(body.cell_arrays, labels.array, body.source, f"{key}.array", "cells")
    return np.isin(values, numbers(labels.values, body, f"{key}.values"))


def array_of(arrays: dict[str, NDArray], name: str, source: str, key: str, what: str) -> NDArray:
    """An array by its name; `key` is the configuration's that asks for it, `what` it is an array over."""
    if name not in arrays:
        there = f"its arrays over {what} are {', '.join(sorted(arrays))}" if arrays else f"it has no array over {what}"
        raise GeometryError(f"{source}: {key} = {name!r} is not there: {there}")
    return np.asarray(arrays[name])


def numbers(values: list[int | str], body: Body, key: str) -> list[int]:
    """Values, where names stand for physical groups."""
    for value in values:
        if isinstance(value, str) and value not in body.names:
            there = f"its groups are {', '.join(body.names)}" if body.names else "it names no groups: give numbers"
            raise GeometryError(f"{body.source}: {key} = {value!r} is no physical group of the file: {there}")
    return [body.names[value] if isinstance(value, str) else value for value in values]


def kept(body: Body, chosen: NDArray[np.bool_]) -> Body:
    """Some of the tetrahedra, with the nodes that they use."""
    cells = body.cells[chosen]
    used = np.unique(cells)
    new = np.full(len(body.nodes), -1, dtype=np.int32)
    new[used] = np.arange(len(used))
    whole = (new[body.triangles] >= 0).all(axis=1)
    return replace(
        body,
        nodes=body.nodes[used],
        cells=new[cells],
        triangles=new[body.triangles[whole]],
        cell_arrays={name: values[chosen] for name, values in body.cell_arrays.items()},
        triangle_arrays={name: values[whole] for name, values in body.triangle_arrays.items()},
        node_arrays={name: values[used] for name, values in body.node_arrays.items()},
    )


def _oriented(body: Body) -> Body:
    """Vertices in right-handed order: which of the two a file uses says nothing about its shape."""
    cells = body.cells.copy()
    left = volumes(body.nodes, cells) < 0
    swapped = [0, 2, 1, 3] if cells.shape[1] == 4 else [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
    cells[left] = cells[left][:, swapped]
    return replace(body, cells=cells)


def volumes(nodes: Floats, cells: Integers) -> Floats:
    """Signed volumes of straight tetrahedra, shape (n_cells,), m^3."""
    a, b, c, d = (nodes[cells[:, i]] for i in range(4))
    return np.einsum("ci,ci->c", np.cross(b - a, c - a), d - a) / 6


def _check_folds(body: Body) -> None:
    crowded = crowded_faces(body.cells)
    if crowded:
        raise GeometryError(
            f"{body.source}: {crowded} faces belong to more than two tetrahedra: leave out cells that are there twice"
        )
    pairs, faces = neighbours(body.cells)
    # Seen from two right-handed cells on either side, a face is passed round in opposite directions.
    first, second = faces[:, 0], faces[:, 1]
    start = np.argmax(second == first[:, :1], axis=1)
    following = second[np.arange(len(second)), (start + 1) % 3]
    folded = np.count_nonzero(following == first[:, 1])
    if folded:
        raise GeometryError(
            f"{body.source}: {len(np.unique(pairs[following == first[:, 1]]))} tetrahedra are inverted, they overlap "
            "their neighbours: mesh the wall anew"
        )


def _mended(body: Body, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Without the teeth and splinters that cutting along cells leaves, as far as they touch the cut."""
    pairs, _ = neighbours(body.cells)
    total, asked = int(chosen.sum()), chosen
    touched = np.zeros(len(body.nodes), dtype=bool)
    touched[body.cells[_beyond(pairs, chosen), :4]] = True
    for _ in range(20):
        cells = np.flatnonzero(chosen)
        loose = cells[_teeth(body.cells[cells]) | _hinges(body.cells[cells])]
        loose = loose[touched[body.cells[loose, :4]].any(axis=1)]
        inside = pairs[chosen[pairs].all(axis=1)]
        piece = pieces(len(chosen), inside)
        splinters = chosen & (piece != np.argmax(np.bincount(piece[chosen])))
        if splinters.sum() > SPLINTERS * total:
            splinters[:] = False
        if not len(loose) and not splinters.any():
            break
        chosen = chosen & ~splinters
        chosen[loose] = False
        touched[body.cells[loose, :4]] = True
    logger.info("%s: %d of %d cells left out as teeth of the cut", body.source, int((asked & ~chosen).sum()), total)
    return chosen


def _beyond(pairs: Integers, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Chosen cells that had a neighbour that is not."""
    cut = pairs[chosen[pairs[:, 0]] != chosen[pairs[:, 1]]]
    found = np.zeros(len(chosen), dtype=bool)
    found[cut] = True
    return found & chosen


def _teeth(cells: Integers) -> NDArray[np.bool_]:
    """Cells that hang on one face only."""
    return np.bincount(boundary(cells)[1], minlength=len(cells)) >= 3


def _hinges(cells: Integers) -> NDArray[np.bool_]:
    """Cells on the boundary at edges where it touches itself."""
    facets, owner = boundary(cells)
    _, number, count = edges_of(facets)
    found = np.zeros(len(cells), dtype=bool)
    found[np.repeat(owner, 3)[count[number] > 2]] = True
    return found


def _check_one_piece(body: Body) -> None:
    piece = pieces(len(body.cells), neighbours(body.cells)[0])
    if piece.max() > 0:
        sizes = ", ".join(map(str, np.bincount(piece)[:5]))
        raise GeometryError(
            f"{body.source}: the wall is in {piece.max() + 1} parts (of {sizes} tetrahedra): choose one with "
            "geometry.keep, or join them in the file"
        )
    _, _, count = edges_of(boundary(body.cells)[0])
    if (count > 2).any():
        raise GeometryError(
            f"{body.source}: the wall touches itself along {np.count_nonzero(count > 2)} edges (non-manifold): leave "
            "out cells that hang by an edge, or mesh the wall anew"
        )
