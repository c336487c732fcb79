"""The mitral annulus: the rim of the cavity, but for the part of it that the aortic root takes.

Coordinates of a ring are anterior, commissural and upwards, from its middle and over its radius. The middle of the
anterior side is 40 degrees from the four-chamber view and 20 from the three-chamber view, in which the aortic annulus
is: a disc that takes its part of the rim's disc, so that what remains is shaped like a kidney, as the mitral annulus
is. Two- and four-chamber view lie beside it. In life too the commissures lie between the two-chamber view and the plane
across the three-chamber one; the angles were chosen by eye.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from echotruth.arrays import Floats
from echotruth.heart import Heart
from echotruth.imaging.medium.anatomy import rim_normal
from echotruth.imaging.medium.blood import Cavity

ANTERIOR, AORTIC = pi / 18, pi / 6
"""Azimuth of the middle of the anterior leaflet, and of the aortic root, rad."""
AORTIC_DISTANCE, AORTIC_RADIUS, AORTIC_WALL = 1.0, 0.5, 0.08
"""Distance of the aortic annulus from the middle of the rim, its inner radius and the thickness of its wall, over the
radius of the rim, 26 mm in the human preset. Adults have a radius of 12 mm (Lang et al., J Am Soc Echocardiogr 28
(2015) 1); distance and thickness were chosen by eye."""
AORTIC_OUTWARDS = np.array([np.cos(AORTIC - ANTERIOR), np.sin(AORTIC - ANTERIOR), 0.0])
"""Unit vector from the middle of the rim towards that of the aortic annulus, anterior, commissural and upwards."""


@dataclass(frozen=True)
class Ring:
    """A ring of points in a frame.

    Attributes
    ----------
    middle : ndarray of shape (3,), m
    radius : float, m
        Mean distance of its points from the middle.
    axes : ndarray of shape (3, 3)
        Rows: unit vectors anterior, commissural, and upwards: out of the cavity.
    """

    middle: Floats
    radius: float
    axes: Floats

    @classmethod
    def of(cls, points: Floats, azimuth: Floats, normal: Floats) -> "Ring":
        """Ring of points (n, 3), m, that were at azimuths (n,), rad, from its anterior side, with a unit normal (3,).

        It turns with its points, whose mean, weighted by the cosine, is on the anterior side.
        """
        middle = points.mean(axis=0)
        anterior = np.cos(azimuth) @ (points - middle)
        anterior = anterior - (anterior @ normal) * normal
        anterior /= np.linalg.norm(anterior)
        axes = np.stack([anterior, np.cross(normal, anterior), normal])
        return cls(middle, float(np.linalg.norm(points - middle, axis=1).mean()), axes)

    def to_ring(self, position: Floats) -> Floats:
        """Coordinates (n, 3) in the ring, over its radius, of positions (n, 3), m, in the heart frame."""
        return (position - self.middle) @ self.axes.T / self.radius

    def to_heart(self, place: Floats) -> Floats:
        """Positions (n, 3), m, in the heart frame of coordinates (n, 3) in the ring, over its radius."""
        return self.middle + self.radius * place @ self.axes


def box_of(rings: list[Ring], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates, (3,), m, in the heart frame, of a box, (3,) to (3,), in coordinates of rings."""
    corners = np.array(np.meshgrid(*np.stack([low, high]).T)).reshape(3, -1).T
    reached = np.concatenate([ring.to_heart(corners) for ring in rings])
    return reached.min(axis=0), reached.max(axis=0)


class Rim:
    """The rim of the cavity in every frame.

    Parameters
    ----------
    heart : Heart
    """

    def __init__(self, heart: Heart) -> None:
        self._heart, self._nodes = heart, Cavity(heart.endo).rim
        start = heart.positions(0)[self._nodes]
        self._azimuth = np.arctan2(*(start - start.mean(axis=0))[:, 1::-1].T) - ANTERIOR

    def __call__(self, frame: int) -> Ring:
        """The rim in a frame."""
        nodes = self._heart.positions(frame)
        return Ring.of(nodes[self._nodes], self._azimuth, rim_normal(nodes, self._heart.endo))


def hinge(commissural: Floats, side: Floats) -> Floats:
    """Anterior coordinates (n,) of the annulus at commissural ones (n,), on the anterior side, 1, or the other, -1."""
    circle = np.sqrt(np.maximum(1 - commissural**2, 0))
    outer, (anterior, beside, _) = AORTIC_RADIUS + AORTIC_WALL, AORTIC_DISTANCE * AORTIC_OUTWARDS
    from_root = np.abs(commissural - beside)
    root = anterior - np.sqrt(np.maximum(outer**2 - from_root**2, 0))
    return np.where((side > 0) & (from_root < outer), np.minimum(root, circle), side * circle)


def span(commissural: Floats) -> Floats:
    """Distance (n,) between both sides of the annulus at commissural coordinates (n,)."""
    return hinge(commissural, np.ones_like(commissural)) - hinge(commissural, -np.ones_like(commissural))


def annulus_distance(place: Floats) -> Floats:
    """Distance (n,) of coordinates (n, 3) in the rim from the annulus: the rim outside of the root, or its edge."""
    outer = AORTIC_RADIUS + AORTIC_WALL
    from_root = np.linalg.norm((place - AORTIC_DISTANCE * AORTIC_OUTWARDS)[:, :2], axis=1)
    anterior, commissural, up = place.T
    from_rim = np.hypot(anterior, commissural)
    circle = np.where(from_root > outer, np.abs(from_rim - 1), np.inf)
    edge = np.where(from_rim < 1, np.abs(from_root - outer), np.inf)
    return np.hypot(np.minimum(circle, edge), up)
