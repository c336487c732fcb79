"""The wall: scatterers seeded in it, carried by the shape functions of their elements."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config, Phantom
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import EDGES, MaterialPoints, interpolate, jacobian
from echotruth.heart import Heart
from echotruth.imaging.view import Plane


@dataclass(frozen=True)
class Scatterers:
    """Point scatterers fixed in the material.

    Attributes
    ----------
    points : MaterialPoints of length n
    amplitude : ndarray of shape (n,)
        Normally distributed, of unit variance.
    in_plane_only : bool
        Whether they stay in the imaging plane, whatever the tissue does.
    """

    points: MaterialPoints
    amplitude: Floats
    in_plane_only: bool

    def image_positions(self, nodes: Floats, cells: NDArray[np.int32], plane: Plane) -> Floats:
        """Positions of the scatterers in the image.

        Parameters
        ----------
        nodes : ndarray of shape (n_nodes, 3), m
            In the frame.
        cells : ndarray of shape (n_cells, 10)
        plane : Plane

        Returns
        -------
        ndarray of shape (n, 3), m
            Lateral, axial, elevation.
        """
        position = plane.to_image(interpolate(nodes, cells, self.points))
        if self.in_plane_only:
            position[:, 2] = 0
        return position


def seed_wall(config: Config, heart: Heart, plane: Plane, random: np.random.Generator) -> Scatterers:
    """Seed the wall, or its section by the imaging plane if `phantom.in_plane_only`."""
    if config.phantom.in_plane_only:
        return seed_section(config, heart, plane, random)
    return seed_volume(config.phantom, heart.nodes, heart.cells, random)


def seed_volume(phantom: Phantom, nodes: Floats, cells: NDArray[np.int32], random: np.random.Generator) -> Scatterers:
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
    Scatterers
        Their number is Poisson distributed about density times volume, as in a uniform random medium.
    """
    bound = max_jacobian(nodes, cells)
    candidates = random.poisson(phantom.si().density * bound.sum() / 6)
    cell = random.choice(len(cells), size=candidates, p=bound / bound.sum()).astype(np.int32)
    points = MaterialPoints(cell, cube_to_simplex(random.random((candidates, 3))))
    # Elements are curved: rejection by the local Jacobian makes the density uniform within each.
    accepted = random.random(candidates) * bound[cell] < np.linalg.det(jacobian(nodes, cells, points))
    points = MaterialPoints(points.cell[accepted], points.xi[accepted])
    return Scatterers(points, random.standard_normal(len(points)), in_plane_only=False)


def seed_section(config: Config, heart: Heart, plane: Plane, random: np.random.Generator) -> Scatterers:
    """Draw scatterers uniformly over the wall in the imaging plane at end-diastole, as the paper's phantom is printed.

    Their areal density is the volumetric one times the thickness of the beam at its elevation focus,
    wavelength x focus / height.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    random : Generator

    Returns
    -------
    Scatterers
    """
    array = config.probe.si()
    thickness = array.sound_speed / array.frequency * array.elevation_focus / array.height
    nodes = plane.to_image(heart.positions(0))[:, :2]
    low, size = nodes.min(axis=0), np.ptp(nodes, axis=0)
    candidates = random.poisson(config.phantom.si().density * thickness * size.prod())
    position = np.column_stack([low + size * random.random((candidates, 2)), np.zeros(candidates)])
    points = locate(heart.positions(0), heart.cells, plane.to_heart(position))
    inside = points.cell >= 0
    points = MaterialPoints(points.cell[inside], points.xi[inside])
    return Scatterers(points, random.standard_normal(len(points)), in_plane_only=True)


def cube_to_simplex(cube: Floats) -> Floats:
    """Map uniform points of the unit cube, or square, to uniform ones of the unit tetrahedron, or triangle.

    They are the gaps of sorted coordinates.
    """
    return np.diff(np.sort(cube, axis=1), prepend=0.0, axis=1)


def max_jacobian(nodes: Floats, cells: NDArray[np.int32]) -> Floats:
    """Upper bound of det(dx / dxi), volume per volume of local coordinates, in each cell, (n_cells,), m^3."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    xi = np.vstack([corners, corners[EDGES].mean(axis=1)])
    cell = np.repeat(np.arange(len(cells), dtype=np.int32), len(xi))
    determinants = np.linalg.det(jacobian(nodes, cells, MaterialPoints(cell, np.tile(xi, (len(cells), 1)))))
    # Between the nodes the cubic can rise a little above its nodal values.
    return 1.1 * determinants.reshape(len(cells), -1).max(axis=1)
