"""An irregular patch of curved tetrahedra that is stretched and sheared all over alike.

Where the deformation gradient is the same everywhere, so is the stress: the forces on the nodes inside
vanish, and those on the nodes of the surface are the integrals of the traction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.solver.cavity import triangle_shape
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, State
from echotruth.mechanics.solver.newton import Walk
from echotruth.mechanics.solver.support import Support
from echotruth.report import style
from validation import bodies, energies
from validation.energies import PASSIVE, Wall
from validation.report import Report, Row

GRADIENT = np.array([[1.12, 0.18, -0.05], [-0.08, 0.94, 0.11], [0.06, 0.03, 0.99]])
"""A deformation gradient with stretch, shear, rotation and a growth of the volume by 5 %."""

SIZE = 1e-3
"""Side of the patch, m."""

SOLVED = "exact; solved to a relative imbalance of 1e-8"


@dataclass(frozen=True)
class Numbers:
    """Largest errors by law, each over the largest force or displacement: (inside, surface, solved)."""

    errors: dict[str, tuple[float, float, float]]


def measure(quick: bool = False) -> Numbers:
    """Errors of all laws on a patch of 162 cells, or of 48 where it is to be quick."""
    mesh = irregular(2 if quick else 3)
    return Numbers({law: errors(mesh, wall(law)) for law in PASSIVE})


def wall(law: str) -> Wall:
    """A wall of a law at the stiffness and the tension of a contracting heart, Pa."""
    section = energies.LAWS[law].Law()
    return Wall(section, stiffness=59.0 if law == "holzapfel_ogden" else 1.1e3, tension=4e4)


def irregular(count: int) -> Mesh:
    """A cube whose nodes, on the surface and between vertices too, lie off their lattice by a twentieth of an edge."""
    mesh = bodies.bar((count, count, count), (SIZE, SIZE, SIZE)).mesh
    shift = np.random.default_rng(4).uniform(-1, 1, mesh.nodes.shape) * SIZE / count / 20
    return replace(mesh, nodes=mesh.nodes + shift)


def errors(mesh: Mesh, wall: Wall) -> tuple[float, float, float]:
    """Errors of the affine motion of one patch.

    Parameters
    ----------
    mesh : Mesh
    wall : Wall

    Returns
    -------
    inside, surface : float
        Largest force on a node inside, and largest error of one on the surface, over the largest on the surface.
    solved : float
        Largest error of a node inside where the surface is moved and the inside solved, over the largest motion.
    """
    axes = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    axes[2] *= np.linalg.det(axes)
    frames = np.broadcast_to(axes, (len(mesh.cells), 14, 3, 3))
    moved = mesh.nodes @ (GRADIENT - np.eye(3)).T
    facets = boundary(mesh.cells)[0]
    force = _forces(mesh, frames, wall, moved)
    expected = _tractions(mesh, facets, energies.first_stress(GRADIENT @ axes.T, wall.density) @ axes)
    surface, largest = np.unique(facets), np.abs(expected).max()
    inside = np.setdiff1d(mesh.cells, surface)
    solved = _solved(mesh, frames, wall, moved, surface) - moved
    of_surface = np.abs(force - expected)[surface].max()
    return np.abs(force[inside]).max() / largest, of_surface / largest, np.abs(solved).max() / np.abs(moved).max()


def _forces(mesh: Mesh, frames: Floats, wall: Wall, moved: Floats) -> Floats:
    """Forces of the wall on its nodes, (n_nodes, 3), N."""
    every = np.ones(mesh.nodes.shape, dtype=bool)
    support = Support(np.tile(np.eye(3), (len(mesh.nodes), 1, 1)), every, moved=moved)
    patch = Equilibrium(mesh, frames, wall.law(), support)
    pressure = np.full(len(mesh.cells), wall.bulk * (np.linalg.det(GRADIENT) - 1))
    state = State(np.zeros(mesh.nodes.size), pressure, wall.stiffness, wall.tension)
    found = patch.imbalance(state, Load(0.0, 1.0, moved=1.0), None).force
    patch.close()
    return found.reshape(-1, 3)


def _solved(mesh: Mesh, frames: Floats, wall: Wall, moved: Floats, surface: Floats) -> Floats:
    """Displacement (n_nodes, 3), m, where that of the surface is given; the start of the inside is far off."""
    free = np.ones(mesh.nodes.shape, dtype=bool)
    free[surface] = False
    start = moved.copy()
    inside = np.setdiff1d(np.arange(len(mesh.nodes)), surface)
    start[inside] *= 0.7
    patch = Equilibrium(mesh, frames, wall.law(), Support(np.tile(np.eye(3), (len(start), 1, 1)), free, moved=start))
    walk = Walk(patch, wall.stiffness)
    walk.to(Load(0.0, 1.0, tension=wall.tension, moved=1.0), None)
    positions = patch.positions(walk.state, 1.0)
    patch.close()
    return positions - mesh.nodes


def _tractions(mesh: Mesh, facets: Floats, stress: Floats) -> Floats:
    """Integrals of the traction of a first Piola-Kirchhoff stress (3, 3), Pa, over the surface: (n_nodes, 3), N."""
    xi, weight = triangle()
    value, slope = triangle_shape(xi)
    first, second = (np.einsum("qa,fai->fqi", slope[..., k], mesh.nodes[facets]) for k in (0, 1))
    forces = np.einsum("q,qa,fqi->fai", weight, value, np.cross(first, second)) @ stress.T
    total = np.zeros(mesh.nodes.shape)
    np.add.at(total, facets, forces)
    return total


def report(numbers: Numbers) -> Report:
    """Rows of the page."""
    rows = []
    for law, (inside, surface, solved) in numbers.errors.items():
        source = "exact: one stress everywhere, by a complex step of the energy"
        rows += [
            Row(f"`{law}`: largest force inside, over the largest on the surface", inside, None, 1e-10, source, ".1e"),
            Row(f"`{law}`: error of the forces on the surface, over the same", surface, None, 1e-10, source, ".1e"),
            Row(f"`{law}`: error of the solved motion, over the largest", solved, None, 1e-6, SOLVED, ".1e"),
        ]
    text = (
        "An irregular patch of curved tetrahedra is stretched, sheared, turned and swollen by one deformation "
        "gradient, with passive and active stress. Then the surface alone is moved and the inside is solved for."
    )
    return Report("Homogeneous deformation", text, tuple(rows), "Errors of a homogeneous deformation, law by law.")


@style.styled
def draw(numbers: Numbers) -> Figure:
    """Errors of each law."""
    sheet = style.figure(6.4, 2.6)
    axes = sheet.add_subplot()
    names, colours = (
        ("force inside", "force on the surface", "solved motion"),
        (
            style.RADIAL,
            style.CIRCUMFERENTIAL,
            style.LONGITUDINAL,
        ),
    )
    for k, (label, colour) in enumerate(zip(names, colours, strict=True)):
        place = np.arange(len(numbers.errors)) + 0.25 * (k - 1)
        axes.bar(place, [each[k] for each in numbers.errors.values()], 0.22, color=colour, label=label)
    axes.set_xticks(np.arange(len(numbers.errors)), list(numbers.errors))
    axes.set(yscale="log", ylim=(1e-17, 1e-4), ylabel="relative error")
    axes.legend(ncols=3, loc="upper center")
    return sheet
