"""Boundary triangles of a tetrahedral mesh, and the adjacency of its cells and triangles."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from echotruth.fem.tetrahedra import EDGES, Floats, Integers

Indices = NDArray[np.intp]

FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
"""Vertices of the faces of a tetrahedron; the normals point out."""

_EDGE_NODE = {frozenset(edge.tolist()): 4 + i for i, edge in enumerate(EDGES)}
_QUADRATIC_FACES = np.array(
    [[*f, *(_EDGE_NODE[frozenset((f[i], f[(i + 1) % 3]))] for i in range(3))] for f in FACES.tolist()]
)
"""Nodes of the faces of a quadratic tetrahedron: vertices, then the middles of edges 01, 12, 20."""


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
    faces, number, count = _numbered_faces(cells)
    outside = count[number] == 1
    return faces[outside], np.repeat(np.arange(len(cells)), 4)[outside].astype(np.int32)


def adjacent_cells(cells: Integers) -> tuple[Integers, Integers]:
    """Pairs of tetrahedra that share a face.

    Parameters
    ----------
    cells : ndarray of shape (n_cells, 4 or 10)

    Returns
    -------
    pairs : ndarray of shape (n_pairs, 2)
    faces : ndarray of shape (n_pairs, 2, 3)
        Vertices of the shared face, in the order in which its normal points out of the first and of the second.
    """
    faces, number, count = _numbered_faces(cells)
    shared = _pairs(number, count)
    return (shared // 4).astype(np.int32), faces[shared, :3]


def count_nonmanifold_faces(cells: Integers) -> int:
    """Number of faces that belong to more than two tetrahedra."""
    return int(np.count_nonzero(_numbered_faces(cells)[2] > 2))


def _numbered_faces(cells: Integers) -> tuple[Integers, Indices, Indices]:
    """All faces cell by cell, the number of each as a set of vertices, and how often each number occurs."""
    faces = cells[:, FACES if cells.shape[1] == 4 else _QUADRATIC_FACES].reshape(4 * len(cells), -1)
    number, count = _unique_rows(np.sort(faces[:, :3], axis=1))
    return faces, number, count


def _unique_rows(rows: Integers) -> tuple[Indices, Indices]:
    """Number of each row, the same for equal rows, and how often each number occurs."""
    # One integer a row sorts ten times faster than rows do.
    base = rows.max(initial=0) + np.int64(1)
    code = rows[:, 0].astype(np.int64)
    for column in rows.T[1:]:
        code = code * base + column
    _, number, count = np.unique(code, return_inverse=True, return_counts=True)
    return number, count


def _pairs(number: Indices, count: Indices) -> Indices:
    """Indices (n_pairs, 2) at which each number that occurs twice stands."""
    order = np.argsort(number, kind="stable")
    return order[count[number[order]] == 2].reshape(-1, 2)


def triangle_edges(triangles: Integers) -> tuple[Integers, Indices, Indices]:
    """Edges of triangles.

    Parameters
    ----------
    triangles : ndarray of shape (n, 3 or 6)

    Returns
    -------
    edges : ndarray of shape (3 n, 2)
        Vertices in rising order; edge k belongs to triangle k // 3.
    number : ndarray of shape (3 n,)
        Number of the edge of each row; rows of one edge share it.
    count : ndarray of shape (n_edges,)
        Number of triangles that share it, by number.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return edges, *_unique_rows(edges)


def adjacent_triangles(triangles: Integers) -> Integers:
    """Pairs of triangles that share an edge, of a surface whose edges have two triangles each: (n_pairs, 2)."""
    _, number, count = triangle_edges(triangles)
    return (_pairs(number, count) // 3).astype(np.int32)


def component_labels(n: int, pairs: Integers) -> Integers:
    """Number of the connected component of each of n items; component 0 has the most.

    Parameters
    ----------
    n : int
    pairs : ndarray of shape (n_pairs, 2)
        Items that are connected.
    """
    graph = csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    rank = np.empty(label.max(initial=-1) + 1, dtype=np.int32)
    rank[np.argsort(-np.bincount(label), kind="stable")] = np.arange(len(rank))
    return rank[label]


def largest_component(selected: np.ndarray, pairs: Integers) -> np.ndarray:
    """Largest connected component of the selected items (bool, shape (n,)), as bool of that shape."""
    if not selected.any():
        return selected
    label = component_labels(len(selected), pairs[selected[pairs].all(axis=1)])
    return selected & (label == np.argmax(np.bincount(label[selected])))


def quadratic_cells(cells: Integers, n_nodes: int) -> tuple[Integers, Integers]:
    """Quadratic tetrahedra of linear ones (n_cells, 4), with a node, from `n_nodes` on, in the middle of each edge.

    Returns the ends of each edge, shape (n_edges, 2), and the cells, shape (n_cells, 10); quadratic ones stay.
    """
    if cells.shape[1] == 10:
        return np.empty((0, 2), np.int32), cells
    ends = np.sort(cells[:, EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    return edges, np.hstack([cells, n_nodes + number.reshape(-1, 6)]).astype(np.int32)


def with_midpoints(positions: Floats, edges: Integers) -> Floats:
    """Positions (..., n, 3) of vertices, then those of the middles of edges (n_edges, 2)."""
    return np.concatenate([positions, positions[..., edges, :].mean(axis=-2)], axis=-2)


def area_vectors(nodes: Floats, triangles: Integers) -> Floats:
    """Area vectors (b - a) x (c - a) / 2 of straight triangles, shape (n, 3), m^2."""
    a, b, c = (nodes[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a) / 2


def unit_vector(vector: Floats) -> Floats:
    """Vector (n,) divided by its length."""
    return vector / np.linalg.norm(vector)
