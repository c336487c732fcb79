"""Blood: scatterers that fill the cavity, are carried by the wall and diffuse.

The cavity is a mesh of its own: every triangle of the endocardium is a face of a quadratic tetrahedron whose fourth
vertex is the centre of the base. It moves with the wall at the endocardium and less towards the
centre of the base.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats, Integers, MaterialPoints, interpolate, jacobian
from echotruth.imaging.medium.anatomy import rim_normal
from echotruth.imaging.medium.body import Body, Echoes, Scene, echoes
from echotruth.imaging.medium.random_process import RandomProcess, brownian, diffusion_std
from echotruth.imaging.medium.wall import draw_in_cells, max_jacobian
from echotruth.imaging.rf.probe import wavelength
from echotruth.loop.cycle import period
from echotruth.mechanics.geometry.boundary import triangle_edges
from echotruth.units import ms, per_mm3

MAX_DIFFUSION = 5
"""Offset that blood is assumed not to exceed over a cycle, in standard deviations."""


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


@dataclass(frozen=True, eq=False)
class Blood(Body):
    """Scatterers in the cavity.

    Attributes
    ----------
    cell : ndarray of shape (n,)
        Cell of the cavity that each is in.
    xi : ndarray of shape (n, 3)
        Local coordinates in it.
    jacobian_threshold : ndarray of shape (n,), m^3
        A scatterer is present in a frame while det(dx / dxi) at its point exceeds this, so that blood is equally dense
        in every frame, whatever the volume of the cavity.
    amplitude : ndarray of shape (n,)
    """

    name, level = "blood", "blood.level_dB"
    cell: Integers
    xi: Floats
    jacobian_threshold: Floats
    amplitude: Floats

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers uniformly over the cavity, enough for the fullest.

        Their amplitudes are normally distributed; the variance in a volume is that of muscle times the level.
        """
        config, heart, random = scene.config, scene.heart, scene.random(cls.name)
        blood, cavity = config.realism.blood, Cavity(heart.endo)
        frames = range(len(heart.displacement))
        bound = np.max([max_jacobian(cavity.positions(heart.positions(k)), cavity.cells) for k in frames], axis=0)
        points, threshold = draw_in_cells(blood.density * (config.phantom.density_per_mm3 * per_mm3), bound, random)
        amplitude = blood.amplitude_std * random.standard_normal(len(points))
        return cls(scene, points.cell, points.xi, threshold, amplitude)

    def positions(self, frame: int) -> Floats:
        """Positions in the image (n, 3), m, without diffusion."""
        carried = interpolate(self._nodes(frame), self._cavity.cells, MaterialPoints(self.cell, self.xi))
        return self.scene.plane.to_image(carried)

    def nearest(self, frame: int) -> Floats:
        position = self.positions(frame)
        offset = MAX_DIFFUSION * diffusion_std(period(self.scene.config.loop), *self._decorrelation)
        return np.column_stack([position[:, :2], np.maximum(np.abs(position[:, 2]) - offset, 0)])

    def __call__(self, frame: int) -> Echoes:
        """Those that are present in a frame.

        A random offset that leads into the wall or beyond the plane of the rim is reversed; if the reversed one does
        so too, it is set to zero.
        """
        heart, cells, nodes = self.scene.heart, self._cavity.cells, self._nodes(frame)
        determinant = np.linalg.det(jacobian(nodes, cells, MaterialPoints(self.cell, self.xi)))
        present = self.jacobian_threshold < determinant
        points = MaterialPoints(self.cell[present], self.xi[present])
        carried, offset = interpolate(nodes, cells, points), self._diffusion(frame)[present]
        upwards = rim_normal(heart.positions(frame), heart.endo)
        pending = np.arange(len(points))
        for factor in (-1, 0):
            position = carried[pending] + offset[pending]
            in_wall = locate(heart.positions(frame), heart.cells, position).cell >= 0
            pending = pending[in_wall | ((position - nodes[0]) @ upwards > 0)]
            offset[pending] *= factor
        position = self.scene.plane.to_image(carried + offset)
        return echoes(self.scene.config.realism.blood, position, self.amplitude[present])

    @cached_property
    def _cavity(self) -> Cavity:
        return Cavity(self.scene.heart.endo)

    def _nodes(self, frame: int) -> Floats:
        return self._cavity.positions(self.scene.heart.positions(frame))

    @property
    def _decorrelation(self) -> tuple[float, float]:
        """Time constant of the echo of blood, s, and wavelength, m."""
        config = self.scene.config
        return config.realism.blood.decorrelation_time_ms * ms, wavelength(config.probe)

    @cached_property
    def _diffusion(self) -> RandomProcess:
        return brownian(len(self.cell), self.scene.time, *self._decorrelation, self.scene.random)
