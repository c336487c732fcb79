"""Patch test: an irregular patch of curved tetrahedra under a homogeneous deformation.

Where the deformation gradient is the same everywhere, so is the stress: the forces on the inner nodes vanish, and those
on the nodes of the surface are the integrals of the traction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, State
from echotruth.mechanics.solver.newton import LoadStepper
from echotruth.report import style
from validation import bodies, energies
from validation.energies import PASSIVE_ENERGIES, ConstitutiveModel
from validation.report import Report, Row

GRADIENT = np.array([[1.12, 0.18, -0.05], [-0.08, 0.94, 0.11], [0.06, 0.03, 0.99]])
"""A deformation gradient with stretch, shear, rotation and a growth of the volume by 5 %."""

SIZE = 1e-3
"""Side of the patch, m."""


@dataclass(frozen=True)
class Results:
    """Largest errors by law, each over the largest force or displacement: (inside, surface, solved)."""

    errors: dict[str, tuple[float, float, float]]


def measure(quick: bool = False) -> Results:
    """Errors of all laws on a patch of 162 cells, or of 48 if `quick`."""
    mesh = irregular(2 if quick else 3)
    return Results({law: errors(mesh, contracting_model(law)) for law in PASSIVE_ENERGIES})


def contracting_model(law: str) -> ConstitutiveModel:
    """A passive law with the stiffness and the tension of a contracting heart, Pa."""
    return ConstitutiveModel(
        energies.LAWS[law].Law(), stiffness=59.0 if law == "holzapfel_ogden" else 1.1e3, tension=4e4
    )


def irregular(count: int) -> Mesh:
    """A cube whose nodes, those on the surface and on edges too, are shifted at random by up to 1/20 of an edge."""
    mesh = bodies.bar((count, count, count), (SIZE, SIZE, SIZE)).mesh
    shift = np.random.default_rng(4).uniform(-1, 1, mesh.nodes.shape) * SIZE / count / 20
    return replace(mesh, nodes=mesh.nodes + shift)


def errors(mesh: Mesh, model: ConstitutiveModel) -> tuple[float, float, float]:
    """Errors of the affine deformation of one patch.

    Parameters
    ----------
    mesh : Mesh
    model : ConstitutiveModel

    Returns
    -------
    inside, surface : float
        Largest force on an inner node, and largest error of one on the surface, over the largest on the surface.
    solved : float
        Largest error of the displacement of an inner node, solved for that of the surface, over the largest.
    """
    axes = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    axes[2] *= np.linalg.det(axes)
    frames = np.broadcast_to(axes, (len(mesh.cells), 14, 3, 3))
    displacement = mesh.nodes @ (GRADIENT - np.eye(3)).T
    facets = boundary(mesh.cells)[0]
    force = _forces(mesh, frames, model, displacement)
    stress = energies.first_piola_kirchhoff(GRADIENT @ axes.T, model.density) @ axes
    expected = _traction_forces(mesh, facets, stress)
    surface, largest = np.unique(facets), np.abs(expected).max()
    inside = np.setdiff1d(mesh.cells, surface)
    error = np.abs(_solve(mesh, frames, model, displacement, surface) - displacement).max()
    surface_error = np.abs(force - expected)[surface].max()
    return np.abs(force[inside]).max() / largest, surface_error / largest, error / np.abs(displacement).max()


def _forces(mesh: Mesh, frames: Floats, model: ConstitutiveModel, displacement: Floats) -> Floats:
    """Forces of the wall on its nodes, (n_nodes, 3), N."""
    support = bodies.cartesian_support(np.ones(mesh.nodes.shape, dtype=bool), displacement)
    patch = Equilibrium(mesh, frames, model.law(), support)
    pressure = np.full(len(mesh.cells), model.bulk * (np.linalg.det(GRADIENT) - 1))
    state = State(np.zeros(mesh.nodes.size), pressure, model.stiffness, model.tension)
    force = patch.residual(state, Load(0.0, 1.0, prescribed_fraction=1.0), None).force
    patch.close()
    return force.reshape(-1, 3)


def _solve(mesh: Mesh, frames: Floats, model: ConstitutiveModel, displacement: Floats, surface: Floats) -> Floats:
    """Displacement (n_nodes, 3), m, solved for that of the surface; the initial guess inside is far off."""
    free = np.ones(mesh.nodes.shape, dtype=bool)
    free[surface] = False
    start = displacement.copy()
    inside = np.setdiff1d(np.arange(len(mesh.nodes)), surface)
    start[inside] *= 0.7
    patch = Equilibrium(mesh, frames, model.law(), bodies.cartesian_support(free, start))
    stepper = LoadStepper(patch, model.stiffness)
    stepper.advance(Load(0.0, 1.0, tension=model.tension, prescribed_fraction=1.0), None)
    positions = patch.positions(stepper.state, 1.0)
    patch.close()
    return positions - mesh.nodes


def _traction_forces(mesh: Mesh, facets: Floats, stress: Floats) -> Floats:
    """Forces (n_nodes, 3), N, of the traction of a first Piola-Kirchhoff stress (3, 3), Pa, on the surface."""
    forces = bodies.nodal_area_vectors(mesh.nodes, facets) @ stress.T
    total = np.zeros(mesh.nodes.shape)
    np.add.at(total, facets, forces)
    return total


def report(results: Results) -> Report:
    """Rows of the page."""
    rows = []
    for law, (inside, surface, solved) in results.errors.items():
        source = "exact: one stress everywhere"
        rows += [
            Row(f"`{law}`: largest force inside, over the largest on the surface", inside, None, 1e-10, source, ".1e"),
            Row(f"`{law}`: error of the forces on the surface, over the same", surface, None, 1e-10, source, ".1e"),
            Row(f"`{law}`: error of the solved motion, over the largest", solved, None, 1e-6, "exact", ".1e"),
        ]
    text = (
        "An irregular patch of curved tetrahedra is stretched, sheared, turned and swollen by one deformation "
        "gradient, with passive and active stress. Then the surface alone is moved and the inside is solved for, to a "
        "relative residual of 1e-8. The expected stress is by a complex step of the energy."
    )
    return Report(
        "Patch test: homogeneous deformation", text, tuple(rows), "Errors of a homogeneous deformation, law by law."
    )


@style.styled
def draw(results: Results) -> Figure:
    """Errors of each law."""
    figure = style.figure(6.4, 2.6)
    axes = figure.add_subplot()
    labels = "force inside", "force on the surface", "solved motion"
    for k, label in enumerate(labels):
        x = np.arange(len(results.errors)) + 0.25 * (k - 1)
        axes.bar(x, [errors[k] for errors in results.errors.values()], 0.22, color=style.SERIES[k], label=label)
    axes.set_xticks(np.arange(len(results.errors)), list(results.errors))
    axes.set(yscale="log", ylim=(1e-17, 1e-4), ylabel="relative error")
    axes.legend(ncols=3, loc="upper center")
    return figure
