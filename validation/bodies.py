"""Bodies meshed with a lattice of quadratic tetrahedra - bars, tubes, pieces of a sphere - and integrals over them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.fem.quadrature import tetrahedron, triangle
from echotruth.fem.tetrahedra import Floats, Integers, Mesh, shape, shape_gradient
from echotruth.mechanics.fibres import material_gradients, unit
from echotruth.mechanics.geometry.lattice import Counts, lattice, tube_map
from echotruth.mechanics.solver.support import Support


@dataclass(frozen=True)
class LatticeBody:
    """A body meshed with a lattice.

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

    def quadrature_points(self) -> tuple[Floats, Floats]:
        """Unloaded positions (n_cells, n_points, 3), m, of the quadrature points, and their volumes, m^3."""
        return quadrature_positions(self.mesh), material_gradients(self.mesh, tetrahedron()[0])[1] * tetrahedron()[1]

    def relative_rms_error(self, displacement: Floats, exact: Callable[[Floats], Floats]) -> float:
        """Root mean square error of a displacement (n_nodes, 3), m, over that of the exact one, a function of
        positions (..., 3), m."""
        positions, volume = self.quadrature_points()
        expected = exact(positions)
        solved = np.einsum("qa,cai->cqi", shape(tetrahedron()[0]), displacement[self.mesh.cells])
        squares = (np.sum(values**2 * volume[..., None]) for values in (solved - expected, expected))
        return float(np.sqrt(np.divide(*squares)))


def quadrature_positions(mesh: Mesh) -> Floats:
    """Positions of the quadrature points, (n_cells, n_points, 3), m."""
    return np.einsum("qa,cai->cqi", shape(tetrahedron()[0]), mesh.nodes[mesh.cells])


def nodal_area_vectors(nodes: Floats, facets: Integers) -> Floats:
    """Integrals of shape function times normal over quadratic triangles (n_facets, 6) with nodes (n_nodes, 3), m.

    Shape (n_facets, 6, 3), m^2; with normals out of the body, minus the nodal forces of a unit pressure.
    """
    xi, weight = triangle()
    value, slope = shape(xi), shape_gradient(xi)
    first, second = (np.einsum("qa,fai->fqi", slope[..., k], nodes[facets]) for k in (0, 1))
    return np.einsum("q,qa,fqi->fai", weight, value, np.cross(first, second))


def cartesian_support(free: NDArray[np.bool_], prescribed: Floats | None = None) -> Support:
    """Support of nodes along x, y and z: whether each is free, and the prescribed displacement, both (n_nodes, 3)."""
    return Support(np.tile(np.eye(3), (len(free), 1, 1)), free, prescribed=prescribed)


def cylindrical_axes(positions: Floats) -> Floats:
    """Radial, circumferential and axial direction, rows (..., 3, 3), at positions (..., 3)."""
    radial = unit(positions * [1, 1, 0])
    axial = np.broadcast_to([0.0, 0.0, 1.0], radial.shape)
    return np.stack([radial, np.cross(axial, radial), axial], axis=-2)


def bar(counts: Counts, lengths: tuple[float, float, float]) -> LatticeBody:
    """A bar of given lengths along x, y and z, m."""
    return LatticeBody(*lattice(counts, lambda parameters: parameters * np.array(lengths)))


def tube(counts: Counts, inner: float, outer: float, length: float) -> LatticeBody:
    """A tube about z of given radii, m, from z = -length to 0; boxes through the wall, around it and along it."""
    return LatticeBody(*lattice(counts, tube_map(inner, outer, length), periodic=True))


def sphere_piece(counts: Counts, inner: float, outer: float) -> LatticeBody:
    """One of 24 equal pieces of a thick sphere, between the planes y = 0, z = 0, y = x and z = x."""

    def position(parameters: Floats) -> Floats:
        radius, angles = inner + (outer - inner) * parameters[:, :1], np.tan(np.pi / 4 * parameters[:, 1:])
        direction = np.column_stack([np.ones(len(angles)), angles])
        return radius * direction / np.linalg.norm(direction, axis=1, keepdims=True)

    return LatticeBody(*lattice(counts, position))
