"""The boundary of a mesh of tetrahedra: its triangles, and which of them are neighbours."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from echotruth.fem.tetrahedra import EDGES, Floats, Integers

FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
"""Vertices of the faces of a tetrahedron; the normals point out."""

_EDGE_OF = {frozenset(edge.tolist()): 4 + i for i, edge in enumerate(EDGES)}
_QUADRATIC = np.array([[*f, *(_EDGE_OF[frozenset((f[i], f[(i + 1) % 3]))] for i in range(3))] for f in FACES.tolist()])
"""The same with the middles of edges 01, 12, 20."""


def boundary(cells: Integers) -> tuple[Integers, Integers]:
    """Triangles that belong to one tetrahedron only.

    Parameters
    ----------
    cells : ndarray of shape (n_cells, 4 or 10)

    Returns
    -------
    facets : ndarray of shape (n_facets, 3 or 6)
        Their normals point out of the tetrahedra.
    owner : ndarray of shape (n_facets,)
        Tetrahedron of each.
    """
    faces, number, count = _numbered(cells)
    outside = count[number] == 1
    return faces[outside], np.repeat(np.arange(len(cells)), 4)[outside].astype(np.int32)


def neighbours(cells: Integers) -> tuple[Integers, Integers]:
    """Tetrahedra that share a face, and the two faces as each of them sees it.

    Parameters
    ----------
    cells : ndarray of shape (n_cells, 4 or 10)

    Returns
    -------
    pairs : ndarray of shape (n_pairs, 2)
    faces : ndarray of shape (n_pairs, 2, 3)
        Vertices, in the order in which the normal points out of the first and of the second.
    """
    faces, number, count = _numbered(cells)
    order = np.argsort(number, kind="stable")
    shared = order[count[number[order]] == 2].reshape(-1, 2)
    return (shared // 4).astype(np.int32), faces[shared, :3]


def crowded_faces(cells: Integers) -> int:
    """Number of faces that belong to more than two tetrahedra."""
    return int(np.count_nonzero(_numbered(cells)[2] > 2))


def _numbered(cells: Integers) -> tuple[Integers, Integers, Integers]:
    """All faces cell by cell, the number of each as a set of vertices, and how often each number occurs."""
    faces = cells[:, FACES if cells.shape[1] == 4 else _QUADRATIC].reshape(4 * len(cells), -1)
    number, count = _unique(np.sort(faces[:, :3], axis=1))
    return faces, number, count


def _unique(rows: Integers) -> tuple[Integers, Integers]:
    # One integer a row sorts ten times faster than rows do.
    base = rows.max(initial=0) + np.int64(1)
    code = rows[:, 0].astype(np.int64)
    for column in rows.T[1:]:
        code = code * base + column
    _, number, count = np.unique(code, return_inverse=True, return_counts=True)
    return number, count


def edges_of(triangles: Integers) -> tuple[Integers, Integers, Integers]:
    """Edges of triangles.

    Parameters
    ----------
    triangles : ndarray of shape (n, 3 or 6)

    Returns
    -------
    edges : ndarray of shape (3 n, 2)
        Vertices in rising order: edge k is one of triangle k // 3.
    number : ndarray of shape (3 n,)
        The same for the same edge.
    count : ndarray of shape (n_edges,)
        How many triangles share it, by number.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return edges, *_unique(edges)


def beside(triangles: Integers) -> Integers:
    """Pairs of triangles that share an edge, of a surface whose edges have two triangles each: (n_pairs, 2)."""
    _, number, count = edges_of(triangles)
    order = np.argsort(number, kind="stable")
    shared = order[count[number[order]] == 2].reshape(-1, 2)
    return (shared // 3).astype(np.int32)


def pieces(n: int, pairs: Integers) -> Integers:
    """Number of the connected piece that each of n things belongs to; piece 0 has the most.

    Parameters
    ----------
    n : int
    pairs : ndarray of shape (n_pairs, 2)
        Things that hang together.
    """
    graph = csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    rank = np.empty(label.max(initial=-1) + 1, dtype=np.int32)
    rank[np.argsort(-np.bincount(label), kind="stable")] = np.arange(len(rank))
    return rank[label]


def largest(chosen: np.ndarray, pairs: Integers) -> np.ndarray:
    """The largest connected piece of the things chosen (bool, shape (n,)), as bool of that shape."""
    if not chosen.any():
        return chosen
    inside = pairs[chosen[pairs].all(axis=1)]
    label = pieces(len(chosen), inside)
    return chosen & (label == np.argmax(np.bincount(label[chosen])))


def area_vectors(nodes: Floats, triangles: Integers) -> Floats:
    """Normals as long as the area of straight triangles, shape (n, 3), m^2."""
    a, b, c = (nodes[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a) / 2
