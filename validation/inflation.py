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
from echotruth.mechanics.solver.newton import LoadStepper
from echotruth.mechanics.solver.support import Support
from echotruth.report import style
from validation import bodies
from validation.energies import ConstitutiveModel
from validation.report import Report, Row
from validation.shells import Sphere, Tube

BULK_MODULUS = 1e9
"""Pa, at which the wall is nearly incompressible."""

TWIST = 150.0
"""rad/m: 0.15 rad, 8.6 deg, over the tube's millimetre."""

TRANSVERSELY_ISOTROPIC = ConstitutiveModel(LAWS["fung"].Law(), 1.1e3, bulk=BULK_MODULUS)
CONTRACTING = ConstitutiveModel(LAWS["fung"].Law(), 1.1e3, tension=4e4, bulk=BULK_MODULUS)
ORTHOTROPIC = ConstitutiveModel(LAWS["guccione"].Law(), 880.0, bulk=BULK_MODULUS)

RATE_SOURCE = "theory (Boffi, Brezzi & Fortin 2013, section 8.6)"

HELIX = np.radians(60.0), np.radians(-60.0)

TUBES = {
    "inflated tube": Tube(TRANSVERSELY_ISOTROPIC, 1.5e-3, 2.5e-3, 1.9e-3, helix=HELIX),
    "inflated, stretched and twisted tube": Tube(ORTHOTROPIC, 1.5e-3, 2.5e-3, 1.8e-3, 1.1, TWIST, HELIX),
    "contracting tube": Tube(CONTRACTING, 1.5e-3, 2.5e-3, 1.2e-3, 0.95, TWIST, HELIX),
}
SPHERES = {"inflated sphere": Sphere(TRANSVERSELY_ISOTROPIC, 2e-3, 3e-3, 2.5e-3)}


@dataclass(frozen=True)
class RefinementErrors:
    """Errors of one body under refinement.

    Attributes
    ----------
    cells : tuple of int
        Of each mesh.
    size : tuple of float, m
        Thickness of a layer of boxes.
    motion : tuple of float
        Root mean square error of the displacement, over that of the exact displacement.
    inner_radius : tuple of float
        Error of the inner radius over its growth.
    ends : tuple of (float, float)
        Errors of axial force and torque at an end, over the exact ones; none for a sphere.
    """

    cells: tuple[int, ...]
    size: tuple[float, ...]
    motion: tuple[float, ...]
    inner_radius: tuple[float, ...]
    ends: tuple[tuple[float, float], ...] = ()

    @property
    def rate(self) -> float:
        """Order of convergence: slope of log(motion) over log(size), by a line through all meshes."""
        return float(np.polyfit(np.log(self.size), np.log(self.motion), 1)[0])


def measure(quick: bool = False) -> dict[str, RefinementErrors]:
    """Errors of each body on meshes of 1, 2, 4 and, unless `quick`, 6 layers of boxes through the wall."""
    layers = (1, 2, 4) if quick else (1, 2, 4, 6)
    cases = {name: _refine(tube_errors, tube, layers) for name, tube in TUBES.items()}
    return cases | {name: _refine(sphere_errors, sphere, layers) for name, sphere in SPHERES.items()}


def _refine(errors: Callable, exact: Tube | Sphere, layers: tuple[int, ...]) -> RefinementErrors:
    cells, motion, inner_radius, ends = zip(*(errors(exact, n) for n in layers), strict=True)
    return RefinementErrors(
        cells, tuple((exact.outer - exact.inner) / n for n in layers), motion, inner_radius, tuple(filter(None, ends))
    )


def tube_errors(exact: Tube, layers: int) -> tuple[int, float, float, tuple[float, float]]:
    """Cells, and errors of motion, inner radius and end loads of a tube of a millimetre.

    One end keeps its plane and does not turn, but widens; all of the other moves as the exact solution does.
    """
    body = bodies.tube((layers, 8 * layers, layers), exact.inner, exact.outer, 1e-3)
    mesh, prescribed = body.mesh, exact.displacement(body.mesh.nodes)
    directions, free = np.tile(np.eye(3), (len(prescribed), 1, 1)), np.ones(prescribed.shape, dtype=bool)
    base = body.side(2, 1.0)
    directions[base] = bodies.cylindrical_axes(mesh.nodes[base])
    free[base] = [True, False, False]
    free[body.side(2, 0.0)] = False
    points = body.quadrature_points()[0]
    frames = exact.axes(np.hypot(points[..., 0], points[..., 1])) @ bodies.cylindrical_axes(points)
    tube = Equilibrium(mesh, frames, exact.model.law(), Support(directions, free, prescribed=prescribed))
    stepper = LoadStepper(tube, exact.model.stiffness)
    stepper.advance(Load(exact.pressure(), 1.0, tension=exact.model.tension, prescribed_fraction=1.0), None)
    positions = tube.positions(stepper.state, 1.0)
    tube.close()
    inner = body.side(0, 0.0)
    radius = np.hypot(*positions[inner, :2].T)
    growth = np.abs(radius - exact.inflated).max() / abs(exact.inflated - exact.inner)
    error = body.relative_rms_error(positions - mesh.nodes, exact.displacement)
    return len(mesh.cells), error, float(growth), _end_errors(exact, body, frames, positions, stepper)


