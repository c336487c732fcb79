"""Scatterers in the wall, carried by the shape functions of the elements they sit in."""

from __future__ import annotations

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

    def image(self, positions: Floats, cells: NDArray[np.int32], plane: Plane) -> Floats:
        """Where they are in the image.

        Parameters
        ----------
        positions : ndarray of shape (n_nodes, 3), m
            Of the nodes in a frame.
        cells : ndarray of shape (n_cells, 10)
        plane : Plane

        Returns
        -------
        ndarray of shape (n, 3), m
            Lateral, axial, elevation.
        """
        places = plane.image(interpolate(positions, cells, self.points))
        if self.in_plane_only:
            places[:, 2] = 0
        return places


def scatter(config: Config, heart: Heart, plane: Plane, random: np.random.Generator) -> Scatterers:
    """The scatterers of one view: in the wall, or in its cut with the plane when `in_plane_only`."""
    if config.phantom.in_plane_only:
        return seed_plane(config, heart, plane, random)
    return seed(config.phantom, heart.nodes, heart.cells, random)


def seed(phantom: Phantom, nodes: Floats, cells: NDArray[np.int32], random: np.random.Generator) -> Scatterers:
    """Scatter points evenly over the volume of the unloaded wall.

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
    bound = largest_ratio(nodes, cells)
    tried = random.poisson(phantom.si().density * bound.sum() / 6)
    cell = random.choice(len(cells), size=tried, p=bound / bound.sum()).astype(np.int32)
    points = MaterialPoints(cell, in_tetrahedron(random.random((tried, 3))))
    # Elements are curved: thinning by the local volume leaves the density even within each.
    kept = random.random(tried) * bound[cell] < np.linalg.det(jacobian(nodes, cells, points))
    points = MaterialPoints(points.cell[kept], points.xi[kept])
    return Scatterers(points, random.standard_normal(len(points)), in_plane_only=False)


def seed_plane(config: Config, heart: Heart, plane: Plane, random: np.random.Generator) -> Scatterers:
    """Scatter points evenly over the wall in the imaging plane at end-diastole, as the paper's phantom is printed.

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
    corners = plane.image(heart.positions(0))[:, :2]
    low, size = corners.min(axis=0), np.ptp(corners, axis=0)
    tried = random.poisson(config.phantom.si().density * thickness * size.prod())
    places = np.column_stack([low + size * random.random((tried, 2)), np.zeros(tried)])
    points = locate(heart.positions(0), heart.cells, plane.heart(places))
    kept = points.cell >= 0
    points = MaterialPoints(points.cell[kept], points.xi[kept])
    return Scatterers(points, random.standard_normal(len(points)), in_plane_only=True)


def in_tetrahedron(cube: Floats) -> Floats:
    """Fold the unit cube onto the unit tetrahedron, evenly: sorted coordinates have even gaps."""
    return np.diff(np.sort(cube, axis=1), prepend=0.0, axis=1)


def largest_ratio(nodes: Floats, cells: NDArray[np.int32]) -> Floats:
    """A bound on the volume of tissue per volume of local coordinates in each cell, m^3."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    places = np.vstack([corners, corners[EDGES].mean(axis=1)])
    cell = np.repeat(np.arange(len(cells), dtype=np.int32), len(places))
    ratios = np.linalg.det(jacobian(nodes, cells, MaterialPoints(cell, np.tile(places, (len(cells), 1)))))
    # Between the nodes the cubic can rise a little above its values at them.
    return 1.1 * ratios.reshape(len(cells), -1).max(axis=1)
