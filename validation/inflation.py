"""Thick tube and thick sphere against their exact solutions, under refinement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from echotruth.fem.tetrahedra import Floats
from echotruth.materials import LAWS
from echotruth.mechanics.fibres import unit
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
from echotruth.mechanics.solver.newton import Walk
from echotruth.mechanics.solver.support import Support
from echotruth.report import style
from validation import bodies
from validation.energies import Wall
from validation.report import Report, Row
from validation.shells import Sphere, Tube

STIFF = 1e9
"""Bulk modulus, Pa, at which the wall is as good as incompressible."""

TWIST = 150.0
"""rad/m: 0.15 rad, 8.6 deg, over the tube's millimetre."""

PASSIVE = Wall(LAWS["fung"].Law(), 1.1e3, bulk=STIFF)
ACTIVE = Wall(LAWS["fung"].Law(), 1.1e3, tension=4e4, bulk=STIFF)
ORTHOTROPIC = Wall(LAWS["guccione"].Law(), 880.0, bulk=STIFF)

THEORY = "theory for quadratic motion and constant pressure (Boffi, Brezzi & Fortin 2013, section 8.6)"

HELIX = np.radians(60.0), np.radians(-60.0)

TUBES = {
    "inflated tube": Tube(PASSIVE, 1.5e-3, 2.5e-3, 1.9e-3, helix=HELIX),
    "inflated, stretched and twisted tube": Tube(ORTHOTROPIC, 1.5e-3, 2.5e-3, 1.8e-3, 1.1, TWIST, HELIX),
    "contracting tube": Tube(ACTIVE, 1.5e-3, 2.5e-3, 1.2e-3, 0.95, TWIST, HELIX),
}
SPHERES = {"inflated sphere": Sphere(PASSIVE, 2e-3, 3e-3, 2.5e-3)}


@dataclass(frozen=True)
class Case:
    """Errors of one body under refinement.

    Attributes
    ----------
    cells : tuple of int
        Of each mesh.
    size : tuple of float, m
        Thickness of a layer of boxes.
    motion : tuple of float
        Root-mean-square error of the displacement, over its own.
    inside : tuple of float
        Error of the inner radius over its growth.
    ends : tuple of (float, float)
        Errors of axial force and torque at an end, over the exact ones; none for a sphere.
    """

    cells: tuple[int, ...]
    size: tuple[float, ...]
    motion: tuple[float, ...]
    inside: tuple[float, ...]
    ends: tuple[tuple[float, float], ...] = ()

    @property
    def rate(self) -> float:
        """Power of the size of the cells by which the error of the motion falls: a line through all meshes."""
        return float(np.polyfit(np.log(self.size), np.log(self.motion), 1)[0])


def measure(quick: bool = False) -> dict[str, Case]:
    """Errors of each body on meshes of 1, 2, 4 and, unless it is to be quick, 6 layers of boxes through the wall."""
    layers = (1, 2, 4) if quick else (1, 2, 4, 6)
    cases = {name: _case(tube_errors, tube, layers) for name, tube in TUBES.items()}
    return cases | {name: _case(sphere_errors, sphere, layers) for name, sphere in SPHERES.items()}


def _case(errors: Callable, exact: Tube | Sphere, layers: tuple[int, ...]) -> Case:
    found = [errors(exact, n) for n in layers]
    cells, motion, inside, ends = zip(*found, strict=True)
    return Case(
        cells, tuple((exact.outer - exact.inner) / n for n in layers), motion, inside, tuple(filter(None, ends))
    )


def tube_errors(exact: Tube, layers: int) -> tuple[int, float, float, tuple[float, float]]:
    """Cells, and errors of motion, inner radius and end loads of a tube of a millimetre.

    One end keeps its plane and does not turn, but widens; all of the other moves as the exact solution does.
    """
    body = bodies.tube((layers, 8 * layers, layers), exact.inner, exact.outer, 1e-3)
    mesh, moved = body.mesh, exact.displacement(body.mesh.nodes)
    directions, free = np.tile(np.eye(3), (len(moved), 1, 1)), np.ones(moved.shape, dtype=bool)
    base = body.side(2, 1.0)
    directions[base] = _cylindrical(mesh.nodes[base])
    free[base] = [True, False, False]
    free[body.side(2, 0.0)] = False
    places = body.places()[0]
    frames = exact.axes(np.hypot(places[..., 0], places[..., 1])) @ _cylindrical(places)
    tube = Equilibrium(mesh, frames, exact.wall.law(), Support(directions, free, moved=moved))
    walk = Walk(tube, exact.wall.stiffness)
    walk.to(Load(exact.pressure(), 1.0, tension=exact.wall.tension, moved=1.0), None)
    positions = tube.positions(walk.state, 1.0)
    tube.close()
    inner = body.side(0, 0.0)
    radius = np.hypot(*positions[inner, :2].T)
    growth = np.abs(radius - exact.inflated).max() / abs(exact.inflated - exact.inner)
    error = body.rms(positions - mesh.nodes, exact.displacement)
    return len(mesh.cells), error, float(growth), _end_errors(exact, body, frames, positions, walk)