def _end_errors(
    exact: Tube, body: bodies.LatticeBody, frames: Floats, positions: Floats, stepper: LoadStepper
) -> tuple[float, float]:
    """Errors of axial force and torque at the end of the solved tube at z = 0, over the exact ones."""
    mesh = body.mesh
    support = bodies.cartesian_support(np.ones(positions.shape, dtype=bool), positions - mesh.nodes)
    unsupported = Equilibrium(mesh, frames, exact.model.law(), support)
    state = replace(unsupported.unloaded_state(exact.model.stiffness), cell_pressure=stepper.state.cell_pressure)
    load = Load(0.0, 1.0, tension=exact.model.tension, prescribed_fraction=1.0)
    base = body.side(2, 1.0)
    force = unsupported.residual(state, load, None).force.reshape(-1, 3)[base]
    x, y, _ = positions[base].T
    axial, torque = np.sum(force[:, 2]), np.sum(x * force[:, 1] - y * force[:, 0])
    exact_axial, exact_torque = exact.force_and_torque()
    return float(axial / exact_axial - 1), float(torque / exact_torque - 1)


def sphere_errors(exact: Sphere, layers: int) -> tuple[int, float, float, tuple[()]]:
    """Cells, and errors of motion and inner radius of a piece of a sphere between planes in which it slides."""
    body = bodies.sphere_piece((layers, 2 * layers, 2 * layers), exact.inner, exact.outer)
    mesh = body.mesh
    points = body.quadrature_points()[0]
    sphere = Equilibrium(mesh, _spherical_axes(points), exact.model.law(), _between_planes(body))
    stepper = LoadStepper(sphere, exact.model.stiffness)
    stepper.advance(Load(exact.pressure(), 1.0), None)
    positions = sphere.positions(stepper.state)
    sphere.close()
    radius = np.linalg.norm(positions[body.side(0, 0.0)], axis=1)
    growth = np.abs(radius - exact.inflated).max() / (exact.inflated - exact.inner)
    return len(mesh.cells), body.relative_rms_error(positions - mesh.nodes, exact.displacement), float(growth), ()


def _between_planes(body: bodies.LatticeBody) -> Support:
    """Support of a piece of a sphere: in the planes y = 0, z = 0, y = x and z = x, and along the lines they share."""
    directions = np.tile(np.eye(3), (len(body.mesh.nodes), 1, 1))
    free = np.ones(body.mesh.nodes.shape, dtype=bool)
    normals = {(1, 0.0): (0, 1, 0), (1, 1.0): (-1, 1, 0), (2, 0.0): (0, 0, 1), (2, 1.0): (-1, 0, 1)}
    for (axis, value), normal in normals.items():
        nodes = body.side(axis, value)
        # The second direction is the radius, which lies in every one of the planes.
        radius, n = unit(body.mesh.nodes[nodes]), unit(np.array(normal, dtype=float))
        directions[nodes] = np.stack([np.broadcast_to(n, radius.shape), radius, np.cross(n, radius)], axis=1)
        free[nodes, 0] = False
        in_two_planes = nodes[np.count_nonzero(np.isin(body.parameters[nodes, 1:], (0.0, 1.0)), axis=1) == 2]
        free[in_two_planes] = [False, True, False]
    return Support(directions, free)


def _spherical_axes(positions: Floats) -> Floats:
    """Radial direction and two orthogonal to it, rows (..., 3, 3), at positions (..., 3)."""
    radial = unit(positions)
    first = unit(np.cross([0.0, 0.0, 1.0], radial))
    return np.stack([radial, first, np.cross(radial, first)], axis=-2)


def report(results: dict[str, RefinementErrors]) -> Report:
    """Rows of the page."""
    source, rows = "exact", []
    for name, case in results.items():
        error = f"{name}, {case.cells[-1]} cells: error of the"
        rows.append(Row(f"{error} motion (r.m.s.)", case.motion[-1], None, 0.01, source, ".1e"))
        rows.append(Row(f"{error} growth of the inner radius", case.inner_radius[-1], None, 0.015, source, ".1e"))
        if case.ends:
            force, torque = case.ends[-1]
            rows.append(Row(f"{error} axial force at an end", force, None, 0.02, source, ".1e"))
            rows.append(Row(f"{error} torque at an end", torque, None, 0.02, source, ".1e"))
        rows.append(Row(f"{name}: order of convergence", case.rate, 2.0, 0.5, RATE_SOURCE, ".2f"))
    text = (
        "A tube of 1.5 and 2.5 mm with fibres turning from +60 to -60 degrees is inflated; inflated, stretched and "
        "twisted with an orthotropic law; and contracts against a pressure of 15 kPa at 40 kPa of active tension while "
        "it is twisted. A sphere of 2 and 3 mm with radial fibres is inflated. The pressure is that of the exact "
        "solution; errors are over the exact motion, growth of the radius, force and torque."
    )
    caption = "Error of the motion, root mean square over the wall, of meshes with 1 to 6 layers of boxes of six cells."
    return Report("Thick tube and thick sphere", text, tuple(rows), caption)


@style.styled
def draw(results: dict[str, RefinementErrors]) -> Figure:
    """Errors against the size of the cells."""
    figure = style.figure(6.4, 3.4)
    axes = figure.add_subplot()
    for (name, case), marker in zip(results.items(), "osD^", strict=True):
        axes.loglog(np.array(case.size) * 1e3, np.array(case.motion) * 100, marker=marker, markersize=4, label=name)
    size = np.array([min(case.size[-1] for case in results.values()), 1e-3]) * 1e3
    axes.loglog(size, 1.2 * size**2, "--", color=style.TARGET, label="second order")
    axes.set(xlabel="thickness of a layer (mm)", ylabel="error of the motion (%)")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.legend()
    return figure
