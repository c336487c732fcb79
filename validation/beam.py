"""Problem 1 of Land et al. 2015: a beam bent by a pressure that follows its underside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Floats, Integers
from echotruth.materials import LAWS
from echotruth.mechanics.solver import cavity, element
from echotruth.mechanics.solver.assembly import ENDO
from echotruth.mechanics.solver.equilibrium import Equilibrium, Imbalance, Load, State, Unknown, norm
from echotruth.mechanics.solver.support import Support
from echotruth.report import style
from validation import bodies
from validation.energies import Wall
from validation.report import Report, Row

LENGTHS = (1e-3, 10e-3, 1e-3)
"""Height, length and width, m."""

WALL = Wall(LAWS["fung"].Law(fibre=8.0, transverse=2.0, shear=4.0), 2e3, bulk=1e6)
PRESSURE = 4.0
"""Pa."""

LOADS = 12
"""Equal steps of the pressure."""

TIP = 4.18e-3
"""Height, m, of the tip: the participants agree on about 4.17 to 4.19 mm."""


@dataclass(frozen=True)
class Numbers:
    """Refinement of the beam.

    Attributes
    ----------
    cells : tuple of int
        Of each mesh.
    tip : tuple of float, m
        Height of the middle of the upper edge of the free end.
    line : ndarray of shape (n, 2), m
        Distance from the clamp and height of the middle line, deformed, of the finest mesh.
    """

    cells: tuple[int, ...]
    tip: tuple[float, ...]
    line: Floats


class Underside(Equilibrium):
    """A body with a pressure on a surface whose rim moves.

    Its force is the gradient of a volume, as in a heart, only where the rim stays in a plane; here it is
    integrated as it stands. It has no potential, so that the tangent, which is symmetric, is not quite its own.
    """

    def _imbalance(self, state: State, load: Load, unknown: Unknown, out: element.Blocks) -> Imbalance:
        found = super()._imbalance(state, load, unknown, out)
        nodes, facets = self.positions(state, load.moved), self.mesh.endo
        push = load.pressure * self.assembly.vector(thrust(nodes, facets), ENDO)
        force = found.force + load.pressure * self.assembly.vector(cavity.load(nodes, facets), ENDO) - push
        return replace(found, force=force, force_error=norm(force) / (norm(push) or 1.0))


def thrust(nodes: Floats, facets: Integers) -> Floats:
    """Forces of a unit pressure on facets, node by node.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Deformed.
    facets : ndarray of shape (n_facets, 6)
        Their normals point out of the body.

    Returns
    -------
    ndarray of shape (n_facets, 6, 3), m^2
    """
    xi, weight = triangle()
    value, slope = cavity.triangle_shape(xi)
    first, second = (np.einsum("qa,fai->fqi", slope[..., k], nodes[facets]) for k in (0, 1))
    return -np.einsum("q,qa,fqi->fai", weight, value, np.cross(first, second))


def measure(quick: bool = False) -> Numbers:
    """The beam on meshes of 1, 2 and, unless it is to be quick, 3 boxes across."""
    solved = [bent((n, 20 * n, n)) for n in ((1, 2) if quick else (1, 2, 3))]
    cells, tip, lines = zip(*solved, strict=True)
    return Numbers(cells, tip, lines[-1])


def bent(counts: bodies.Counts) -> tuple[int, float, Floats]:
    """Cells, height of the tip, m, and middle line (n, 2), m, of a beam of some boxes in height, length and width."""
    # The lattice loads the side at which its first parameter is 0, so that is the height: z, x, y are right-handed.
    body = bodies.bar(counts, LENGTHS)
    mesh = replace(body.mesh, nodes=body.mesh.nodes[:, [1, 2, 0]])
    free = np.ones(mesh.nodes.shape, dtype=bool)
    free[body.side(1, 0.0)] = False
    frames = np.broadcast_to(np.eye(3), (len(mesh.cells), 14, 3, 3))
    beam = Underside(mesh, frames, WALL.law(), Support(np.tile(np.eye(3), (len(free), 1, 1)), free))
    positions = beam.positions(_newton(beam))
    beam.close()
    height, along, width = body.parameters.T
    tip = positions[(height == 1) & (along == 1) & (width == 0.5), 2]
    line = positions[(height == 0.5) & (width == 0.5)][:, [0, 2]]
    return len(mesh.cells), float(tip[0]), line[np.argsort(line[:, 0])]


def _newton(beam: Underside) -> State:
    """The bent state, by whole steps: what bends stretches on the way, and a search along the step would stop it."""
    state = beam.rest(WALL.stiffness)
    for pressure in PRESSURE * np.arange(1, LOADS + 1) / LOADS:
        load = Load(float(pressure), 1.0)
        for _ in range(20):
            step = beam.linearize(state, load, None).correction(beam.imbalance(state, load, None))
            state = state.moved(step, 1.0, None)
            if step.size < 1e-7 * norm(state.solution):
                break
    return state


def report(numbers: Numbers) -> Report:
    """Rows of the page."""
    source = "Land et al. 2015, about 4.17 to 4.19 mm; allowed 0.5 %, by which the participants differ"
    rows, finest = [], numbers.cells[-1]
    for cells, tip in zip(numbers.cells, numbers.tip, strict=True):
        allowed = 0.005 * TIP * 1e3 if cells == finest else None
        rows.append(Row(f"height of the tip, {cells} cells (mm)", tip * 1e3, TIP * 1e3, allowed, source))
    text = (
        "A beam of 10 x 1 x 1 mm with fibres along it, held at one end, bends under a pressure of 4 Pa that follows "
        "its underside. The tip is the middle of the upper edge of the free end."
    )
    caption = "Middle line of the beam, finest mesh, true to scale."
    return Report("A bent beam (Land problem 1)", text, tuple(rows), caption)


@style.styled
def draw(numbers: Numbers) -> Figure:
    """The middle line of the beam."""
    sheet = style.figure(6.4, 3.0)
    axes = sheet.add_subplot()
    axes.plot([0, 10], [0.5, 0.5], color=style.ASKED, label="unloaded")
    axes.plot(*numbers.line.T * 1e3, color=style.MET, label="bent")
    axes.set(xlabel="distance from the clamp (mm)", ylabel="height (mm)", aspect="equal", ylim=(0, 4.6))
    axes.legend(loc="upper left")
    return sheet
