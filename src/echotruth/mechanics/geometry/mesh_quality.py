"""Shape and orientation of tetrahedra, and the checks that a ventricle must pass to be solved."""

import numpy as np

from echotruth.fem.tetrahedra import Floats, Integers, Mesh
from echotruth.fem.volume import jacobians
from echotruth.mechanics.solver.cavity import cavity_volume

CAVITY_VOLUMES = (0.1e-9, 5e-3)
"""Smallest and largest volume of a cavity, m^3: from 0.1 uL, an embryo's, to 5 L, an elephant's."""

MIN_SCALED_JACOBIAN = 0.02
"""Smallest scaled Jacobian of a tetrahedron, 1 for the regular one; 0.1 is poor, 0 is flat
(Knupp, Finite Elem Anal Des 39 (2003) 217)."""

_MIRRORED = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
"""Order of the nodes of a tetrahedron with its vertices 1 and 2 swapped."""


class GeometryError(ValueError):
    """Raised if a ventricle cannot be meshed."""


def straight_volumes(nodes: Floats, cells: Integers) -> Floats:
    """Signed volumes (b - a) x (c - a) . (d - a) / 6 of the straight tetrahedra abcd, shape (n_cells,), m^3."""
    a, b, c, d = (nodes[cells[:, i]] for i in range(4))
    return np.einsum("ci,ci->c", np.cross(b - a, c - a), d - a) / 6


def right_handed(nodes: Floats, cells: Integers) -> Integers:
    """Cells (n_cells, 4 or 10) with two vertices swapped where they are left-handed."""
    cells = cells.copy()
    left = straight_volumes(nodes, cells) < 0
    cells[left] = cells[left][:, _MIRRORED[: cells.shape[1]]]
    return cells


def scaled_jacobian(nodes: Floats, cells: Integers) -> Floats:
    """Shape of the straight tetrahedra between the vertices.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 4 or more)
        The first four nodes of a cell are its vertices.

    Returns
    -------
    ndarray of shape (n_cells,)
        sqrt(2) times six times the volume, over the largest product of the three edges at a vertex: 1 for the
        regular tetrahedron, 0 for a flat one, negative for an inverted one.
    """
    corner = nodes[cells[:, :4]]
    edge = corner[:, :, None] - corner[:, None]
    length = np.linalg.norm(edge, axis=-1)
    product = np.max([np.prod([length[:, i, j] for j in range(4) if j != i], axis=0) for i in range(4)], axis=0)
    volume = np.einsum("ci,ci->c", np.cross(edge[:, 1, 0], edge[:, 2, 0]), edge[:, 3, 0])
    return np.sqrt(2) * volume / np.maximum(product, np.finfo(float).tiny)


def check_inverted(mesh: Mesh, source: str, remedy: str) -> None:
    """Refuse inverted tetrahedra; `source` and `remedy` begin and end the sentence."""
    inverted = np.count_nonzero(jacobians(mesh.nodes, mesh.cells).min(axis=1) <= 0)
    if inverted:
        raise GeometryError(f"{source}: {inverted} of {len(mesh.cells)} tetrahedra of the wall are inverted: {remedy}")


def check_flat(mesh: Mesh, source: str, remedy: str) -> None:
    """Refuse tetrahedra that are nearly flat."""
    flat = np.count_nonzero(scaled_jacobian(mesh.nodes, mesh.cells) < MIN_SCALED_JACOBIAN)
    if flat:
        raise GeometryError(
            f"{source}: {flat} of {len(mesh.cells)} tetrahedra of the wall are flat (scaled Jacobian below "
            f"{MIN_SCALED_JACOBIAN:g}): {remedy}"
        )


def check_cavity(mesh: Mesh, source: str, remedy: str) -> None:
    """Refuse a cavity of a volume that no heart has."""
    volume = cavity_volume(mesh.nodes, mesh.endo)
    if not CAVITY_VOLUMES[0] <= volume <= CAVITY_VOLUMES[1]:
        raise GeometryError(f"{source}: the cavity holds {format_volume(volume)}, which no heart does: {remedy}")


def format_volume(volume: float) -> str:
    """Volume, m^3, in L, mL or uL."""
    for size, name in ((1e-3, "L"), (1e-6, "mL")):
        if abs(volume) >= size:
            return f"{volume / size:.3g} {name}"
    return f"{volume / 1e-9:.3g} uL"
