"""Lattices of boxes, each cut into six quadratic tetrahedra, mapped to bodies such as the tube.

The tube is a wall of uniform thickness about the long axis, open at both ends.
"""

from collections.abc import Callable
from itertools import permutations
from typing import NamedTuple

import numpy as np

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import EDGES, Floats, Integers, Mesh
from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.geometry.ellipsoid import semi_axes

Counts = tuple[int, int, int]
LatticeMap = Callable[[Floats], Floats]
"""Map of parameters (n_nodes, 3), from 0 to 1, to positions (n_nodes, 3), m; right-handed."""


class Tube(NamedTuple):
    """Inner and outer radius and length, m, of a tube below its base at z = 0."""

    inner: float
    outer: float
    length: float


def lattice(counts: Counts, position: LatticeMap, periodic: bool = False) -> tuple[Mesh, Floats]:
    """Mesh of a lattice of boxes, each cut into six tetrahedra (Kuhn, 1960).

    Parameters
    ----------
    counts : tuple of int
        Boxes along each parameter.
    position : callable
        See `LatticeMap`.
    periodic : bool
        Whether the second parameter closes upon itself.

    Returns
    -------
    mesh : Mesh
        Its endocardium is the side at which the first parameter is 0, its epicardium that at which it is 1, its base
        that at which the third is 1.
    parameters : ndarray of shape (n_nodes, 3)
    """
    cells, parameters = _kuhn(counts, periodic)
    facets, _ = boundary(cells)
    at_facets = parameters[facets]
    sides = [np.all(at_facets[..., axis] == value, axis=1) for axis, value in ((0, 0.0), (0, 1.0), (2, 1.0))]
    return Mesh(position(parameters), cells, *(facets[side] for side in sides)), parameters


def tube_map(inner: float, outer: float, length: float) -> LatticeMap:
    """Map to a tube about z, from z = -length to 0; radii and length in m.

    The three parameters run through the wall, around it and along it.
    """

    def position(parameters: Floats) -> Floats:
        radius, azimuth = inner + (outer - inner) * parameters[:, 0], 2 * np.pi * parameters[:, 1]
        return np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), length * (parameters[:, 2] - 1)])

    return position


def tube_dimensions(geometry: Geometry) -> Tube:
    """The tube as wide as the ellipsoids are at the equator and as long as the inner one is below the base."""
    (inner, length, base), (outer, _, _) = semi_axes(geometry)
    return Tube(inner, outer, length + base)


def tube(geometry: Geometry) -> Mesh:
    """Mesh of the tube, in boxes of six tetrahedra each; its lower end is neither endocardium, epicardium nor base."""
    counts = geometry.transmural_elements, geometry.circumferential_elements, geometry.longitudinal_elements
    return lattice(counts, tube_map(*tube_dimensions(geometry)), periodic=True)[0]


def _kuhn(counts: Counts, periodic: bool) -> tuple[Integers, Floats]:
    """Cells (n_cells, 10) and parameters (n_nodes, 3): all corners, and all points halfway between corners."""
    halves = 2 * np.array(counts)
    points = halves + [1, 0 if periodic else 1, 1]
    corner = 2 * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    cells = []
    for order in permutations(range(3)):
        steps = np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
        if round(np.linalg.det(np.eye(3)[list(order)])) < 0:
            steps[[1, 2]] = steps[[2, 1]]
        vertices = corner + 2 * steps
        middles = (vertices[:, EDGES[:, 0]] + vertices[:, EDGES[:, 1]]) // 2
        cells.append(np.concatenate([vertices, middles], axis=1) % (points if periodic else points + 1))
    numbers = np.arange(np.prod(points)).reshape(points)
    indices = np.stack(np.unravel_index(numbers.ravel(), points), axis=-1)
    return numbers[tuple(np.moveaxis(np.concatenate(cells), -1, 0))].astype(np.int32), indices / halves
