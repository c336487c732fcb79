"""Lengths and thickness of the wall where planes cut it, as echocardiography measures them.

A surface of triangles is cut where a value at its vertices, such as the distance from a plane, changes sign. Of each
point of the cut the edge and the place on it are kept, so that it can be followed as tissue. The global longitudinal
strain here is that of the heart in 3-D; that of one image, tracked and true, is in
:mod:`echotruth.evaluation.contours`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import Integers, straight_triangles

LONG_AXIS_PLANES = 6
"""Planes through the long axis, at equal angles, over which the global longitudinal strain is averaged."""
MID_WALL = 0.5
"""Wall depth of the line whose length gives the global longitudinal strain."""
MID_SLICE = 0.5
"""Position of the short-axis plane of the wall thickness: 0 at the base plane, 1 at the endocardial apex, at ED."""

_TETRAHEDRA = np.array(
    [(0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3), (4, 6, 7, 8), (4, 5, 6, 8), (6, 7, 8, 9), (5, 6, 8, 9)]
)
"""Linear tetrahedra of a quadratic one: its corners, and the octahedron between them about its diagonal 6-8."""


class Cut(NamedTuple):
    """Points on edges of a mesh.

    Attributes
    ----------
    start, end : ndarray of int of any shape
        Indices of the points at the ends of the edge.
    share : ndarray of that shape
        Place on the edge: 0 at its start, 1 at its end.
    """

    start: NDArray[np.integer]
    end: NDArray[np.integer]
    share: Floats

    def values(self, of_points: Floats) -> Floats:
        """Values at the cut, of shape (..., n), by the values (n_points, n)."""
        share = self.share[..., None]
        return (1 - share) * of_points[self.start] + share * of_points[self.end]


def global_longitudinal_strain(depth: Floats, cells: Integers, ed: Floats, es: Floats) -> float:
    """Global longitudinal strain: relative change of the length of the mid-wall line in long-axis planes.

    The line is that of the tissue which lies in the plane at end-diastole, from the base to the apex and back. Voigt et
    al., Eur Heart J Cardiovasc Imaging 16 (2015) 1, doi 10.1093/ehjci/jeu184: GLS = (L(ES) - L(ED)) / L(ED). The planes
    contain the long axis of the heart frame, and lengths are measured in space, so that a rigid motion is no strain.

    Parameters
    ----------
    depth : ndarray of shape (n_nodes,)
        Wall depth.
    cells : ndarray of shape (n_cells, 10)
    ed, es : ndarray of shape (n_nodes, 3), m
        Positions of the nodes.

    Returns
    -------
    float
        Mean over the planes; negative where the heart shortens.
    """
    points = depth_surface(depth, cells, MID_WALL).values(np.concatenate([ed, es], axis=1)).reshape(-1, 6)
    surface = np.arange(len(points)).reshape(-1, 3)
    strains = []
    for angle in np.pi * np.arange(LONG_AXIS_PLANES) / LONG_AXIS_PLANES:
        offset = points[:, :2] @ [-np.sin(angle), np.cos(angle)]
        segments = cut_triangles(surface, offset).values(points).reshape(-1, 2, 2, 3)
        length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=-1).sum(axis=0)
        strains.append(length[1] / length[0] - 1)
    return float(np.mean(strains))


def wall_thickness(endo: Integers, epi: Integers, positions: Floats, height: float) -> float:
    """Mean wall thickness in a short-axis plane.

    It is the difference of the radii of circles with the areas inside epicardium and endocardium, as recommendations
    for echocardiography define it: Schiller et al., J Am Soc Echocardiogr 2 (1989) 358; Lang et al. 28 (2015) 1, doi
    10.1016/j.echo.2014.10.003.

    Parameters
    ----------
    endo, epi : ndarray of shape (n_facets, 6)
        Nodes of the triangles.
    positions : ndarray of shape (n_nodes, 3), m
    height : float, m
        z of the plane.

    Returns
    -------
    float, m
        Not a number if the plane does not cut the wall.
    """
    outer, inner = (np.sqrt(_area_inside(facets, positions, height) / np.pi) for facets in (epi, endo))
    return float(outer - inner)


def depth_surface(depth: Floats, cells: Integers, level: float) -> Cut:
    """Triangles (n_triangles, 3) of the surface at a wall depth, as points on edges (marching tetrahedra).

    Parameters
    ----------
    depth : ndarray of shape (n_nodes,)
    cells : ndarray of shape (n_cells, 10)
    level : float
        Above 0 and below 1: at the borders of the wall no value changes sign.
    """
    corners = cells[:, _TETRAHEDRA].reshape(-1, 4)
    value = depth - level
    inside = value[corners] >= 0
    order = np.argsort(inside, axis=1, kind="stable")  # what lies outside comes first
    corners, count = np.take_along_axis(corners, order, axis=1), inside.sum(axis=1)
    edges = {  # number of corners inside -> edges that cross the surface, in threes
        1: ((3, 0), (3, 1), (3, 2)),
        2: ((0, 2), (0, 3), (1, 3), (0, 2), (1, 3), (1, 2)),
        3: ((0, 1), (0, 2), (0, 3)),
    }
    found = [corners[count == n][:, edge].reshape(-1, 3, 2) for n, edge in edges.items()]
    return _crossings(np.concatenate(found), value)


def cut_triangles(triangles: NDArray[np.integer], value: Floats) -> Cut:
    """Segments (n_segments, 2) where triangles (n, 3) are cut by a change of sign of a value at their points."""
    inside = value[triangles] >= 0
    count = inside.sum(axis=1)
    mixed = (count == 1) | (count == 2)
    corners, inside, count = triangles[mixed], inside[mixed], count[mixed]
    single = np.argmax(inside == (count == 1)[:, None], axis=1)  # the corner that is alone on its side
    turned = np.take_along_axis(corners, (single[:, None] + np.arange(3)) % 3, axis=1)
    return _crossings(turned[:, [(0, 1), (0, 2)]], value)


def _crossings(edges: NDArray[np.integer], value: Floats) -> Cut:
    """Points on edges (..., 2) where a value at the points is zero."""
    start, end = edges[..., 0], edges[..., 1]
    return Cut(start, end, value[start] / (value[start] - value[end]))


def _area_inside(facets: Integers, positions: Floats, height: float) -> float:
    """Area, m^2, that a surface encloses in a plane of constant z, of which every ray from the centre meets it once."""
    segments = cut_triangles(straight_triangles(facets), positions[:, 2] - height).values(positions)[..., :2]
    if not len(segments):
        return np.nan
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=-1)
    first, second = np.moveaxis(segments - np.average(segments.mean(axis=1), axis=0, weights=length), 1, 0)
    return float(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum() / 2)
