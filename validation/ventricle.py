"""Problems 2 and 3 of Land et al. 2015: a truncated ellipsoid inflated, and inflated while it contracts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from echotruth.config import Fibres, Geometry
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.materials import LAWS
from echotruth.mechanics import fibres
from echotruth.mechanics.fibres import unit
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
from echotruth.mechanics.solver.newton import LoadStepper
from echotruth.mechanics.solver.support import base_support
from echotruth.report import style
from validation import bodies
from validation.energies import ConstitutiveModel
from validation.meridian import AxisymmetricBody
from validation.report import Report, Row

RADIUS, LENGTH, THICKNESS, BASE = 7e-3, 17e-3, 3e-3, 5e-3
"""Semi-axes of the endocardium, thickness of the wall and height of the base above the equator, m."""

ISOTROPIC = ConstitutiveModel(LAWS["fung"].Law(fibre=1.0, transverse=1.0, shear=1.0), 10e3, bulk=1e8)
CONTRACTING = ConstitutiveModel(
    LAWS["fung"].Law(fibre=8.0, transverse=2.0, shear=4.0), 2e3, 60e3, beta=0.0, power=0.0, bulk=1e8
)
PRESSURE = 10e3, 15e3
"""Of problems 2 and 3, Pa."""


def ellipsoid(around: int, along: int, through: int) -> Mesh:
    """The ventricle of both problems; its base lies at z = 0, which is 5 mm in the paper."""
    size = {"endo_radius_mm": RADIUS, "endo_length_mm": LENGTH, "base_mm": BASE}
    size |= {"wall_mm": THICKNESS, "apex_wall_mm": THICKNESS}
    counts = {"circumferential_elements": around, "longitudinal_elements": along, "transmural_elements": through}
    return left_ventricle(Geometry(**{key: value * 1e3 for key, value in size.items()}, **counts))


def paper_depth(radius: Floats, height: Floats) -> Floats:
    """Parameter t of the ellipsoid of semi-axes 7 + 3 t and 17 + 3 t mm through points of the wall, by Newton's method.

    Parameters
    ----------
    radius, height : ndarray of any shape, m
        From the axis, and above the equator.
    """
    t = np.full(np.shape(radius), 0.5)
    for _ in range(30):
        across, along = RADIUS + THICKNESS * t, LENGTH + THICKNESS * t
        excess = (radius / across) ** 2 + (height / along) ** 2 - 1
        t = t + excess / (2 * THICKNESS * (radius**2 / across**3 + height**2 / along**3))
    return t


def axes(t: Floats, radius: Floats, height: Floats) -> Floats:
    """Fibre axes of problem 3: the angle falls from +90 to -90 degrees, linear in t.

    Parameters
    ----------
    t, radius, height : ndarray of any shape
        Parameter of the ellipsoid, and m from the axis and above the equator.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Rows f, s, n in the radial, circumferential and axial direction.
    """
    across, along = RADIUS + THICKNESS * t, LENGTH + THICKNESS * t
    # Towards the base along the ellipse; at the apex, where the angle is undefined, along the radius.
    meridional = unit(np.stack([-across * height / along, 0 * t, along * radius / across + 1e-12 * along], axis=-1))
    circumferential = np.broadcast_to([0.0, 1.0, 0.0], meridional.shape)
    angle = np.pi / 2 * (1 - 2 * t)[..., None]
    fibre = np.sin(angle) * meridional + np.cos(angle) * circumferential
    normal = np.cross(circumferential, meridional)
    return np.stack([fibre, np.cross(normal, fibre), normal], axis=-2)


@dataclass(frozen=True)
class RefinedSolution:
    """One problem under refinement, and by the axisymmetric solver.

    Attributes
    ----------
    cells : tuple of int
        Of each mesh.
    apex : tuple of (float, float)
        Height above the equator of the apex, m, endocardial and epicardial, for each mesh.
    meridian : tuple of (float, float)
        The same of each mesh of the second solver.
    surfaces : tuple of ndarray of shape (n, 2), m
        Distance from the axis and height of the nodes of both surfaces, of the finest mesh.
    outlines : tuple of ndarray of shape (n, 2), m
        The same of the second solver, in order.
    """

    cells: tuple[int, ...]
    apex: tuple[tuple[float, float], ...]
    meridian: tuple[tuple[float, float], ...]
    surfaces: tuple[Floats, Floats]
    outlines: tuple[Floats, Floats]


@dataclass(frozen=True)
class Results:
    """Both problems.

    Attributes
    ----------
    inflated, contracting : RefinedSolution
        Problems 2 and 3.
    by_rule : tuple of (float, float)
        Apex of problem 3, m, with fibres by the rule of the heart, linear in the wall depth; on the second mesh.
    """

    inflated: RefinedSolution
    contracting: RefinedSolution
    by_rule: tuple[float, float]


def measure(quick: bool = False) -> Results:
    """Both problems on meshes of 1 to 6 elements through the wall; if `quick`, of 2, and of 1 to 4 in problem 3, with
    half as many around."""
    along_through = ((8, 1), (12, 2), (20, 4), (30, 6))
    meshes = [ellipsoid(6 if quick else 12, *counts) for counts in (along_through[:3] if quick else along_through)]
    quads = ((2, 12), (3, 20), (6, 48))
    inflated = _refine(ISOTROPIC, PRESSURE[0], *((meshes[1:2], quads[:1]) if quick else (meshes, quads)))
    contracting = _refine(CONTRACTING, PRESSURE[1], meshes, quads[1:2] if quick else quads)
    nodes = _inflate(meshes[1], _fibres_by_rule(meshes[1]), CONTRACTING, PRESSURE[1])
    return Results(inflated, contracting, _apex(meshes[1], nodes))


def _refine(
    model: ConstitutiveModel, pressure: float, meshes: list[Mesh], quads: tuple[tuple[int, int], ...]
) -> RefinedSolution:
    """One problem on all meshes, and by the axisymmetric solver on grids of quadrilaterals."""
    solids = [_inflate(mesh, _fibres_of_paper(mesh), model, pressure) for mesh in meshes]
    meridians = [_solve_meridian(counts, model, pressure) for counts in quads]
    mesh, nodes = meshes[-1], solids[-1] + [0, 0, BASE]
    surfaces = [nodes[np.unique(side)] for side in (mesh.endo, mesh.epi)]
    return RefinedSolution(
        tuple(len(mesh.cells) for mesh in meshes),
        tuple(_apex(mesh, nodes) for mesh, nodes in zip(meshes, solids, strict=True)),
        tuple((float(inner[0, 1]), float(outer[0, 1])) for inner, outer in meridians),
        tuple(np.column_stack([np.hypot(*points[:, :2].T), points[:, 2]]) for points in surfaces),
        meridians[-1],
    )


def _inflate(mesh: Mesh, frames: Floats, model: ConstitutiveModel, pressure: float) -> Floats:
    """Deformed nodes (n_nodes, 3), m."""
    equilibrium = Equilibrium(mesh, frames, model.law(), base_support(mesh, "fixed"))
    stepper = LoadStepper(equilibrium, model.stiffness)
    nodes = equilibrium.positions(stepper.advance(Load(pressure, 1.0, tension=model.tension), None))
    equilibrium.close()
    return nodes


def _fibres_of_paper(mesh: Mesh) -> Floats:
    """Fibre axes of problem 3 at the quadrature points, (n_cells, n_points, 3, 3)."""
    points = bodies.quadrature_positions(mesh) + [0, 0, BASE]
    radius, height = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
    return axes(paper_depth(radius, height), radius, height) @ bodies.cylindrical_axes(points)


def _fibres_by_rule(mesh: Mesh) -> Floats:
    """Fibre axes of the same angles by the rule of the heart."""
    rule = Fibres(endo_deg=90.0, epi_deg=-90.0, transverse_endo_deg=0.0, transverse_epi_deg=0.0)
    return fibres.fibre_frames(mesh, fibres.wall_depth(mesh), rule, tetrahedron()[0])


def _apex(mesh: Mesh, nodes: Floats) -> tuple[float, float]:
    """Height of the endocardial and the epicardial apex above the equator, m."""
    on_axis = [side[np.hypot(*mesh.nodes[side, :2].T) < 1e-9] for side in map(np.unique, (mesh.endo, mesh.epi))]
    inner, outer = (float(nodes[side[0], 2] + BASE) for side in on_axis)
    return inner, outer


def _solve_meridian(counts: tuple[int, int], model: ConstitutiveModel, pressure: float) -> tuple[Floats, Floats]:
    """Deformed endo- and epicardium of the second solver, from the apex: radius and height, each (n, 2), m."""

    def position(parameters: Floats) -> Floats:
        t, r = parameters[..., 0], parameters[..., 1]
        across, along = RADIUS + THICKNESS * t, LENGTH + THICKNESS * t
        angle = r * np.arccos(-BASE / along)
        return np.stack([across * np.sin(angle), -along * np.cos(angle)], axis=-1)

    def fibre_axes(parameters: Floats) -> Floats:
        return axes(parameters[..., 0], *np.moveaxis(position(parameters), -1, 0))

    body = AxisymmetricBody(counts, position, fibre_axes, model)
    motion = body.solve(pressure, model.tension, steps=8).motion
    radius = np.hypot(body.nodes[:, 0] + motion[:, 0], motion[:, 1])
    outline = np.column_stack([radius, body.nodes[:, 1] + motion[:, 2]])
    inner, outer = (outline[body.parameters[:, 0] == depth] for depth in (0, 1))
    return inner, outer


def report(results: Results) -> Report:
    """Rows of the page."""
    other = "another code"
    second, rows = "own second solver", []
    two, three = results.inflated, results.contracting
    for side, surface, known in ((0, "endocardial", -26.62), (1, "epicardial", -28.28)):
        name = f"problem 2, {two.cells[-1]} cells: {surface} apex (mm)"
        rows += [
            Row(name, two.apex[-1][side] * 1e3, known, 0.005 * 28, other, ".2f"),
            Row(name, two.apex[-1][side] * 1e3, two.meridian[-1][side] * 1e3, 0.005 * 28, second, ".2f"),
        ]
    for side, surface in ((0, "endocardial"), (1, "epicardial")):
        solved, name = three.apex[-1][side] * 1e3, f"problem 3, {three.cells[-1]} cells: {surface} apex (mm)"
        rows.append(Row(name, solved, three.meridian[-1][side] * 1e3, 0.01 * 12.3, second, ".2f"))
    for side, surface in ((0, "endocardial"), (1, "epicardial")):
        name = f"problem 3, {three.cells[1]} cells, fibres linear in the wall depth: {surface} apex (mm)"
        source = "the same mesh with fibres linear in the paper's parameter"
        rows.append(Row(name, results.by_rule[side] * 1e3, three.apex[1][side] * 1e3, 0.05, source, ".2f"))
    text = (
        "A truncated ellipsoid with semi-axes of 7 and 17 mm (endocardium) and 10 and 20 mm (epicardium), its base "
        "held: isotropic under 10 kPa (problem 2), and with fibres of +90 to -90 degrees under 15 kPa at 60 kPa of "
        "active second Piola-Kirchhoff stress (problem 3). Heights are above the equator, as in the paper. Its fibre "
        "angle is linear in the parameter t of the ellipsoids of semi-axes 7 + 3t and 17 + 3t mm; the heart's own "
        "rule, linear in wall depth, is put beside it. The apex of problem 3, where fibres have no direction, needs "
        "small cells. The second solver has fully incompressible quadrilaterals in the meridian; the other code is "
        "older than this one. Allowed in problem 2 is 0.5 %, by which the participants differ."
    )
    caption = "Problems 2 and 3: deformed outlines (lines: second solver), and the endocardial apex under refinement."
    return Report("A ventricle, inflated and contracting (Land problems 2 and 3)", text, tuple(rows), caption)


@style.styled
def draw(results: Results) -> Figure:
    """Deformed outlines of both problems, and the apex against the number of cells."""
    figure = style.figure(8.0, 4.4)
    panels = figure.subplots(1, 3, width_ratios=(1, 1, 1.1))
    pairs = ((results.inflated, "Problem 2"), (results.contracting, "Problem 3"))
    for axes_, (solved, title) in zip(panels, pairs, strict=False):
        for points, line in zip(solved.surfaces, solved.outlines, strict=True):
            axes_.plot(*points.T * 1e3, ".", color=style.SERIES[0], markersize=3)
            axes_.plot(*line.T * 1e3, color=style.SERIES[1], linewidth=0.9)
        axes_.set(title=title, xlabel="distance from the axis (mm)", aspect="equal")
    panels[0].set_ylabel("height above the equator (mm)")
    for (solved, title), marker in zip(pairs, "os", strict=True):
        error = 100 * np.abs([apex[0] / solved.meridian[-1][0] - 1 for apex in solved.apex])
        panels[2].loglog(solved.cells, error, marker=marker, markersize=4, label=title)
    panels[2].axhline(0.5, color=style.TARGET, linestyle="--", label="spread of the participants")
    panels[2].set(xlabel="cells", ylabel="endocardial apex, from the second solver (%)", title="Refinement")
    panels[2].yaxis.set_major_formatter("{x:g}")
    panels[2].legend()
    return figure
