"""Problem 1 of Land et al. 2015: a beam bent by a follower pressure on its underside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from echotruth.fem.tetrahedra import Floats
from echotruth.materials import LAWS
from echotruth.mechanics.solver import cavity, element
from echotruth.mechanics.solver.assembly import ENDO
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, Residual, State, Unknown, norm
from echotruth.report import style
from validation import bodies
from validation.energies import ConstitutiveModel
from validation.report import Report, Row

LENGTHS = (1e-3, 10e-3, 1e-3)
"""Height, length and width, m."""

MODEL = ConstitutiveModel(LAWS["fung"].Law(fibre=8.0, transverse=2.0, shear=4.0), 2e3, bulk=1e6)
PRESSURE = 4.0
"""Pa."""

LOAD_STEPS = 6
"""Equal steps of the pressure."""

TIP_HEIGHT = 4.18e-3
"""m; the participants agree on about 4.17 to 4.19 mm."""


@dataclass(frozen=True)
class Results:
    """Refinement of the beam.

    Attributes
    ----------
    cells : tuple of int
        Of each mesh.
    tip : tuple of float, m
        Height of the middle of the upper edge of the free end.
    line : ndarray of shape (n, 2), m
        Distance from the clamp and height of the middle of the upper side, deformed, of the finest mesh.
    """

    cells: tuple[int, ...]
    tip: tuple[float, ...]
    line: Floats


class FollowerPressureBody(Equilibrium):
    """A body with a pressure on a surface whose rim moves.

    The force of the pressure is the gradient of a volume, as in a heart, only where the rim stays in a plane; here it
    is integrated over the surface. It has no potential, so that the symmetric tangent is only an approximation.
    """

    def _residual(self, state: State, load: Load, unknown: Unknown, response: element.Response) -> Residual:
        residual = super()._residual(state, load, unknown, response)
        nodes, facets = self.positions(state, load.prescribed_fraction), self.mesh.endo
        external = load.pressure * self.assembly.vector(-bodies.nodal_area_vectors(nodes, facets), ENDO)
        gradient = self.assembly.vector(cavity.volume_gradient(nodes, facets), ENDO)
        force = residual.force + load.pressure * gradient - external
        return replace(residual, force=force, force_error=norm(force) / (norm(external) or 1.0))


def measure(quick: bool = False) -> Results:
    """Solve the beam on meshes of 1, 2 and, unless `quick`, 3 boxes across."""
    solved = [solve_beam((n, 20 * n, n)) for n in ((1, 2) if quick else (1, 2, 3))]
    cells, tip, lines = zip(*solved, strict=True)
    return Results(cells, tip, lines[-1])


def solve_beam(counts: bodies.Counts) -> tuple[int, float, Floats]:
    """Cells, height of the tip, m, and upper side (n, 2), m, of a beam of boxes in height, length and width."""
    # The pressure acts where the first parameter is 0, so that is the height: z, x, y are right-handed.
    body = bodies.bar(counts, LENGTHS)
    mesh = replace(body.mesh, nodes=body.mesh.nodes[:, [1, 2, 0]])
    free = np.ones(mesh.nodes.shape, dtype=bool)
    free[body.side(1, 0.0)] = False
    frames = np.broadcast_to(np.eye(3), (len(mesh.cells), 14, 3, 3))
    beam = FollowerPressureBody(mesh, frames, MODEL.law(), bodies.cartesian_support(free))
    positions = beam.positions(_newton(beam))
    beam.close()
    height, along, width = body.parameters.T
    tip = positions[(height == 1) & (along == 1) & (width == 0.5), 2]
    line = positions[(height == 1) & (width == 0.5)][:, [0, 2]]
    return len(mesh.cells), float(tip[0]), line[np.argsort(line[:, 0])]


def _newton(beam: FollowerPressureBody) -> State:
    """Bent state by full Newton steps: a line search would stop where the beam stretches on its way to bending."""
    state = beam.unloaded_state(MODEL.stiffness)
    for pressure in PRESSURE * np.arange(1, LOAD_STEPS + 1) / LOAD_STEPS:
        load = Load(float(pressure), 1.0)
        for _ in range(20):
            step = beam.linearize(state, load, None).correction(beam.residual(state, load, None))
            state = state.corrected(step, 1.0, None)
            if step.norm < 1e-7 * norm(state.solution):
                break
    return state


def report(results: Results) -> Report:
    """Rows of the page."""
    source = "Land et al. 2015: 4.17 to 4.19 mm"
    rows, finest = [], results.cells[-1]
    for cells, tip in zip(results.cells, results.tip, strict=True):
        allowed = 0.005 * TIP_HEIGHT * 1e3 if cells == finest else None
        rows.append(Row(f"height of the tip, {cells} cells (mm)", tip * 1e3, TIP_HEIGHT * 1e3, allowed, source))
    text = (
        "A beam of 10 x 1 x 1 mm with fibres along it, held at one end, bends under a pressure of 4 Pa that follows "
        "its underside. The tip is the middle of the upper edge of the free end. Allowed is 0.5 %, by which the "
        "participants differ."
    )
    caption = "Upper side of the beam, finest mesh, true to scale, and the height of its tip in the paper."
    return Report("A bent beam (Land problem 1)", text, tuple(rows), caption)


@style.styled
def draw(results: Results) -> Figure:
    """The upper side of the beam, and the height of its tip that the participants found."""
    figure = style.figure(6.4, 3.0)
    axes = figure.add_subplot()
    axes.plot([0, 10], [1, 1], color=style.TARGET, label="unloaded")
    axes.axhline(TIP_HEIGHT * 1e3, color="black", linestyle=":", label="tip, Land et al. 2015")
    axes.plot(*results.line.T * 1e3, color=style.SOLVED, label="bent")
    axes.set(xlabel="distance from the clamp (mm)", ylabel="height (mm)", aspect="equal", ylim=(0, 4.6))
    axes.legend(loc="center left")
    return figure
