"""Arrival times of a wave front: the eikonal equation on straight tetrahedra and triangles.

The time T from the sources obeys sqrt(grad T . M^-1 grad T) = 1, where a small way d takes the time sqrt(d . M d). On a
simplex T is linear, and the wave reaches a vertex from the point of the opposite face from which it comes first (Fu,
Kirby & Whitaker, SIAM J Sci Comput 35 (2013) C473):

    T = min over w of sum_i w_i T_i + |sum_i w_i d_i|,    w_i >= 0,    sum_i w_i = 1,

with d_i the way from the vertex i of the face and |d|^2 = d . M d. The sum is convex, so that its minimum is inside the
face, else on an edge, else in a vertex. Nodes are taken in the order of their times, and again where theirs falls: in
an anisotropic medium the front does not reach them in that order.
"""

from heapq import heappop, heappush

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echotruth.arrays import Floats


def arrival_times(nodes: Floats, simplices: NDArray[np.integer], metric: Floats, start: Floats) -> Floats:
    """Times at which a wave arrives.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    simplices : ndarray of shape (n, 4)
        Vertices of tetrahedra; triangles name their last vertex twice.
    metric : ndarray of shape (n, 3, 3), s^2/m^2
        M of each: n n^T / v^2 summed over the principal directions n with their speeds v.
    start : ndarray of shape (n_nodes,), s
        Times of the nodes from which the wave comes; infinite elsewhere.

    Returns
    -------
    ndarray of shape (n_nodes,), s
        The error falls as the edges; a plane wave is exact.
    """
    simplices = np.ascontiguousarray(simplices, np.int64)
    around = np.argsort(simplices, axis=None, kind="stable") // 4  # simplices around each node in turn
    first = np.searchsorted(np.sort(simplices, axis=None), np.arange(len(nodes) + 1))
    return _arrival_times(nodes, simplices, metric, around, first, np.array(start, float))


@njit(cache=True, error_model="numpy")
def _arrival_times(nodes, simplices, metric, around, first, time):
    heap = [(0.0, 0) for _ in range(0)]
    for node in np.flatnonzero(np.isfinite(time)):
        heappush(heap, (time[node], node))
    product, face = np.empty((3, 3)), np.empty(3)
    while heap:
        when, node = heappop(heap)
        if when > time[node]:
            continue
        for simplex in around[first[node] : first[node + 1]]:
            for corner in range(4):
                reached = simplices[simplex, corner]
                if reached == node:
                    continue
                _face(nodes, simplices[simplex], corner, metric[simplex], time, product, face)
                arrival = _from_face(face, product)
                if arrival < time[reached] * (1 - 1e-12):
                    time[reached] = arrival
                    heappush(heap, (arrival, reached))
    return time


@njit(cache=True, error_model="numpy")
def _face(nodes, simplex, corner, metric, time, product, face):
    """Fill the times of the vertices opposite a corner, (3,), and the products d_i . M d_k of their ways to it."""
    way = np.empty((3, 3))
    for i in range(3):
        vertex = simplex[(corner + 1 + i) % 4]
        face[i] = time[vertex]
        for x in range(3):
            way[i, x] = nodes[simplex[corner], x] - nodes[vertex, x]
    for i in range(3):
        for k in range(3):
            total = 0.0
            for x in range(3):
                for y in range(3):
                    total += way[i, x] * metric[x, y] * way[k, y]
            product[i, k] = total


@njit(cache=True, error_model="numpy")
def _from_face(time, product):
    """Earliest arrival from a triangle, its edges and its vertices; from a vertex without a time there is none."""
    inside = _from_inside(time, product)
    if inside < np.inf:
        return inside
    earliest = np.inf
    for i in range(3):
        earliest = min(earliest, time[i] + np.sqrt(product[i, i]), _from_edge(time, product, i, (i + 1) % 3))
    return earliest


@njit(cache=True, error_model="numpy")
def _from_inside(time, product):
    """Arrival from a point within the triangle; infinite if it comes first from none there.

    With the last vertex as origin, the edges e_i as a basis of Gram matrix G, b_i = e_i . M d_3 and tau the differences
    of the times, the height h above the face has h^2 = d_3 . M d_3 - b . G^-1 b. The minimum is at
    w = G^-1 b - s G^-1 tau, s = h / sqrt(1 - tau . G^-1 tau), and is T_3 + tau . G^-1 b + h sqrt(1 - tau . G^-1 tau).
    """
    if not np.isfinite(time[0] + time[1] + time[2]):
        return np.inf
    last = product[2, 2]
    g00 = last - 2 * product[0, 2] + product[0, 0]
    g11 = last - 2 * product[1, 2] + product[1, 1]
    g01 = last - product[0, 2] - product[1, 2] + product[0, 1]
    determinant = g00 * g11 - g01 * g01
    if determinant <= 1e-12 * g00 * g11:
        return np.inf
    b0, b1, tau0, tau1 = last - product[0, 2], last - product[1, 2], time[0] - time[2], time[1] - time[2]
    foot0, foot1 = (g11 * b0 - g01 * b1) / determinant, (g00 * b1 - g01 * b0) / determinant
    slope0, slope1 = (g11 * tau0 - g01 * tau1) / determinant, (g00 * tau1 - g01 * tau0) / determinant
    slowness = 1 - tau0 * slope0 - tau1 * slope1
    if slowness <= 0:
        return np.inf
    height = last - b0 * foot0 - b1 * foot1
    if height <= 1e-12 * (g00 + g11):  # a triangle, whose vertex lies in the face
        return np.inf
    s = np.sqrt(height / slowness)
    w0, w1 = foot0 - s * slope0, foot1 - s * slope1
    if w0 < 0 or w1 < 0 or w0 + w1 > 1:
        return np.inf
    return time[2] + tau0 * foot0 + tau1 * foot1 + np.sqrt(height * slowness)


@njit(cache=True, error_model="numpy")
def _from_edge(time, product, i, k):
    """Arrival from a point between two vertices; infinite if it comes first from none there."""
    length = product[i, i] - 2 * product[i, k] + product[k, k]
    if not (np.isfinite(time[i] + time[k]) and length > 0):
        return np.inf
    tau, foot = time[i] - time[k], (product[k, k] - product[i, k]) / length
    slowness = 1 - tau * tau / length
    if slowness <= 0:
        return np.inf
    height = max(product[k, k] - foot * foot * length, 0.0)
    weight = foot - tau / length * np.sqrt(height / slowness)
    return time[k] + tau * foot + np.sqrt(height * slowness) if 0 <= weight <= 1 else np.inf
