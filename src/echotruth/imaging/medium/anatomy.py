"""Anatomy: which tissue lies where around the left ventricle, in every frame.

The heart that is solved is a left ventricle alone. What lies around it in life is placed by its epicardium and its base
and in proportion to it, so that it suits a mouse and a human:

- the right ventricle, a crescent on the septal side (+x): with u the azimuth over 60 degrees and v the height below the
  base over 0.85 of that of the epicardium, its cavity is W (1 - u^2) (1 - v^3) wide;
- the atria, blunt domes above the base, (r / R)^3 + (z / H)^3 < 1: the left on the rim of the cavity, the right between
  it and the right free wall;
- what lies behind the atria as the probe sees it: pericardium, oesophagus, spine;
- the lung, behind the free wall as the probe sees it;
- the chest wall, between the start of the tissue and the heart.

Lengths are in outer radii R of the left ventricle. In adults, with R of 33 mm, the right ventricle is 33 +- 4 mm wide
at its base and 27 +- 4 mm in its middle, 71 +- 6 mm long, its wall 3 +- 1 mm thick, and its fractional area change
49 +- 7 % with a lower limit of 35 % (Lang et al., J Am Soc Echocardiogr 28 (2015) 1). The other lengths were chosen by
eye.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import pi

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import shape, shape_gradient
from echotruth.heart import Heart
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.view import Plane
from echotruth.mechanics.geometry.boundary import area_vectors, triangle_edges, unit_vector

SEPTUM_HALF_ANGLE = pi / 3
"""Azimuth of the insertions of the right ventricle, rad: the septum is two of six AHA segments."""
RIGHT_WIDTH, RIGHT_LENGTH, RIGHT_WALL, RIGHT_SHORTENING = 1.0, 0.85, 0.1, 0.4
"""Greatest width of the right ventricle and thickness of its wall, in R; its length over the height of the epicardium;
and the share of its width that it loses by end-systole."""
ATRIAL_HEIGHT, ATRIAL_WALL = 1.35, 0.08
"""Height of the atria above the base and thickness of their walls, in R."""
RIGHT_ATRIUM, RIGHT_ATRIAL_LENGTH = -pi / 6, 0.75
"""Azimuth of the right atrium, rad, that of the four-chamber view, and half its length across it, in R."""
LUNG_FADING_DB = 25.0
"""Fall of the echo of lung over R."""
POSTERIOR_FADING_DB, POSTERIOR_NARROWNESS = 20.0, 4
"""Fall of the echo of what lies behind the atria over R, and power of the cosine of the angle from the axis of the
beam by which there is less of it to the sides; by eye."""
CHEST_WALL_SHARE = 0.8
"""Depth of the chest wall over that of the heart, both from the start of the tissue."""
STRATA = ((0.0, 0.0), (0.1, -7.0), (0.3, -2.0), (0.36, -5.0), (0.62, 0.0), (0.68, -6.0), (0.92, -1.0))
"""Layers of the chest wall: depth at which each begins, over that of the chest wall, and level relative to the
brightest, dB; skin, fat, fascia, muscle, fascia, muscle, pleura. By eye."""
UNDULATION = ((2.3, 0.08, 0.4), (0.9, 0.05, 2.1), (0.41, 0.03, 5.0))
"""Waves of the layers of the chest wall: length and amplitude over its depth, and phase, rad; by eye."""
SUBDIVISIONS = 6
"""Parts of the edge of a facet between points from which the nearest point of the epicardium is sought."""
NEWTON_STEPS = 3
"""Of the search for the nearest point; more move it by less than a nanometre for 99 of 100 points around a mouse."""


ATRIA = (TissueLabel.LEFT_ATRIUM, TissueLabel.RIGHT_ATRIUM)
CAVITIES = (TissueLabel.RIGHT_VENTRICLE, *ATRIA, TissueLabel.AORTIC_ROOT)
"""Neighbours that are blood."""
WALLS = (TissueLabel.RIGHT_FREE_WALL, TissueLabel.ATRIAL_WALL, TissueLabel.AORTIC_WALL)
"""Neighbours that are muscle."""
FOLLOWING_BASE = (*ATRIA, TissueLabel.ATRIAL_WALL, TissueLabel.AORTIC_ROOT, TissueLabel.AORTIC_WALL)
"""Neighbours that move with the base."""


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
    """What lies around the left ventricle at end-diastole.

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
    """

    def __init__(self, heart: Heart) -> None:
        self._facets, self._nodes = heart.arrays["geometry"]["epi"], heart.positions(0)
        self.base, self.inner_radius = rim(self._nodes, heart.endo)
        top, outer_radius = rim(self._nodes, self._facets)
        self.radius = float(_radius(self._nodes[self._facets.ravel()], top).max())
        self.roof = self.base[2] + ATRIAL_HEIGHT * self.radius
        self._septal_radius = outer_radius + RIGHT_WIDTH * self.radius

    @cached_property
    def _epicardium(self):
        """Tree of the samples of the epicardium, and their numbers.

        What facets share is sampled in the first of them alone, so that rounding does not choose between them.
        """
        from scipy.spatial import cKDTree

        points = sampled(self._nodes, self._facets)
        shared = cKDTree(points).query_pairs(1e-6 * self.radius, output_type="ndarray")
        number = np.setdiff1d(np.arange(len(points)), shared[:, 1])
        # Positions far from the epicardium are near to many samples alike: large leaves are fast for them.
        return cKDTree(points[number], leafsize=64, compact_nodes=False, balanced_tree=False), number

    def place(self, position: Floats) -> Place:
        """Place of positions (n, 3), m, in the heart frame."""
        samples, number = self._epicardium
        facet, point = np.divmod(number[samples.query(position)[1]], len(_lattice()))
        nearest = closest(self._nodes[self._facets], facet, _lattice()[point], position)
        distance = np.linalg.norm(position - nearest, axis=1)
        apex = samples.data[:, 2].min()
        azimuth = np.arctan2(*(nearest - self.base)[:, 1::-1].T) / SEPTUM_HALF_ANGLE
        below = (self.base[2] - nearest[:, 2]) / (RIGHT_LENGTH * (self.base[2] - apex))
        width = np.maximum(1 - azimuth**2, 0) * np.clip(1 - np.maximum(below, 0) ** 3, 0, None)
        return Place(
            distance,
            (position - nearest) / np.maximum(distance, 1e-12)[:, None],
            RIGHT_WIDTH * self.radius * width,
            RIGHT_WALL * self.radius * np.minimum(1, 4 * width),
            position[:, 2] - self.base[2],
        )

    def chambers(self, position: Floats, place: Place) -> NDArray[np.uint8]:
        """Tissue (n,) of positions (n, 3), m, outside the left ventricle: right ventricle, atria or none."""
        tissue = np.full(len(position), TissueLabel.OTHER, np.uint8)
        below, outside = place.height < 0, place.distance - place.gap
        tissue[below & (outside < place.wall) & (place.wall > 0)] = TissueLabel.RIGHT_FREE_WALL
        tissue[below & (outside < 0)] = TissueLabel.RIGHT_VENTRICLE
        thickness, above = ATRIAL_WALL * self.radius, place.height >= 0
        tissue[above & (self._in_atria(position, thickness).min(axis=0) < 1)] = TissueLabel.ATRIAL_WALL
        for atrium, within in zip(ATRIA, self._in_atria(position, 0.0), strict=True):
            tissue[above & (within < 1)] = atrium
        return tissue

    def atrial_share(self, place: Place) -> Floats:
        """Share (n,) of the motion of the base that tissue above it has: it falls from the base to the roof."""
        return np.clip(1 - place.height / (self.roof - self.base[2]), 0, 1)

    def atrial_distance(self, position: Floats) -> Floats:
        """Distance (n,), m, of positions (n, 3), m, from the nearer atrium with its wall, on the ray from its middle.

        It is 0 within.
        """
        within = self._in_atria(position, ATRIAL_WALL * self.radius)
        outwards = np.array([np.cos(RIGHT_ATRIUM), np.sin(RIGHT_ATRIUM), 0.0])
        middles = self.base + np.stack([np.zeros(3), self.right_atrium[0] * outwards])
        from_middle = np.linalg.norm(position - middles[:, None], axis=2)
        return (from_middle * (1 - 1 / np.maximum(within, 1))).min(axis=0)

    @property
    def right_atrium(self) -> tuple[float, float]:
        """Middle of the right atrium and half its width, m, from the long axis outwards."""
        near = self.inner_radius + ATRIAL_WALL * self.radius
        return (self._septal_radius + near) / 2, (self._septal_radius - near) / 2

    def _in_atria(self, position: Floats, thickness: float) -> Floats:
        """Distance of positions (n, 3), m, from the middle of each atrium over that of its surface, (2, n).

        With a thickness, m, the surface is that of its wall.
        """
        x, y, z = (position - self.base).T
        height = self.roof - self.base[2] + thickness
        left = np.hypot(x, y) / (self.inner_radius + thickness)
        middle, half = self.right_atrium
        cos, sin = np.cos(RIGHT_ATRIUM), np.sin(RIGHT_ATRIUM)
        length = RIGHT_ATRIAL_LENGTH * self.radius + thickness
        right = np.hypot((cos * x + sin * y - middle) / (half + thickness), (cos * y - sin * x) / length)
        return np.cbrt(np.stack([left, right]) ** 3 + np.abs(z / height) ** 3)


@lru_cache(maxsize=1)
def anatomy_of(heart: Heart) -> Anatomy:
    """Anatomy around a heart, made once for all that lies there: it samples the whole epicardium."""
    return Anatomy(heart)


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


def _lattice() -> Floats:
    """Local coordinates (n, 2) of the points at which a facet is sampled."""
    lattice = np.indices((SUBDIVISIONS + 1, SUBDIVISIONS + 1)).reshape(2, -1).T
    return lattice[lattice.sum(axis=1) <= SUBDIVISIONS] / SUBDIVISIONS


def sampled(nodes: Floats, facets: NDArray[np.int32]) -> Floats:
    """Points of quadratic triangles (n_facets, 6), (n, 3), m."""
    return np.einsum("qa,fai->fqi", shape(_lattice()), nodes[facets]).reshape(-1, 3)


def closest(facets: Floats, number: NDArray[np.int64], xi: Floats, position: Floats) -> Floats:
    """Points (n, 3), m, of quadratic triangles closest to positions (n, 3), m, by Newton's method.

    It begins at local coordinates (n, 2) and goes at most a step of the lattice, also beyond the sides of the triangle,
    where its neighbour continues it smoothly. Where there is no minimum nearby, the point is that of the beginning.

    Parameters
    ----------
    facets : ndarray of shape (n_facets, 6, 3), m
    number : ndarray of shape (n,)
        Of the triangle for each position.
    xi, position : ndarray of shape (n, 2), and (n, 3), m
    """
    # Points are the last axis, in which NumPy is fast.
    corner, slope, curvature = (np.take(np.moveaxis(part, 0, -1), number, axis=-1) for part in _expansion(facets))
    now = start = xi.T
    for _ in range(NEWTON_STEPS):
        point, tangent = _at(corner, slope, curvature, now)
        offset = position.T - point
        a, b, d = (_dot(tangent[k], tangent[m]) - _dot(curvature[k, m], offset) for k, m in ((0, 0), (0, 1), (1, 1)))
        along, across = _dot(tangent[0], offset), _dot(tangent[1], offset)
        determinant = np.where(np.abs(a * d - b * b) > 0, a * d - b * b, 1)
        step = np.stack([d * along - b * across, a * across - b * along]) / determinant
        now = start + np.clip(now + step - start, -1 / SUBDIVISIONS, 1 / SUBDIVISIONS)
    first, found = (_at(corner, slope, curvature, at)[0].T for at in (start, now))
    nearer = np.linalg.norm(position - found, axis=1) < np.linalg.norm(position - first, axis=1)
    return np.where(nearer[:, None], found, first)


def _expansion(facets: Floats) -> tuple[Floats, Floats, Floats]:
    """First corners (n, 3), first derivatives there (n, 2, 3), and second ones (n, 2, 2, 3), of triangles (n, 6, 3), m.

    The second derivatives are constant.
    """
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    first, *others = np.einsum("qak,nai->qnki", shape_gradient(corners), facets)
    return facets[:, 0], first, np.stack(others, axis=1) - first[:, None]


def _at(corner: Floats, slope: Floats, curvature: Floats, xi: Floats) -> tuple[Floats, Floats]:
    """Points (3, n), m, at local coordinates (2, n) of triangles with given expansions, and derivatives (2, 3, n).

    A point is the corner plus the way to it along the mean of the derivatives at both, as they change linearly.
    """
    tangent = slope + curvature[0] * xi[0] + curvature[1] * xi[1]
    return corner + (slope[0] + tangent[0]) / 2 * xi[0] + (slope[1] + tangent[1]) / 2 * xi[1], tangent


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products (n,) of vectors (3, n)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def rim(nodes: Floats, facets: NDArray[np.int32]) -> tuple[Floats, float]:
    """Centre (3,), m, and mean radius, m, of the rim of a surface of quadratic triangles (n_facets, 6)."""
    edges, number, count = triangle_edges(facets[:, :3].astype(np.int32))
    vertices = nodes[np.unique(edges[count[number] == 1])]
    centre = vertices.mean(axis=0)
    return centre, float(np.linalg.norm(vertices - centre, axis=1).mean())


def rim_normal(nodes: Floats, endo: NDArray[np.int32]) -> Floats:
    """Mean unit normal (3,), out of the cavity, of the rim of an endocardium (n_facets, 6) with normals into it.

    Endocardium and lid are closed together, so that the areas of the facets, as vectors, add up to that of the lid.
    """
    return unit_vector(area_vectors(nodes, endo).sum(axis=0))


def above_lid(nodes: Floats, endo: NDArray[np.int32], position: Floats) -> NDArray[np.bool_]:
    """Whether positions (n, 3), m, are in the column above the lid of the cavity, (n,), perpendicular to it."""
    (centre, radius), normal = rim(nodes, endo), rim_normal(nodes, endo)
    height = (position - centre) @ normal
    return (height >= 0) & (np.linalg.norm(position - centre - height[:, None] * normal, axis=1) <= radius)


def _radius(position: Floats, centre: Floats) -> Floats:
    """Distance (n,), m, from the long axis through a centre."""
    return np.hypot(*(position - centre)[:, :2].T)
