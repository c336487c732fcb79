"""Blood: scatterers that fill the cavity, are carried by the wall and diffuse.

The cavity is a mesh of its own: every triangle of the endocardium is a face of a quadratic tetrahedron whose fourth
vertex is the centre of the base. It moves with the wall at the endocardium and less towards the
centre of the base.
"""

from dataclasses import dataclass

import numpy as np

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats, Integers, MaterialPoints, interpolate, jacobian
from echotruth.heart import Heart
from echotruth.imaging.medium.random_process import RandomProcess
from echotruth.imaging.medium.wall import cube_to_simplex, max_jacobian
from echotruth.mechanics.geometry.boundary import triangle_edges


class Cavity:
    """The cavity as quadratic tetrahedra between the endocardium and the centre of its rim.

    Parameters
    ----------
    endo : ndarray of shape (n_facets, 6)
        Nodes of the quadratic triangles of the endocardium, their normals pointing into the cavity.

    Attributes
    ----------
    cells : ndarray of shape (n_facets, 10)
        Nodes of the tetrahedra: the centre of the base, the endocardial nodes, the middles of the edges between them.
    rim : ndarray of shape (n,)
        Vertices of the wall around the lid of the cavity.
    """

    def __init__(self, endo: Integers) -> None:
        self._wall, facets = np.unique(endo, return_inverse=True)
        facets = facets.reshape(endo.shape)
        self._vertices, spokes = np.unique(facets[:, :3], return_inverse=True)
        edges, number, count = triangle_edges(facets[:, :3].astype(np.int32))
        self.rim = self._wall[np.unique(edges[count[number] == 1])]
        facets, spokes = 1 + facets, 1 + len(self._wall) + spokes.reshape(-1, 3)
        # The normals point to the centre, so that the order of the vertices is reversed.
        a, b, c, ab, bc, ca = facets.T
        spoke_a, spoke_b, spoke_c = spokes.T
        centre = np.zeros(len(endo), int)
        self.cells = np.column_stack([centre, a, c, b, spoke_a, ca, spoke_c, spoke_b, ab, bc]).astype(np.int32)

    def positions(self, nodes: Floats) -> Floats:
        """Nodes of the cavity (n, 3), m, from the nodes of the wall (n_nodes, 3), m."""
        centre, wall = nodes[self.rim].mean(axis=0), nodes[self._wall]
        return np.vstack([centre, wall, (wall[self._vertices] + centre) / 2])


@dataclass(frozen=True)
class Blood:
    """Scatterers in the cavity.

    Attributes
    ----------
    points : MaterialPoints of length n
        In the cells of the cavity.
    jacobian_threshold : ndarray of shape (n,), m^3
        A scatterer is present in a frame while det(dx / dxi) at its point exceeds this, so that blood is equally dense
        in every frame, whatever the volume of the cavity.
    amplitude : ndarray of shape (n,)
    """

    points: MaterialPoints
    jacobian_threshold: Floats
    amplitude: Floats

    def at(self, frame: int, heart: Heart, diffusion: RandomProcess) -> tuple[Floats, Floats]:
        """Blood in a frame.

        Parameters
        ----------
        frame : int
        heart : Heart
        diffusion : RandomProcess of ndarray of shape (n, 3), m
            Random offsets. One that leads into the wall or beyond the centre of the base is reversed; if the reversed
            one does so too, it is set to zero.

        Returns
        -------
        position : ndarray of shape (m, 3), m
            In the heart frame.
        amplitude : ndarray of shape (m,)
        """
        cavity = Cavity(heart.endo)
        nodes = cavity.positions(heart.positions(frame))
        present = self.jacobian_threshold < np.linalg.det(jacobian(nodes, cavity.cells, self.points))
        points = MaterialPoints(self.points.cell[present], self.points.xi[present])
        carried, offset = interpolate(nodes, cavity.cells, points), diffusion(frame)[present]
        pending = np.arange(len(points))
        for factor in (-1, 0):
            position = carried[pending] + offset[pending]
            in_wall = locate(heart.positions(frame), heart.cells, position).cell >= 0
            pending = pending[in_wall | (position[:, 2] > nodes[0, 2])]
            offset[pending] *= factor
        return carried + offset, self.amplitude[present]


def seed_blood(config: Config, heart: Heart, random: np.random.Generator) -> Blood:
    """Draw scatterers uniformly over the cavity.

    Parameters
    ----------
    config : Config
    heart : Heart
    random : Generator

    Returns
    -------
    Blood
        Enough scatterers for the fullest cavity. Their amplitudes are normally distributed; the variance in a volume is
        that of muscle times the level.
    """
    blood, cavity = config.realism.blood, Cavity(heart.endo)
    frames = range(len(heart.displacement))
    bound = np.max([max_jacobian(cavity.positions(heart.positions(k)), cavity.cells) for k in frames], axis=0)
    number = random.poisson(blood.density * config.phantom.si().density * bound.sum() / 6)
    cell = random.choice(len(bound), size=number, p=bound / bound.sum()).astype(np.int32)
    points = MaterialPoints(cell, cube_to_simplex(random.random((number, 3))))
    jacobian_threshold = random.random(number) * bound[cell]
    return Blood(points, jacobian_threshold, blood.amplitude_std * random.standard_normal(number))
