"""The template of quadratic tetrahedra that is mapped to every ventricle.

Points of the wall have three parameters: wall depth w (0 endocardium, 1 epicardium), distance r from the apex to the
base along the wall (0 to 1) and azimuth. The mesh is made in these parameters and mapped to a wall, so that the middles
of edges lie on its curved surfaces, and all walls of one template share their numbering.
"""

from collections.abc import Callable

import numpy as np

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Integers, Mesh
from echotruth.mechanics.geometry.boundary import boundary, quadratic_cells
from echotruth.mechanics.geometry.mesh_quality import right_handed

WallMap = Callable[[Floats, Floats, Floats], Floats]
"""Map of wall depth, distance from the apex and azimuth, each of shape (n_nodes,), to positions (n_nodes, 3), m."""


def mesh_wall(position: WallMap, geometry: Geometry) -> Mesh:
    """Map the template to a wall.

    Parameters
    ----------
    position : callable
        See `WallMap`.
    geometry : Geometry
        Only its numbers of elements are used.

    Returns
    -------
    Mesh
    """
    triangles, disc = _disc_mesh(geometry.circumferential_elements, geometry.longitudinal_elements)
    layers = geometry.transmural_elements
    vertices = np.vstack([np.column_stack([np.full(len(disc), k / layers), disc]) for k in range(layers + 1)])
    cells, parameters = _quadratic(_extrude(triangles, len(disc), layers), vertices)
    nodes = position(*parameters.T)
    cells = right_handed(nodes, cells)
    facets, _ = boundary(cells)
    depth, r, _ = parameters[facets].transpose(2, 0, 1)
    sides = [np.all(side, axis=1) for side in (depth == 0, depth == 1, r == 1)]
    return Mesh(nodes, cells, *(facets[side] for side in sides))


def ellipse_angle(r: Floats, radius: float, length: float, base: float) -> Floats:
    """Angle of an ellipse at a distance from its apex.

    The distance is the mean of the relative arc length and the relative angle, which makes elements small where the
    apex is most curved.

    Parameters
    ----------
    r : ndarray of shape (n,)
        0 at the apex, 1 at the base.
    radius, length : float, m
        Semi-axes across and along the long axis.
    base : float, m
        Height of the base above the equator.

    Returns
    -------
    ndarray of shape (n,), rad
        0 at the apex, pi/2 at the equator.
    """
    angle = np.linspace(0, np.arccos(-base / length), _TABLE_SIZE)
    speed = np.hypot(radius * np.cos(angle), length * np.sin(angle))
    arc = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    return np.interp(r, (arc / arc[-1] + angle / angle[-1]) / 2, angle)


_TABLE_SIZE = 2001
"""Points of the table that turns arc length into angle."""


def _disc_mesh(around: int, rings: int) -> tuple[Integers, Floats]:
    """Triangles of a disc: the apex, then rings of 6, 12, ... up to `around` points."""
    sizes = [1] + [min(6 * k, around) for k in range(1, rings + 1)]
    start = np.cumsum([0, *sizes])
    angle, points, triangles = 0.0, [(0.0, 0.0)], []
    for k in range(1, rings + 1):
        # Rings of equal size are turned by half a step, for triangles with nearly equal sides.
        angle += np.pi / around if sizes[k] == sizes[k - 1] else 0.0
        points += [(k / rings, angle + 2 * np.pi * i / sizes[k]) for i in range(sizes[k])]
        band = _equal_rings(sizes[k]) if sizes[k] == sizes[k - 1] else _growing_rings(k)
        triangles += [[start[k - 1 + ring] + i for ring, i in corners] for corners in band]
    return np.array(triangles, dtype=np.int32), np.array(points)


def _equal_rings(n: int) -> list[list[tuple[int, int]]]:
    """Triangles between two rings of n points, the outer (ring 1) turned by half a step."""
    band = []
    for i in range(n):
        j = (i + 1) % n
        band += [[(0, i), (1, i), (0, j)], [(0, j), (1, i), (1, j)]]
    return band


def _growing_rings(k: int) -> list[list[tuple[int, int]]]:
    """Triangles between rings of 6 (k - 1) and 6 k points: in each of six sectors k point inwards, k - 1 outwards."""
    inner, outer = max(6 * (k - 1), 1), 6 * k
    band = []
    for sector in range(6):
        a, b = sector * (k - 1), sector * k
        for i in range(k):
            band.append([(0, (a + i) % inner), (1, (b + i) % outer), (1, (b + i + 1) % outer)])
        for i in range(k - 1):
            band.append([(0, (a + i) % inner), (1, (b + i + 1) % outer), (0, (a + i + 1) % inner)])
    return band


def _extrude(triangles: Integers, n_points: int, layers: int) -> Integers:
    """Tetrahedra of the prisms over the triangles.

    The diagonal of each quadrilateral starts at its smallest vertex, so that neighbours agree (Dompierre et al., How to
    subdivide pyramids, prisms and hexahedra, 1999).
    """
    order = np.array([np.roll(t, -int(np.argmin(t))) for t in triangles])
    prisms = np.vstack([np.hstack([order, order + n_points]) + k * n_points for k in range(layers)])
    flip = prisms[:, 1] < prisms[:, 2]
    low = np.where(flip[:, None], prisms[:, [0, 1, 2, 5]], prisms[:, [0, 1, 2, 4]])
    middle = np.where(flip[:, None], prisms[:, [0, 1, 5, 4]], prisms[:, [0, 4, 2, 5]])
    return np.vstack([low, middle, prisms[:, [0, 4, 5, 3]]]).astype(np.int32)


def _quadratic(tetrahedra: Integers, vertices: Floats) -> tuple[Integers, Floats]:
    """Cells (n_cells, 10) and parameters (n_nodes, 3) with a node in the middle of every edge, in parameters."""
    edges, cells = quadratic_cells(tetrahedra, len(vertices))
    a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
    turn = (b[:, 2] - a[:, 2] + np.pi) % (2 * np.pi) - np.pi
    azimuth = a[:, 2] + turn / 2
    # The apex has no azimuth of its own; it takes that of the other end.
    azimuth = np.where(a[:, 1] == 0, b[:, 2], np.where(b[:, 1] == 0, a[:, 2], azimuth))
    middle = np.column_stack([(a[:, 0] + b[:, 0]) / 2, (a[:, 1] + b[:, 1]) / 2, azimuth])
    return cells, np.vstack([vertices, middle])
