"""The heart frame of docs/conventions.md, found from the sides of a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.fem.tetrahedra import Floats
from echotruth.mechanics.geometry.boundary import area_vectors
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, Skin

LEVEL = 0.01
"""Distance of the base from its own plane, root mean square, over the length of the cavity, below which it is plane."""

TIP = 0.03
"""Share of the distance from the rim within which endocardium counts as apex: one node alone depends on the mesh."""


@dataclass(frozen=True)
class Frame:
    """Where the heart lies in the coordinates of a file.

    Attributes
    ----------
    origin : ndarray of shape (3,), m
    axes : ndarray of shape (3, 3)
        Rows x (to the septum), y and z (apex to base), right-handed.
    """

    origin: Floats
    axes: Floats

    def points(self, nodes: Floats) -> Floats:
        """Positions of shape (n, 3), m, brought into the heart frame."""
        return (nodes - self.origin) @ self.axes.T

    def directions(self, vectors: Floats) -> Floats:
        """Vectors of shape (n, 3) brought into the heart frame."""
        return vectors @ self.axes.T


def frame_of(skin: Skin, septum: Floats | None) -> Frame:
    """The frame of a wall as it stands.

    Parameters
    ----------
    skin : Skin
    septum : ndarray of shape (3,) or None, m
        A place in the septum; without one x is the file's own x axis, made orthogonal to z.

    Returns
    -------
    Frame
        Its origin is the centroid of the rim of the endocardium. z is the normal of the base where that is plane, so
        that the base lies at z = 0, else it points from the endocardial apex to the rim.
    """
    origin = rim_centroid(skin)
    normal = normal_of_base(skin)
    return Frame(origin, axes_about(origin - apex_of(skin) if normal is None else normal, septum, origin))


def normal_of_base(skin: Skin) -> Floats | None:
    """Normal (3,) of a base that is plane, None of one that is not."""
    normal = _unit(area_vectors(skin.nodes, skin.facets)[skin.side == BASE].sum(axis=0))
    base = skin.nodes[np.unique(skin.facets[skin.side == BASE][:, :3])]
    height = (base - base.mean(axis=0)) @ normal
    length = np.linalg.norm(rim_centroid(skin) - apex_of(skin))
    return normal if np.sqrt(np.mean(height**2)) < LEVEL * length else None


def axes_about(long_axis: Floats, septum: Floats | None, origin: Floats) -> Floats:
    """Axes with z along the long axis (3,) and x, as near as that allows, towards the septum (3,) or None, m."""
    z = _unit(long_axis)
    toward = np.eye(3)[0] if septum is None else septum - origin
    if np.linalg.norm(np.cross(z, toward)) < 1e-3 * np.linalg.norm(toward):
        toward = np.eye(3)[1]
    x = _unit(toward - (toward @ z) * z)
    return np.stack([x, np.cross(z, x), z])


def rim_centroid(skin: Skin) -> Floats:
    """Centroid of the rim of the endocardium, by its length, shape (3,), m."""
    ends = skin.nodes[skin.rim()]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return length @ ends.mean(axis=1) / length.sum()


def apex_of(skin: Skin) -> Floats:
    """Apex of the endocardium: what is farthest from the rim, shape (3,), m."""
    endo = skin.nodes[np.unique(skin.facets[skin.side == ENDO][:, :3])]
    distance = np.linalg.norm(endo - rim_centroid(skin), axis=1)
    # Weights that fall off linearly: nodes equally far count alike.
    return np.average(endo, axis=0, weights=np.maximum(distance / distance.max() - (1 - TIP), 0))


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)
