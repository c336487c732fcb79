"""Lattices of boxes, each cut into six quadratic tetrahedra and laid through a body."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np

from echotruth.fem.tetrahedra import EDGES, Floats, Integers, Mesh
from echotruth.mechanics.geometry.boundary import boundary

Counts = tuple[int, int, int]
Place = Callable[[Floats], Floats]
"""Parameters (n_nodes, 3), from 0 to 1, to positions (n_nodes, 3), m; right-handed."""


def lattice(counts: Counts, place: Place, around: bool = False) -> tuple[Mesh, Floats]:
    """A lattice of boxes, each cut into six tetrahedra (Kuhn, 1960).

    Parameters
    ----------
    counts : tuple of int
        Boxes along each parameter.
    place : callable
        See `Place`.
    around : bool
        Whether the second parameter closes upon itself.

    Returns
    -------
    mesh : Mesh
        Its endocardium is the side at which the first parameter is 0, its epicardium that at which it is 1, its base
        that at which the third is 1.
    parameters : ndarray of shape (n_nodes, 3)
    """
    cells, parameters = _cut(counts, around)
    facets, _ = boundary(cells)
    at = parameters[facets]
    sides = [np.all(at[..., axis] == value, axis=1) for axis, value in ((0, 0.0), (0, 1.0), (2, 1.0))]
    return Mesh(place(parameters), cells, *(facets[side] for side in sides)), parameters


def tubular(inner: float, outer: float, length: float) -> Place:
    """Place of a tube about z of given radii, m, from z = -length to 0; through the wall, around it and along it."""

    def place(parameters: Floats) -> Floats:
        radius, turn = inner + (outer - inner) * parameters[:, 0], 2 * np.pi * parameters[:, 1]
        return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), length * (parameters[:, 2] - 1)])

    return place


def _cut(counts: Counts, around: bool) -> tuple[Integers, Floats]:
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
