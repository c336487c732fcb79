"""Invariance of the solution under rotation of the heart and renumbering of its mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echotruth.config import Fibres, Geometry, Mechanics
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import EDGES, Floats, Integers, Mesh
from echotruth.mechanics.fibres import fibre_frames, wall_depth
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
from echotruth.mechanics.solver.newton import LoadStepper
from echotruth.mechanics.solver.support import Support, base_support
from echotruth.mechanics.solver.wall import wall_law
from validation.report import Report, Row

LOAD = Load(8e3, 1.0, tension=2e4)
"""Pressure and active tension, Pa, of a heart that ejects."""

STIFFNESS = 1.1e3
"""Pa."""

EVEN_PERMUTATIONS = np.array([(0, 1, 2, 3), (1, 2, 0, 3), (3, 0, 2, 1), (1, 0, 3, 2)])
"""Of the vertices of a tetrahedron: they keep it right-handed."""


@dataclass(frozen=True)
class Results:
    """Largest differences of the displacement, over the largest displacement.

    Attributes
    ----------
    rotated, renumbered, reordered : float
        Of a heart that is rotated, one whose nodes and cells are shuffled, and one whose cells list their vertices in
        another order.
    cells : int
    """

    rotated: float
    renumbered: float
    reordered: float
    cells: int


def measure(quick: bool = False) -> Results:
    """Differences from one heart, solved as it is, coarse if `quick`."""
    around, along, through = (6, 4, 1) if quick else (12, 6, 2)
    counts = {
        "circumferential_elements": around,
        "longitudinal_elements": along,
        "transmural_elements": through,
    }
    mesh, rng = left_ventricle(Geometry(**counts)), np.random.default_rng(6)
    frames = fibre_frames(mesh, wall_depth(mesh), Fibres(), tetrahedron()[0])
    support = base_support(mesh, "radial_free")
    reference = _solve(mesh, frames, support)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    rotated_support = replace(support, directions=support.directions @ rotation.T)
    rotated = _solve(replace(mesh, nodes=mesh.nodes @ rotation.T), frames @ rotation.T, rotated_support)
    order, cells = rng.permutation(len(mesh.nodes)), rng.permutation(len(mesh.cells))
    shuffled = replace(support, directions=support.directions[order], free=support.free[order])
    renumbered = _solve(_renumbered(mesh, order, cells), frames[cells], shuffled)
    reordered = _solve(*_reordered(mesh, frames, rng), support)
    return Results(
        _difference(rotated @ rotation, reference),
        _difference(renumbered, reference[order]),
        _difference(reordered, reference),
        len(mesh.cells),
    )


def _solve(mesh: Mesh, frames: Floats, support: Support) -> Floats:
    """Displacement (n_nodes, 3), m."""
    equilibrium = Equilibrium(mesh, frames, wall_law(Mechanics()), support)
    positions = equilibrium.positions(LoadStepper(equilibrium, STIFFNESS).advance(LOAD, None))
    equilibrium.close()
    return positions - mesh.nodes


def _difference(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())


def _renumbered(mesh: Mesh, order: Integers, cells: Integers) -> Mesh:
    """The mesh with its nodes and its cells in another order."""
    number = np.argsort(order).astype(np.int32)
    sides = {side: number[getattr(mesh, side)] for side in ("endo", "epi", "base")}
    return replace(mesh, nodes=mesh.nodes[order], cells=number[mesh.cells[cells]], **sides)


def _reordered(mesh: Mesh, frames: Floats, rng: np.random.Generator) -> tuple[Mesh, Floats]:
    """The mesh with the vertices of its cells in another order, and the fibres at its quadrature points."""
    edge = {frozenset(pair): 4 + k for k, pair in enumerate(EDGES.tolist())}
    xi = np.column_stack([1 - tetrahedron()[0].sum(axis=1), tetrahedron()[0]])
    cells, reordered = mesh.cells.copy(), frames.copy()
    for cell, pick in enumerate(rng.integers(len(EVEN_PERMUTATIONS), size=len(cells))):
        vertices = EVEN_PERMUTATIONS[pick]
        nodes = [*vertices, *(edge[frozenset(vertices[pair].tolist())] for pair in EDGES)]
        cells[cell] = mesh.cells[cell, nodes]
        # The point with coordinate xi_k at the new vertex k is the old one with it at the old vertex.
        back = xi[:, np.argsort(vertices)]
        same = np.argmin(np.linalg.norm(xi[None] - back[:, None], axis=-1), axis=1)
        reordered[cell] = frames[cell, same]
    return replace(mesh, cells=cells), reordered


def report(results: Results) -> Report:
    """Rows of the page."""
    source = f"the same heart, {results.cells} cells"
    rows = tuple(
        Row(f"largest difference of the motion, {name}", value, None, 1e-7, source, ".1e")
        for name, value in (
            ("rotated in space", results.rotated),
            ("nodes and cells shuffled", results.renumbered),
            ("vertices of the cells in another order", results.reordered),
        )
    )
    text = (
        "A heart that contracts against a pressure, rotated in space and numbered in other ways; over its motion, "
        "which is solved to a relative residual of 1e-8."
    )
    return Report("Invariance under rotation and renumbering", text, rows)
