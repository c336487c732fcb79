"""The wall: scatterers seeded in it, carried by the shape functions of their elements."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Phantom
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import NODE_XI, Integers, MaterialPoints, interpolate, jacobian
from echotruth.imaging.medium.backscatter import FibreEcho, variation
from echotruth.imaging.medium.body import Body, Echoes, Scene, echoes
from echotruth.imaging.rf.probe import wavelength
from echotruth.units import mm, per_mm3


@dataclass(frozen=True, eq=False)
class Wall(Body):
    """Scatterers fixed in the wall; with `phantom.in_plane_only`, they stay in the imaging plane, whatever it does.

    Attributes
    ----------
    cell : ndarray of shape (n,)
        Cell that each is in.
    xi : ndarray of shape (n, 3)
        Local coordinates in it.
    amplitude : ndarray of shape (n,)
        At end-diastole: normally distributed, of unit variance.
    """

    name = "wall"
    cell: Integers
    xi: Floats
    amplitude: Floats

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Seed the wall, or its section by the imaging plane if `phantom.in_plane_only`."""
        phantom, random = scene.config.phantom, scene.random("phantom")
        if phantom.in_plane_only:
            points = seed_section(scene, random)
        else:
            points = seed_volume(phantom, scene.heart.nodes, scene.heart.cells, random)
        return cls(scene, points.cell, points.xi, random.standard_normal(len(points)))

    @cached_property
    def points(self) -> MaterialPoints:
        """The scatterers."""
        return MaterialPoints(self.cell, self.xi)

    def positions(self, frame: int) -> Floats:
        heart = self.scene.heart
        position = self.scene.plane.to_image(interpolate(heart.positions(frame), heart.cells, self.points))
        if self.scene.config.phantom.in_plane_only:
            position[:, 2] = 0
        return position

    def __call__(self, frame: int) -> Echoes:
        position, amplitude = self.positions(frame), self._fading(frame) * self._variation
        if self._fibre_echo is not None:
            amplitude = amplitude * self._fibre_echo(frame, position)
        return echoes(self.scene.config.phantom, position, amplitude)

    def contains(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether points before the probe (..., 3), m, lie in the wall in a frame: (...)."""
        heart = self.scene.heart
        points = locate(heart.positions(frame), heart.cells, self.scene.plane.to_heart(position.reshape(-1, 3)))
        return (points.cell >= 0).reshape(position.shape[:-1])

    @cached_property
    def _fading(self) -> Callable[[int], Floats]:
        return self.scene.fading(self.amplitude, self.name)

    @cached_property
    def _variation(self) -> Floats:
        unloaded = interpolate(self.scene.heart.nodes, self.scene.heart.cells, self.points)
        return variation(self.scene.config.realism.backscatter, unloaded, self.scene.random("variation"))

    @cached_property
    def _fibre_echo(self) -> FibreEcho | None:
        backscatter = self.scene.config.realism.backscatter
        depends = backscatter.anisotropy_dB or backscatter.fibre_strain_dB
        return FibreEcho(backscatter, self.scene.heart, self.scene.plane, self.points) if depends else None


def seed_volume(
    phantom: Phantom, nodes: Floats, cells: NDArray[np.int32], random: np.random.Generator
) -> MaterialPoints:
    """Draw scatterers uniformly over the volume of the unloaded wall.

    Parameters
    ----------
    phantom : Phantom
    nodes : ndarray of shape (n_nodes, 3), m
        Unloaded.
    cells : ndarray of shape (n_cells, 10)
    random : Generator

    Returns
    -------
    MaterialPoints of length n
        Their number is Poisson distributed about density times volume, as in a uniform random medium.
    """
    points, threshold = draw_in_cells(phantom.density_per_mm3 * per_mm3, max_jacobian(nodes, cells), random)
    # Elements are curved: rejection by the local Jacobian makes the density uniform within each.
    accepted = threshold < np.linalg.det(jacobian(nodes, cells, points))
    return MaterialPoints(points.cell[accepted], points.xi[accepted])


def draw_in_cells(density: float, bound: Floats, random: np.random.Generator) -> tuple[MaterialPoints, Floats]:
    """Draw points in cells, more than enough for a density, 1/m^3, in each of which det(dx / dxi) has a bound, m^3.

    Those at which it exceeds the thresholds that are returned too, (n,), m^3, have that density.
    """
    number = random.poisson(density * bound.sum() / 6)
    cell = random.choice(len(bound), size=number, p=bound / bound.sum()).astype(np.int32)
    points = MaterialPoints(cell, cube_to_simplex(random.random((number, 3))))
    return points, random.random(number) * bound[cell]


def seed_section(scene: Scene, random: np.random.Generator) -> MaterialPoints:
    """Draw scatterers uniformly over the wall in the imaging plane at end-diastole, as the paper's phantom is printed.

    Their areal density is the volumetric one times the thickness of the beam at its elevation focus,
    wavelength x focus / height.
    """
    heart, plane, probe = scene.heart, scene.plane, scene.config.probe
    thickness = wavelength(probe) * (probe.elevation_focus_mm * mm) / (probe.height_mm * mm)
    nodes = plane.to_image(heart.positions(0))[:, :2]
    low, size = nodes.min(axis=0), np.ptp(nodes, axis=0)
    candidates = random.poisson(scene.config.phantom.density_per_mm3 * per_mm3 * thickness * size.prod())
    position = np.column_stack([low + size * random.random((candidates, 2)), np.zeros(candidates)])
    points = locate(heart.positions(0), heart.cells, plane.to_heart(position))
    inside = points.cell >= 0
    return MaterialPoints(points.cell[inside], points.xi[inside])


def cube_to_simplex(cube: Floats) -> Floats:
    """Map uniform points of the unit cube, or square, to uniform ones of the unit tetrahedron, or triangle.

    They are the gaps of sorted coordinates.
    """
    return np.diff(np.sort(cube, axis=1), prepend=0.0, axis=1)


def max_jacobian(nodes: Floats, cells: NDArray[np.int32]) -> Floats:
    """Upper bound of det(dx / dxi), volume per volume of local coordinates, in each cell, (n_cells,), m^3."""
    cell = np.repeat(np.arange(len(cells), dtype=np.int32), len(NODE_XI))
    determinants = np.linalg.det(jacobian(nodes, cells, MaterialPoints(cell, np.tile(NODE_XI, (len(cells), 1)))))
    # Between the nodes the cubic can rise a little above its nodal values.
    return 1.1 * determinants.reshape(len(cells), -1).max(axis=1)
