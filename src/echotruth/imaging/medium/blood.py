"""Blood: scatterers that fill the cavity, are carried by the wall and flow at random.

The cavity is a mesh of its own: every triangle of the endocardium is the outer face of a quadratic tetrahedron with its
fourth vertex in the middle of the base. Its motion is that of the wall on the wall and fades towards that middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats, Integers, MaterialPoints, interpolate, jacobian
from echotruth.heart import Heart
from echotruth.imaging.medium.phantom import in_tetrahedron, largest_ratio
from echotruth.imaging.medium.random_process import Course

_SIDES = np.array([(0, 1), (1, 2), (2, 0)])


class Cavity:
    """The cavity as quadratic tetrahedra between the endocardium and the middle of its rim.

    Parameters
    ----------
    endo : ndarray of shape (n_facets, 6)
        Nodes of the quadratic triangles of the endocardium, their normals pointing into the cavity.

    Attributes
    ----------
    cells : ndarray of shape (n_facets, 10)
        Nodes of the tetrahedra: the middle of the base, nodes of the endocardium, middles between both.
    rim : ndarray of shape (n,)
        Vertices of the wall round the lid of the cavity.
    """

    def __init__(self, endo: Integers) -> None:
        self._wall, facets = np.unique(endo, return_inverse=True)
        facets = facets.reshape(endo.shape)
        self._corners, spokes = np.unique(facets[:, :3], return_inverse=True)
        self.rim = self._wall[_rim(facets)]
        facets, spokes = 1 + facets, 1 + len(self._wall) + spokes.reshape(-1, 3)
        # The normal points to the middle, so the triangle is run through backwards.
        a, b, c, ab, bc, ca = facets.T
        of_a, of_b, of_c = spokes.T
        middle = np.zeros(len(endo), int)
        self.cells = np.column_stack([middle, a, c, b, of_a, ca, of_c, of_b, ab, bc]).astype(np.int32)

    def positions(self, nodes: Floats) -> Floats:
        """Nodes of the cavity (n, 3), m, by those of the wall (n_nodes, 3), m."""
        middle, wall = nodes[self.rim].mean(axis=0), nodes[self._wall]
        return np.vstack([middle, wall, (wall[self._corners] + middle) / 2])


def _rim(facets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Vertices on the sides that belong to one triangle alone."""
    sides = np.sort(facets[:, _SIDES].reshape(-1, 2), axis=1)
    each, count = np.unique(sides, axis=0, return_counts=True)
    return np.unique(each[count == 1])


@dataclass(frozen=True)
class Blood:
    """Scatterers in the cavity.

    Attributes
    ----------
    points : MaterialPoints of length n
        In the cells of the cavity.
    room : ndarray of shape (n,), m^3
        A scatterer is there while the volume of the cavity about it, over that of the local coordinates, is larger
        than this: so blood is equally dense in every frame, however much of it is left.
    amplitude : ndarray of shape (n,)
    """

    points: MaterialPoints
    room: Floats
    amplitude: Floats

    def at(self, frame: int, heart: Heart, flow: Course) -> tuple[Floats, Floats]:
        """Blood in a frame.

        Parameters
        ----------
        frame : int
        heart : Heart
        flow : Course of ndarray of shape (n, 3), m
            Random offsets. Who would come to lie in the wall or beyond the middle of the base goes the other way; if
            that is no better, none.

        Returns
        -------
        position : ndarray of shape (m, 3), m
            In the heart frame.
        amplitude : ndarray of shape (m,)
        """
        cavity = Cavity(heart.endo)
        nodes = cavity.positions(heart.positions(frame))
        there = self.room < np.linalg.det(jacobian(nodes, cavity.cells, self.points))
        points = MaterialPoints(self.points.cell[there], self.points.xi[there])
        carried, offset = interpolate(nodes, cavity.cells, points), flow(frame)[there]
        left = np.arange(len(points))
        for other_way in (-1, 0):
            place = carried[left] + offset[left]
            out = (locate(heart.positions(frame), heart.cells, place).cell >= 0) | (place[:, 2] > nodes[0, 2])
            left = left[out]
            offset[left] *= other_way
        return carried + offset, self.amplitude[there]


def fill(config: Config, heart: Heart, random: np.random.Generator) -> Blood:
    """Fill the cavity with blood.

    Parameters
    ----------
    config : Config
    heart : Heart
    random : Generator

    Returns
    -------
    Blood
        As many scatterers as the fullest cavity holds, and a few more. Their amplitudes are normally distributed;
        the variance in a volume is that of muscle times the level.
    """
    blood, cavity = config.realism.blood, Cavity(heart.endo)
    frames = range(len(heart.displacement))
    bound = np.max([largest_ratio(cavity.positions(heart.positions(k)), cavity.cells) for k in frames], axis=0)
    number = random.poisson(blood.density * config.phantom.si().density * bound.sum() / 6)
    cell = random.choice(len(bound), size=number, p=bound / bound.sum()).astype(np.int32)
    points = MaterialPoints(cell, in_tetrahedron(random.random((number, 3))))
    room = random.random(number) * bound[cell]
    return Blood(points, room, blood.strength * random.standard_normal(number))