def _end_errors(exact: Tube, body: bodies.Body, frames: Floats, positions: Floats, walk: Walk) -> tuple[float, float]:
    """Errors of axial force and torque that the solved tube bears at the end at z = 0, over the exact ones."""
    mesh, every = body.mesh, np.ones(positions.shape, dtype=bool)
    free = Support(np.tile(np.eye(3), (len(positions), 1, 1)), every, moved=positions - mesh.nodes)
    whole = Equilibrium(mesh, frames, exact.wall.law(), free)
    state = replace(whole.rest(exact.wall.stiffness), pressure=walk.state.pressure)
    load = Load(0.0, 1.0, tension=exact.wall.tension, moved=1.0)
    base = body.side(2, 1.0)
    force = whole.imbalance(state, load, None).force.reshape(-1, 3)[base]
    x, y, _ = positions[base].T
    found = np.sum(force[:, 2]), np.sum(x * force[:, 1] - y * force[:, 0])
    expected = exact.force_and_torque()
    return float(found[0] / expected[0] - 1), float(found[1] / expected[1] - 1)


def sphere_errors(exact: Sphere, layers: int) -> tuple[int, float, float, tuple[()]]:
    """Cells, and errors of motion and inner radius of a piece of a sphere between planes in which it slides."""
    body = bodies.sphere_piece((layers, 2 * layers, 2 * layers), exact.inner, exact.outer)
    mesh = body.mesh
    places = body.places()[0]
    sphere = Equilibrium(mesh, _spherical(places), exact.wall.law(), _between_planes(body))
    walk = Walk(sphere, exact.wall.stiffness)
    walk.to(Load(exact.pressure(), 1.0), None)
    positions = sphere.positions(walk.state)
    sphere.close()
    radius = np.linalg.norm(positions[body.side(0, 0.0)], axis=1)
    growth = np.abs(radius - exact.inflated).max() / (exact.inflated - exact.inner)
    return len(mesh.cells), body.rms(positions - mesh.nodes, exact.displacement), float(growth), ()


def _between_planes(body: bodies.Body) -> Support:
    """Support of a piece of a sphere: in the planes y = 0, z = 0, y = x and z = x, and along the lines they share."""
    directions = np.tile(np.eye(3), (len(body.mesh.nodes), 1, 1))
    free = np.ones(body.mesh.nodes.shape, dtype=bool)
    normals = {(1, 0.0): (0, 1, 0), (1, 1.0): (-1, 1, 0), (2, 0.0): (0, 0, 1), (2, 1.0): (-1, 0, 1)}
    for (axis, value), normal in normals.items():
        nodes = body.side(axis, value)
        # The second direction is the radius, which lies in every one of the planes.
        radius, across = unit(body.mesh.nodes[nodes]), unit(np.array(normal, dtype=float))
        directions[nodes] = np.stack([np.broadcast_to(across, radius.shape), radius, np.cross(across, radius)], axis=1)
        free[nodes, 0] = False
        twice = nodes[np.count_nonzero(np.isin(body.parameters[nodes, 1:], (0.0, 1.0)), axis=1) == 2]
        free[twice] = [False, True, False]
    return Support(directions, free)


def _cylindrical(places: Floats) -> Floats:
    """Radial, circumferential and axial direction, rows (..., 3, 3), at places (..., 3)."""
    radial = unit(places * [1, 1, 0])
    axial = np.broadcast_to([0.0, 0.0, 1.0], radial.shape)
    return np.stack([radial, np.cross(axial, radial), axial], axis=-2)


def _spherical(places: Floats) -> Floats:
    """Radial direction and two across it, rows (..., 3, 3), at places (..., 3)."""
    radial = unit(places)
    first = unit(np.cross([0.0, 0.0, 1.0], radial))
    return np.stack([radial, first, np.cross(radial, first)], axis=-2)


def report(numbers: dict[str, Case]) -> Report:
    """Rows of the page."""
    source, rows = "exact, but for one quadrature", []
    for name, case in numbers.items():
        size = f"{case.cells[-1]} cells"
        rows += [
            Row(f"{name}, {size}: error of the motion (r.m.s.)", case.motion[-1], None, 0.01, source, ".1e"),
            Row(
                f"{name}, {size}: error of the growth of the inner radius", case.inside[-1], None, 0.015, source, ".1e"
            ),
        ]
        if case.ends:
            force, torque = case.ends[-1]
            rows += [
                Row(f"{name}, {size}: error of the axial force at an end", force, None, 0.02, source, ".1e"),
                Row(f"{name}, {size}: error of the torque at an end", torque, None, 0.02, source, ".1e"),
            ]
        rows.append(Row(f"{name}: power of the cell size by which the error falls", case.rate, 2.0, 0.5, THEORY, ".2f"))
    text = (
        "A tube of 1.5 and 2.5 mm with fibres turning from +60 to -60 degrees is inflated; inflated, stretched and "
        "twisted with an orthotropic law; and contracts against a pressure of 15 kPa at 40 kPa of active tension while "
        "it is twisted. A sphere of 2 and 3 mm with radial fibres is inflated. The pressure is that of the exact "
        "solution; errors are over the exact motion, growth of the radius, force and torque."
    )
    caption = "Error of the motion, root mean square over the wall, of meshes with 1 to 6 layers of boxes of six cells."
    return Report("Thick tube and thick sphere", text, tuple(rows), caption)


@style.styled
def draw(numbers: dict[str, Case]) -> Figure:
    """Errors against the size of the cells."""
    sheet = style.figure(6.4, 3.4)
    axes = sheet.add_subplot()
    for (name, case), marker in zip(numbers.items(), "osD^", strict=True):
        axes.loglog(np.array(case.size) * 1e3, np.array(case.motion) * 100, marker=marker, markersize=4, label=name)
    size = np.array([min(case.size[-1] for case in numbers.values()), 1e-3]) * 1e3
    axes.loglog(size, 1.2 * size**2, "--", color=style.ASKED, label="second order")
    axes.set(xlabel="thickness of a layer (mm)", ylabel="error of the motion (%)")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.legend()
    return sheet
