"""Bodies of quadratic tetrahedra in a lattice: bars, tubes and pieces of a sphere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from echotruth.mechanics.fibres import gradients
from echotruth.mechanics.geometry.facets import boundary
from echotruth.mechanics.quadrature import tetrahedron
from echotruth.tetrahedra import EDGES, Floats, Integers, Mesh, shape

Counts = tuple[int, int, int]


@dataclass(frozen=True)
class Body:
    """A lattice laid through a body.

    Attributes
    ----------
    mesh : Mesh
        Its endocardium is the side at which the first parameter is 0, its base that at which the third is 1.
    parameters : ndarray of shape (n_nodes, 3)
        Of the nodes, from 0 to 1.
    """

    mesh: Mesh
    parameters: Floats

    def side(self, axis: int, value: float) -> Integers:
        """Nodes at which a parameter is 0 or 1."""
        return np.nonzero(self.parameters[:, axis] == value)[0]

    def places(self) -> tuple[Floats, Floats]:
        """Unloaded places (n_cells, n_points, 3), m, and volumes (n_cells, n_points), m^3, of the quadrature points."""
        xi, weight = tetrahedron()
        places = np.einsum("qa,cai->cqi", shape(xi), self.mesh.nodes[self.mesh.cells])
        return places, gradients(self.mesh, xi)[1] * weight

    def rms(self, displacement: Floats, exact: Callable[[Floats], Floats]) -> float:
        """Root of the mean squared difference of a displacement (n_nodes, 3), m, from that of points (..., 3), over
        that of the latter itself."""
        places, volume = self.places()
        expected = exact(places)
        found = np.einsum("qa,cai->cqi", shape(tetrahedron()[0]), displacement[self.mesh.cells])
        squares = (np.sum(each**2 * volume[..., None]) for each in (found - expected, expected))
        return float(np.sqrt(np.divide(*squares)))


def body(counts: Counts, place: Callable[[Floats], Floats], around: bool = False) -> Body:
    """A lattice of boxes, each cut into six tetrahedra (Kuhn, 1960).

    Parameters
    ----------
    counts : tuple of int
        Boxes along each parameter.
    place : callable
        Parameters (n_nodes, 3), from 0 to 1, to positions (n_nodes, 3), m; right-handed.
    around : bool
        Whether the second parameter closes upon itself.
    """
    cells, parameters = _lattice(counts, around)
    facets, _ = boundary(cells)
    at = parameters[facets]
    sides = [np.all(at[..., axis] == value, axis=1) for axis, value in ((0, 0.0), (0, 1.0), (2, 1.0))]
    return Body(Mesh(place(parameters), cells, *(facets[side] for side in sides)), parameters)


def bar(counts: Counts, lengths: tuple[float, float, float]) -> Body:
    """A bar of given lengths along x, y and z, m."""
    return body(counts, lambda parameters: parameters * np.array(lengths))


def tube(counts: Counts, inner: float, outer: float, length: float) -> Body:
    """A tube about z of given radii, m, from z = -length to 0; boxes through the wall, around it and along it."""

    def place(parameters: Floats) -> Floats:
        radius, turn = inner + (outer - inner) * parameters[:, 0], 2 * np.pi * parameters[:, 1]
        return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), length * (parameters[:, 2] - 1)])

    return body(counts, place, around=True)


def sphere_piece(counts: Counts, inner: float, outer: float) -> Body:
    """One of 24 equal pieces of a thick sphere, between the planes y = 0, z = 0, y = x and z = x."""

    def place(parameters: Floats) -> Floats:
        radius, angles = inner + (outer - inner) * parameters[:, :1], np.tan(np.pi / 4 * parameters[:, 1:])
        along = np.column_stack([np.ones(len(angles)), angles])
        return radius * along / np.linalg.norm(along, axis=1, keepdims=True)

    return body(counts, place)


def _lattice(counts: Counts, around: bool) -> tuple[Integers, Floats]:
    """Cells (n_cells, 10) and parameters (n_nodes, 3): all corners, and all points halfway between corners."""
    halves = 2 * np.array(counts)
    points = halves + [1, 0 if around else 1, 1]
    corner = 2 * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    cells = []
    for order in permutations(range(3)):
        steps = np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
        if round(np.linalg.det(np.eye(3)[list(order)])) < 0:
            steps[[1, 2]] = steps[[2, 1]]
        vertices = corner + 2 * steps
        middles = (vertices[:, EDGES[:, 0]] + vertices[:, EDGES[:, 1]]) // 2
        cells.append(np.concatenate([vertices, middles], axis=1) % (points if around else points + 1))
    numbers = np.arange(np.prod(points)).reshape(points)
    indices = np.stack(np.unravel_index(numbers.ravel(), points), axis=-1)
    return numbers[tuple(np.moveaxis(np.concatenate(cells), -1, 0))].astype(np.int32), indices / halves
