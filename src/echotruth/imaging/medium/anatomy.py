"""Anatomy: which tissue lies where around the left ventricle, in every frame.

The heart that is solved is a left ventricle alone. What lies around it in life is placed by its epicardium and its base
and in proportion to it, so that it suits a mouse and a human:

- the right ventricle, a crescent on the septal side (+x): with u the azimuth over 60 degrees and v the height below the
  base over 0.85 of that of the epicardium, its cavity is W (1 - u^2) (1 - v^2) wide;
- the atria, domes above the base: the left on the rim of the cavity, the right between it and the right free wall;
- the lung, behind the free wall as the probe sees it;
- the chest wall, between the start of the tissue and the heart.

Lengths are in outer radii R of the left ventricle. In adults, with R of 33 mm, the mid diameter of the right ventricle
is 27 +- 4 mm, its length 71 +- 6 mm, its wall 3 +- 1 mm, and its fractional area change 49 +- 7 % with a lower limit of
35 % (Lang et al., J Am Soc Echocardiogr 28 (2015) 1). The other lengths were chosen by eye.
"""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import shape
from echotruth.heart import Heart
from echotruth.imaging.view import Plane
from echotruth.mechanics.geometry.boundary import triangle_edges

SEPTUM_HALF_ANGLE = pi / 3
"""Azimuth of the insertions of the right ventricle, rad: the septum is two of six AHA segments."""
RIGHT_WIDTH, RIGHT_LENGTH, RIGHT_WALL, RIGHT_SHORTENING = 0.75, 0.85, 0.1, 0.4
"""Greatest width of the right ventricle and thickness of its wall, in R; its length over the height of the epicardium;
and the share of its width that it loses by end-systole."""
ATRIAL_HEIGHT, ATRIAL_WALL = 1.35, 0.08
"""Height of the atria above the base and thickness of their walls, in R."""
LUNG_FADING_DB = 25.0
"""Fall of the echo of lung over R."""
CHEST_WALL_SHARE = 0.8
"""Depth of the chest wall over that of the heart, both from the start of the tissue."""
STRATA = ((0.0, 0.0), (0.1, -14.0), (0.3, -2.0), (0.36, -10.0), (0.62, 0.0), (0.68, -12.0), (0.92, -1.0))
"""Layers of the chest wall: depth at which each begins, over that of the chest wall, and level relative to the
brightest, dB; skin, fat, fascia, muscle, fascia, muscle, pleura. By eye."""
UNDULATION = ((2.3, 0.045, 0.4), (0.9, 0.025, 2.1), (0.41, 0.012, 5.0))
"""Waves of the layers of the chest wall: length and amplitude over its depth, and phase, rad; by eye."""
SUBDIVISIONS = 6
"""Parts of the edge of a facet between points at which the epicardium is sampled."""


class Neighbour(IntEnum):
    """Tissues around the wall; 0 is connective tissue, or none."""

    CONNECTIVE = 0
    RIGHT_VENTRICLE = 1
    RIGHT_FREE_WALL = 2
    ATRIUM = 3
    ATRIAL_WALL = 4
    LUNG = 5
    CHEST_WALL = 6


CAVITIES = (Neighbour.RIGHT_VENTRICLE, Neighbour.ATRIUM)
"""Neighbours that are blood."""
WALLS = (Neighbour.RIGHT_FREE_WALL, Neighbour.ATRIAL_WALL)
"""Neighbours that are muscle."""


@dataclass(frozen=True)
class Place:
    """Where positions lie with regard to the left ventricle.

    Attributes
    ----------
    distance : ndarray of shape (n,), m
        From the epicardium.
    outward : ndarray of shape (n, 3)
        Unit vectors from the nearest point of the epicardium.
    gap, wall : ndarray of shape (n,), m
        Width of the right ventricle, and thickness of its wall, at the nearest point of the epicardium.
    height : ndarray of shape (n,), m
        Above the base; negative below.
    """

    distance: Floats
    outward: Floats
    gap: Floats
    wall: Floats
    height: Floats


