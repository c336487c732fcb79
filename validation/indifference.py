"""What must not matter: where the heart points, and how its mesh is numbered."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echotruth.config import Fibres, Geometry, Mechanics
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import EDGES, Floats, Integers, Mesh
from echotruth.mechanics.fibres import fibre_frames, wall_depth
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
from echotruth.mechanics.solver.newton import Walk
from echotruth.mechanics.solver.support import Support, of_base
from echotruth.mechanics.solver.wall import law
from validation.report import Report, Row

LOAD = Load(8e3, 1.0, tension=2e4)
"""Pressure and active tension, Pa, of a heart that ejects."""

STIFFNESS = 1.1e3
"""Pa."""

EVEN = np.array([(0, 1, 2, 3), (1, 2, 0, 3), (3, 0, 2, 1), (1, 0, 3, 2)])
"""Orders of the vertices of a tetrahedron that keep its hand."""


@dataclass(frozen=True)
class Numbers:
    """Largest differences of the motion, over the largest motion.

    Attributes
    ----------
    turned, renumbered, reordered : float
        Of a heart that is turned, one whose nodes and cells are shuffled, and one whose cells name their vertices in
        another order.
    cells : int
    """

    turned: float
    renumbered: float
    reordered: float
    cells: int


def measure(quick: bool = False) -> Numbers:
    """Differences from one heart, solved as it is, of 720 cells or of 360 where it is to be quick."""
    counts = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1 if quick else 2}
    mesh, rng = left_ventricle(Geometry(**counts)), np.random.default_rng(6)
    frames = fibre_frames(mesh, wall_depth(mesh), Fibres(), tetrahedron()[0])
    support = of_base(mesh, "radial_free")
    moved = _solved(mesh, frames, support)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    turned = _solved(
        replace(mesh, nodes=mesh.nodes @ turn.T), frames @ turn.T, replace(support, frames=support.frames @ turn.T)
    )
    order, cells = rng.permutation(len(mesh.nodes)), rng.permutation(len(mesh.cells))
    shuffled = replace(support, frames=support.frames[order], free=support.free[order])
    renumbered = _solved(_renumbered(mesh, order, cells), frames[cells], shuffled)
    reordered = _solved(*_reordered(mesh, frames, rng), support)
    return Numbers(
        _difference(turned @ turn, moved),
        _difference(renumbered, moved[order]),
        _difference(reordered, moved),
        len(mesh.cells),
    )


def _solved(mesh: Mesh, frames: Floats, support: Support) -> Floats:
    """Displacement (n_nodes, 3), m."""
    heart = Equilibrium(mesh, frames, law(Mechanics()), support)
    positions = heart.positions(Walk(heart, STIFFNESS).to(LOAD, None))
    heart.close()
    return positions - mesh.nodes


def _difference(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())


def _renumbered(mesh: Mesh, order: Integers, cells: Integers) -> Mesh:
    """The mesh with its nodes and its cells in another order."""
    number = np.argsort(order).astype(np.int32)
    sides = {side: number[getattr(mesh, side)] for side in ("endo", "epi", "base")}
    return replace(mesh, nodes=mesh.nodes[order], cells=number[mesh.cells[cells]], **sides)


def _reordered(mesh: Mesh, frames: Floats, rng: np.random.Generator) -> tuple[Mesh, Floats]:
    """The mesh with the vertices of its cells in another order, and its fibres at the points where these then lie."""
    edge = {frozenset(pair): 4 + k for k, pair in enumerate(EDGES.tolist())}
    xi = np.column_stack([1 - tetrahedron()[0].sum(axis=1), tetrahedron()[0]])
    cells, fibres = mesh.cells.copy(), frames.copy()
    for cell, pick in enumerate(rng.integers(len(EVEN), size=len(cells))):
        vertices = EVEN[pick]
        whole = [*vertices, *(edge[frozenset(vertices[pair].tolist())] for pair in EDGES)]
        cells[cell] = mesh.cells[cell, whole]
        # The point with coordinate xi_k at the new vertex k is the old one with it at the old vertex.
        back = xi[:, np.argsort(vertices)]
        same = np.argmin(np.linalg.norm(xi[None] - back[:, None], axis=-1), axis=1)
        fibres[cell] = frames[cell, same]
    return replace(mesh, cells=cells), fibres


def report(numbers: Numbers) -> Report:
    """Rows of the page."""
    source = f"the same heart, {numbers.cells} cells, as it is; solved to a relative imbalance of 1e-8"
    rows = tuple(
        Row(f"largest difference of the motion, {name}", value, None, 1e-7, source, ".1e")
        for name, value in (
            ("turned in space", numbers.turned),
            ("nodes and cells shuffled", numbers.renumbered),
            ("vertices of the cells in another order", numbers.reordered),
        )
    )
    text = "A heart that contracts against a pressure, turned in space and numbered in other ways; over its motion."
    return Report("What must not matter", text, rows)
