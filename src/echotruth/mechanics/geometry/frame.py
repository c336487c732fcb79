"""The heart frame of docs/conventions.md, from the labelled boundary of a wall."""

from dataclasses import dataclass

import numpy as np

from echotruth.fem.tetrahedra import Floats
from echotruth.mechanics.geometry.boundary import area_vectors, unit_vector
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, BoundarySurface

PLANE_BASE = 0.01
"""RMS distance of the base from its mean plane, over the length of the cavity, below which the base is plane."""

APEX_FRACTION = 0.03
"""Fraction of the distance from the rim within which endocardium counts as apex: one node alone depends on the mesh."""


@dataclass(frozen=True)
class HeartFrame:
    """Position and orientation of the heart in the coordinates of a file.

    Attributes
    ----------
    origin : ndarray of shape (3,), m
    axes : ndarray of shape (3, 3)
        Rows x (to the septum), y and z (apex to base), right-handed.
    """

    origin: Floats
    axes: Floats

    def transform_points(self, points: Floats) -> Floats:
        """Positions of shape (n, 3), m, in the heart frame."""
        return (points - self.origin) @ self.axes.T

    def transform_vectors(self, vectors: Floats) -> Floats:
        """Vectors of shape (n, 3) in the heart frame."""
        return vectors @ self.axes.T


def heart_frame(surface: BoundarySurface, septum: Floats | None) -> HeartFrame:
    """Heart frame of a wall as it is.

    Parameters
    ----------
    surface : BoundarySurface
    septum : ndarray of shape (3,) or None, m
        A point in the septum; without one x is the file's own x axis, made orthogonal to z.

    Returns
    -------
    HeartFrame
        Its origin is the centroid of the rim of the endocardium. z is the normal of the base where that is plane, so
        that the base lies at z = 0, else it points from the endocardial apex to the rim.
    """
    origin = rim_centroid(surface)
    normal = base_normal(surface)
    long_axis = origin - endocardial_apex(surface) if normal is None else normal
    return HeartFrame(origin, heart_axes(long_axis, septum, origin))


def base_normal(surface: BoundarySurface) -> Floats | None:
    """Normal (3,) of a base that is plane, None of one that is not."""
    normal = unit_vector(area_vectors(surface.nodes, surface.facets)[surface.labels == BASE].sum(axis=0))
    base = surface.vertices(BASE)
    height = (base - base.mean(axis=0)) @ normal
    length = np.linalg.norm(rim_centroid(surface) - endocardial_apex(surface))
    return normal if np.sqrt(np.mean(height**2)) < PLANE_BASE * length else None


def heart_axes(long_axis: Floats, septum: Floats | None, origin: Floats) -> Floats:
    """Axes (3, 3) with z along the long axis (3,) and x, made orthogonal to it, towards the septum (3,) or None, m."""
    z = unit_vector(long_axis)
    towards = np.eye(3)[0] if septum is None else septum - origin
    if np.linalg.norm(np.cross(z, towards)) < 1e-3 * np.linalg.norm(towards):
        towards = np.eye(3)[1]
    x = unit_vector(towards - (towards @ z) * z)
    return np.stack([x, np.cross(z, x), z])


def rim_centroid(surface: BoundarySurface) -> Floats:
    """Centroid of the rim of the endocardium, weighted by its length, shape (3,), m."""
    ends = surface.nodes[surface.rim()]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return length @ ends.mean(axis=1) / length.sum()


def endocardial_apex(surface: BoundarySurface) -> Floats:
    """Apex of the endocardium, the part of it farthest from the rim, shape (3,), m."""
    endo = surface.vertices(ENDO)
    distance = np.linalg.norm(endo - rim_centroid(surface), axis=1)
    # Weights that fall off linearly: nodes equally far count alike.
    return np.average(endo, axis=0, weights=np.maximum(distance / distance.max() - (1 - APEX_FRACTION), 0))