class Anatomy:
    """What lies around the left ventricle in a frame.

    Attributes
    ----------
    base : ndarray of shape (3,), m
        Centre of the rim of the cavity.
    inner_radius : float, m
        Radius of that rim.
    radius : float, m
        R, the outer radius of the left ventricle at end-diastole.
    roof : float, m
        Height of the roof of the atria, which does not move.

    Parameters
    ----------
    heart : Heart
        With the facets of its epicardium, in `arrays`.
    frame : int, optional
    emptied : float, optional
        Share of the stroke volume that is ejected in the frame (:func:`echotruth.imaging.medium.filling.emptied`).
    """

    def __init__(self, heart: Heart, frame: int = 0, emptied: float = 0.0) -> None:
        self._facets = heart.arrays["geometry"]["epi"]
        self._nodes, self._start = heart.positions(frame), heart.positions(0)
        self._shortening = RIGHT_SHORTENING * emptied
        self.base, self.inner_radius = rim(self._nodes, heart.endo)
        top, outer_radius = rim(self._start, self._facets)
        self.radius = float(_radius(self._start[self._facets.ravel()], top).max())
        self.roof = rim(self._start, heart.endo)[0][2] + ATRIAL_HEIGHT * self.radius
        self._septal_radius = outer_radius + RIGHT_WIDTH * self.radius * (1 - self._shortening)

    @cached_property
    def _epicardium(self):
        from scipy.spatial import cKDTree

        return cKDTree(sampled(self._nodes, self._facets))

    def place(self, position: Floats) -> Place:
        """Place of positions (n, 3), m, in the heart frame."""
        distance, index = self._epicardium.query(position)
        nearest = self._epicardium.data[index]
        apex = self._epicardium.data[:, 2].min()
        azimuth = np.arctan2(*(nearest - self.base)[:, 1::-1].T) / SEPTUM_HALF_ANGLE
        below = (self.base[2] - nearest[:, 2]) / (RIGHT_LENGTH * (self.base[2] - apex))
        width = np.maximum(1 - azimuth**2, 0) * np.clip(1 - np.maximum(below, 0) ** 2, 0, None)
        return Place(
            distance,
            (position - nearest) / np.maximum(distance, 1e-12)[:, None],
            RIGHT_WIDTH * self.radius * (1 - self._shortening) * width,
            RIGHT_WALL * self.radius * np.minimum(1, 4 * width),
            position[:, 2] - self.base[2],
        )

    def chambers(self, position: Floats, place: Place) -> NDArray[np.uint8]:
        """Tissue (n,) of positions (n, 3), m, outside the left ventricle: right ventricle, atria or none."""
        tissue = np.full(len(position), Neighbour.CONNECTIVE, np.uint8)
        below, outside = place.height < 0, place.distance - place.gap
        tissue[below & (outside < place.wall) & (place.wall > 0)] = Neighbour.RIGHT_FREE_WALL
        tissue[below & (outside < 0)] = Neighbour.RIGHT_VENTRICLE
        thickness, above = ATRIAL_WALL * self.radius, place.height >= 0
        tissue[above & self._in_atrium(position, thickness)] = Neighbour.ATRIAL_WALL
        tissue[above & self._in_atrium(position, 0.0)] = Neighbour.ATRIUM
        return tissue

    def atrial_share(self, place: Place) -> Floats:
        """Share (n,) of the motion of the base that tissue above it has: it falls from the base to the roof."""
        return np.clip(1 - place.height / (self.roof - self.base[2]), 0, 1)

    def _in_atrium(self, position: Floats, thickness: float) -> NDArray[np.bool_]:
        """Whether positions (n, 3), m, are in one of the atria, or in its wall of a thickness, m."""
        x, y, z = (position - self.base).T
        height = self.roof - self.base[2] + thickness
        left = np.hypot(x, y) / (self.inner_radius + thickness)
        near = self.inner_radius + ATRIAL_WALL * self.radius
        middle, half = (self._septal_radius + near) / 2, (self._septal_radius - near) / 2 + thickness
        right = np.hypot((x - middle) / half, y / (self.radius + thickness))
        return np.hypot(np.minimum(left, right), z / height) < 1


def chest_wall_depth(heart: Heart, plane: Plane, start: float) -> float:
    """Depth to which the chest wall reaches, m, if the tissue begins at a range, m."""
    epicardium = plane.to_image(sampled(heart.positions(0), heart.arrays["geometry"]["epi"]))
    return start + CHEST_WALL_SHARE * max(0.0, float(np.hypot(*epicardium[:, :2].T).min()) - start)


def strata_dB(share: Floats, along: Floats) -> Floats:
    """Level of the chest wall relative to its brightest layers, dB, at shares (n,) of its depth.

    The layers undulate along the array, at distances (n,) from its middle over the depth of the chest wall.
    """
    begins, level = np.array(STRATA).T
    for length, amplitude, phase in UNDULATION:
        share = share + amplitude * np.sin(2 * pi * along / length + phase)
    return level[np.searchsorted(begins, np.clip(share, 0, 1), "right") - 1]


def sampled(nodes: Floats, facets: NDArray[np.int32]) -> Floats:
    """Points of quadratic triangles (n_facets, 6), (n, 3), m."""
    i, j = np.mgrid[: SUBDIVISIONS + 1, : SUBDIVISIONS + 1].reshape(2, -1) / SUBDIVISIONS
    inside = i + j < 1 + 1e-9
    return np.einsum("qa,fai->fqi", shape(np.column_stack([i, j])[inside]), nodes[facets]).reshape(-1, 3)


def rim(nodes: Floats, facets: NDArray[np.int32]) -> tuple[Floats, float]:
    """Centre (3,), m, and mean radius, m, of the rim of a surface of quadratic triangles (n_facets, 6)."""
    edges, number, count = triangle_edges(facets[:, :3].astype(np.int32))
    vertices = nodes[np.unique(edges[count[number] == 1])]
    centre = vertices.mean(axis=0)
    return centre, float(_radius(vertices, centre).mean())


def _radius(position: Floats, centre: Floats) -> Floats:
    """Distance (n,), m, from the long axis through a centre."""
    return np.hypot(*(position - centre)[:, :2].T)
