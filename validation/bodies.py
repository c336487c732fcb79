"""Bodies of quadratic tetrahedra in a lattice: bars, tubes and pieces of a sphere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Integers, Mesh, shape
from echotruth.mechanics.fibres import gradients
from echotruth.mechanics.geometry.lattice import Counts, Place, lattice, tubular


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


def body(counts: Counts, place: Place, around: bool = False) -> Body:
    """A lattice laid through a body; the arguments are those of `lattice`."""
    return Body(*lattice(counts, place, around))


def bar(counts: Counts, lengths: tuple[float, float, float]) -> Body:
    """A bar of given lengths along x, y and z, m."""
    return body(counts, lambda parameters: parameters * np.array(lengths))


def tube(counts: Counts, inner: float, outer: float, length: float) -> Body:
    """A tube about z of given radii, m, from z = -length to 0; boxes through the wall, around it and along it."""
    return body(counts, tubular(inner, outer, length), around=True)


def sphere_piece(counts: Counts, inner: float, outer: float) -> Body:
    """One of 24 equal pieces of a thick sphere, between the planes y = 0, z = 0, y = x and z = x."""

    def place(parameters: Floats) -> Floats:
        radius, angles = inner + (outer - inner) * parameters[:, :1], np.tan(np.pi / 4 * parameters[:, 1:])
        along = np.column_stack([np.ones(len(angles)), angles])
        return radius * along / np.linalg.norm(along, axis=1, keepdims=True)

    return body(counts, place)
