"""Virtual work of the blood against that of the wall, at every frame and over the beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from echotruth.fem.quadrature import tetrahedron, triangle
from echotruth.fem.tetrahedra import Floats, Integers, Mesh, shape, shape_gradient
from echotruth.mechanics.fibres import fibre_frames, material_gradients
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.report import style
from echotruth.units import kPa, kPa_per_mm, kPa_s_per_mm
from validation import energies, heart
from validation.report import Report, Row

N_MOTIONS = 8
"""Random motions whose works tell the norm of a force within a quarter."""


@dataclass(frozen=True)
class Results:
    """Works of blood and wall.

    Attributes
    ----------
    cells : int
    time : ndarray of shape (n_frames,), s
    blood : ndarray of shape (n_frames,), J
        Work of the cavity pressure for the motion from the frame before to the frame after.
    wall : ndarray of shape (n_frames, 5), J
        Work of the passive, active, volumetric and viscous stress, and of the surroundings, for the same motion.
    loop : ndarray of shape (6,), J
        Over the beat: the work of the heart on the blood, and what the five took up.
    """

    cells: int
    time: Floats
    blood: Floats
    wall: Floats
    loop: Floats

    @property
    def error(self) -> float:
        """Largest imbalance of a frame over the largest work of one."""
        return float(np.abs(self.wall.sum(axis=1) - self.blood).max() / np.abs(self.blood).max())


def measure(quick: bool = False) -> Results:
    """Works of the default heart, or of a coarse one if `quick`."""
    return balance(heart.solved(*((6, 4, 1) if quick else heart.DEFAULT_MESH)))


def residual(solved: heart.SolvedBeat) -> Floats:
    """Force on the free nodes over that of the blood, (n_frames,): root mean square of the work of random motions."""
    virtual_work, mesh, rng = _VirtualWork(solved), solved.wall.mesh, np.random.default_rng(0)
    motions = rng.normal(size=(N_MOTIONS, *mesh.nodes.shape))
    motions[:, np.unique(mesh.base)] = 0.0
    frames = range(len(virtual_work.time))
    works = np.array([[virtual_work.of_frame(frame, motion) for motion in motions] for frame in frames])
    left = works[..., 1:].sum(axis=-1) - works[..., 0]
    return np.sqrt(np.sum(left**2, axis=1) / np.sum(works[..., 0] ** 2, axis=1))


def balance(solved: heart.SolvedBeat) -> Results:
    """Works of a solved heart."""
    virtual_work, displacement = _VirtualWork(solved), solved.beat.displacement
    changes = np.roll(displacement, -1, axis=0) - np.roll(displacement, 1, axis=0)
    works = np.array([virtual_work.of_frame(frame, change) for frame, change in enumerate(changes)])
    # Half of the sum, for each change leads over two frames.
    loop = np.array([-works[:, 0].sum(), *works[:, 1:].sum(axis=0)]) / 2
    return Results(len(solved.wall.mesh.cells), virtual_work.time, works[:, 0], works[:, 1:], loop)


class _VirtualWork:
    """Virtual work of a solved heart, by energies implemented independently of its solver."""

    def __init__(self, solved: heart.SolvedBeat) -> None:
        self.mesh, self.beat, self.tissue = solved.wall.mesh, solved.beat, solved.wall.tissue
        self.before, self.since = solved.before, solved.since
        self.section, xi = solved.config.mechanics, tetrahedron()[0]
        self.right_pressure_ratio = solved.config.loop.right_pressure_ratio
        dN_dX, volume = material_gradients(self.mesh, xi)
        self.volume = volume * tetrahedron()[1]
        frames = fibre_frames(self.mesh, solved.wall.depth, solved.config.fibres, xi, solved.config.seed)
        self.dN_dX = np.einsum("cqai,cqji->cqaj", dN_dX, frames)
        self.time = np.arange(len(self.beat.displacement)) * solved.period / len(self.beat.displacement)
        self.axes = np.swapaxes(frames, -1, -2)

    def gradient(self, displacement: Floats) -> Floats:
        """F - I, its columns along the fibre axes."""
        return np.einsum("cai,cqaj->cqij", displacement[self.mesh.cells], self.dN_dX)

    def of_frame(self, frame: int, change: Floats) -> tuple[float, ...]:
        """Work of the blood, of the passive, active, volumetric and viscous stress and of the surroundings, J, for a
        change (n_nodes, 3), m, of the displacement of a frame."""
        u, step = self.beat.displacement[frame], 1j * energies.COMPLEX_STEP
        f = self.axes + self.gradient(u) + step * self.gradient(change)
        parts = self._passive(f), self._active(f, frame), self._volumetric(f), self._viscous(f, frame)
        of_wall = (float(part.imag / energies.COMPLEX_STEP) for part in parts)
        return self._blood(u, change, self.beat.pressure[frame]), *of_wall, self._surroundings(u, change, frame)

    def _blood(self, u: Floats, change: Floats, pressure: float) -> float:
        """Pressure times the derivative of the volume V(u + s change) by s, by differences: V is cubic in s.

        That of a right ventricle, whose rim stays in the plane of the base, counts by the ratio of the pressures.
        """

        def difference(s: float) -> float:
            ends = (self._borne_volume(self.mesh.nodes + u + side * s * change) for side in (1, -1))
            return next(ends) - next(ends)

        return pressure * (8 * difference(1.0) - difference(2.0)) / 12

    def _borne_volume(self, nodes: Floats) -> float:
        right = self.right_pressure_ratio * cavity_volume(nodes, self.mesh.right_endo)
        return cavity_volume(nodes, self.mesh.endo) + right

    def _passive(self, f: Floats) -> complex:
        """Energy of the passive law and of scars, which are taut from end-diastole on."""
        local = self.section.pointwise_bulk_ratio / 2 * (energies.determinant(f) - 1) ** 2
        energy = energies.passive(f, self.section.material) + local
        energy = self.beat.stiffness * self.tissue.stiffness_scale[:, None] * energy
        at_ed = self.axes + self.gradient(self.beat.displacement[0])
        taut = self.tissue.taut_stiffness[:, None] / 2 * _squared_strain(f, at_ed)
        return np.sum((energy + taut) * self.volume)

    def _active(self, f: Floats, frame: int) -> complex:
        """Energy of the tension, which the velocity of the fibres, that of the frame, lowers along them."""
        section = self.section.active
        power = 2.0 if section.stress == "cauchy" else 0.0
        shares = self._force_velocity(f.real, frame), section.sheet_share, section.normal_share
        dependences = section.length_dependence, 0.0, 0.0
        muscle = self.beat.cell_tension[frame][:, None] * self.volume
        return sum(
            np.sum(share * energies.active(f, dependence, power, axis) * muscle)
            for axis, (share, dependence) in enumerate(zip(shares, dependences, strict=True))
        )

    def _force_velocity(self, f: Floats, frame: int) -> Floats:
        since, section = self.since[frame], self.section.active
        if since <= 0 or section.shortening_velocity_max_per_s is None:
            return np.ones(f.shape[:2])
        now, before = (np.linalg.norm(g[..., 0], axis=-1) for g in (f, self._before(frame)))
        velocity = (now - before) / since / section.shortening_velocity_max_per_s
        force = energies.force_velocity(velocity, section.hill_curvature, section.eccentric_max)
        return np.where(self.beat.cell_tension[frame][:, None] > 0, force, 1.0)

    def _before(self, frame: int) -> Floats:
        """F of the state before a frame."""
        return self.axes + self.gradient(self.before[frame])

    def _volumetric(self, f: Floats) -> complex:
        """Energy of the mean dilatation of each cell."""
        unloaded = self.volume.sum(axis=1)
        dilatation = np.sum(energies.determinant(f) * self.volume, axis=1) / unloaded - 1
        return self.section.bulk_modulus_kPa * kPa / 2 * np.sum(dilatation**2 * unloaded)

    def _viscous(self, f: Floats, frame: int) -> complex:
        """Potential of the viscous stress, viscosity / (2 dt) |E - E_previous|^2."""
        if self.since[frame] <= 0:
            return 0j
        viscosity = self.section.viscosity_Pa_s / self.since[frame]
        return viscosity / 2 * np.sum(_squared_strain(f, self._before(frame)) * self.volume)

    def _surroundings(self, u: Floats, change: Floats, frame: int) -> float:
        """Work against the pericardium, which rests at end-diastole, and against the springs of an elastic base."""
        pericardium, base = self.section.pericardium, self.section.elastic_base
        work, at_ed = 0.0, self.beat.displacement[0]
        if frame:
            rate = (u - self.before[frame]) / self.since[frame]
            traction = pericardium.spring_kPa_per_mm * kPa_per_mm * (u - at_ed)
            traction += pericardium.dashpot_kPa_s_per_mm * kPa_s_per_mm * rate
            work += _surface_work(self.mesh, self.mesh.epi, traction, change, None)
        if self.section.base == "elastic":
            axial = base.axial_spring_kPa_per_mm * kPa_per_mm
            circumferential = base.circumferential_spring_kPa_per_mm * kPa_per_mm
            work += _surface_work(self.mesh, self.mesh.base, axial * u, change, "axial")
            work += _surface_work(self.mesh, self.mesh.base, circumferential * u, change, "circumferential")
        return work


def _surface_work(mesh: Mesh, facets: Integers, traction: Floats, change: Floats, along: str | None) -> float:
    """int (d . traction) (d . change) dA of nodal vectors (n_nodes, 3) over unloaded facets, J.

    d is the normal, or a direction by name.
    """
    work = 0.0
    for xi, weight in zip(*triangle(), strict=True):
        value, slope = shape(xi[None])[0], shape_gradient(xi[None])[0]
        at, moved, changed = (np.einsum("a,fai->fi", value, nodal[facets]) for nodal in (mesh.nodes, traction, change))
        first, second = (np.einsum("a,fai->fi", slope[:, k], mesh.nodes[facets]) for k in (0, 1))
        area = np.cross(first, second)
        size = np.linalg.norm(area, axis=1)
        axis = {None: area, "axial": 0 * at + [0, 0, 1], "circumferential": np.cross([0, 0, 1], at)}[along]
        axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
        work += weight * np.sum(np.sum(axis * moved, axis=1) * np.sum(axis * changed, axis=1) * size)
    return float(work)


def _squared_strain(f: NDArray, since: Floats) -> NDArray:
    """E : E of E = (F^T F - F_0^T F_0) / 2, shape (...), of F and F_0 of shape (..., 3, 3), real or complex."""
    now, before = (np.swapaxes(one, -1, -2) @ one for one in (f, since))
    return np.sum(((now - before) / 2) ** 2, axis=(-2, -1))


def report(results: Results) -> Report:
    """Rows of the page."""
    blood, passive, active, volumetric, viscous, surroundings = results.loop * 1e6
    source = "virtual work"
    exact = "a closed loop of an elastic energy"
    by_wall, allowed = -1e6 * float(results.loop[1:].sum()), abs(blood)
    loop = "work on the blood over the beat, and that of all stresses (uJ)"
    name = f"imbalance of a frame, {results.cells} cells, over the largest work"
    rows = (
        Row(name, results.error, None, 1e-6, source, ".1e"),
        Row(loop, blood, by_wall, 1e-5 * allowed, source, ".2f"),
        Row("of it, work of the fibres (uJ)", -active, None, None, "", ".2f"),
        Row("lost to viscosity (uJ)", viscous, None, None, "", ".2f"),
        Row("lost to the pericardium (uJ)", surroundings, None, None, "", ".2f"),
        Row("left in the passive wall (uJ)", passive, None, 0.03 * allowed, exact, ".2f"),
        Row("left in the change of volume (uJ)", volumetric, None, 0.01 * allowed, exact, "z.2f"),
    )
    text = (
        "At every frame the motion from the frame before to the frame after is taken as a virtual one: the cavity "
        "pressure must do the work that passive, active, volumetric and viscous stress and the pericardium take up. "
        "Each stress is the rate of an independently implemented energy, by a complex step. What is left of a closed "
        "loop is the step of the frames."
    )
    caption = "Work for the motion about each frame: of the blood (line) and of the stresses of the wall (bars)."
    return Report("Work of blood and wall", text, rows, caption)


@style.styled
def draw(results: Results) -> Figure:
    """Works of each frame."""
    figure = style.figure(7.2, 3.2)
    axes = figure.add_subplot()
    names = ("passive", "active", "volume", "viscous", "pericardium")
    width = np.diff(results.time[:2])[0] * 1e3 * 0.8
    low, high = np.zeros((2, len(results.time)))
    for part, name, colour in zip(results.wall.T * 1e6, names, style.SERIES, strict=False):
        bottom = np.where(part > 0, high, low)
        axes.bar(results.time * 1e3, part, width, bottom, color=colour, label=name)
        low, high = low + np.minimum(part, 0), high + np.maximum(part, 0)
    axes.plot(results.time * 1e3, results.blood * 1e6, color=style.SOLVED, label="blood")
    axes.set(xlabel="Time since end-diastole (ms)", ylabel="Work (µJ)")
    axes.legend(loc="lower right")
    return figure
