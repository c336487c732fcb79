"""The work of the blood against that of the wall, at every frame and over the beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats
from echotruth.mechanics.fibres import fibre_frames, gradients
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.report import style
from validation import energies, heart
from validation.report import Report, Row

_STEP = 1e-30
"""Imaginary part of a share of a motion: the rate of an energy by a complex step has no cancellation."""


@dataclass(frozen=True)
class Numbers:
    """Powers and works.

    Attributes
    ----------
    cells : int
    time : ndarray of shape (n_frames,), s
    blood : ndarray of shape (n_frames,), J
        Work of the cavity pressure for the motion from the frame before to the frame after.
    wall : ndarray of shape (n_frames, 4), J
        Work of the passive, active, volumetric and viscous stress for the same motion.
    loop : ndarray of shape (5,), J
        Over the beat: the work of the heart on the blood, and what the four took up.
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


def measure(quick: bool = False) -> Numbers:
    """Works of the heart that ships, or of a coarse one where it is to be quick."""
    solved = heart.solved(*((12, 6, 1) if quick else heart.SHIPPED))
    parts, beat = _Parts(solved), solved.beat
    ways = np.roll(beat.displacement, -1, axis=0) - np.roll(beat.displacement, 1, axis=0)
    works = np.array([parts.works(frame, way) for frame, way in enumerate(ways)])
    # Half of each: a way leads over two frames.
    loop = np.array([-works[:, 0].sum(), *works[:, 1:].sum(axis=0)]) / 2
    return Numbers(len(solved.wall.mesh.cells), parts.time, works[:, 0], works[:, 1:], loop)


class _Parts:
    """The energies of a solved heart by formulas that its solver does not know."""

    def __init__(self, solved: heart.Solved) -> None:
        self.mesh, self.beat, self.pasts = solved.wall.mesh, solved.beat, solved.pasts
        self.section, xi = solved.config.mechanics, tetrahedron()[0]
        slope, volume = gradients(self.mesh, xi)
        self.volume = volume * tetrahedron()[1]
        frames = fibre_frames(self.mesh, solved.wall.depth, solved.config.fibres, xi, solved.config.seed)
        self.slope = np.einsum("cqai,cqji->cqaj", slope, frames)
        self.time = np.arange(len(self.beat.displacement)) * solved.period / len(self.beat.displacement)
        self.frames, self.spread = frames, solved.spread

    def gradient(self, displacement: Floats) -> Floats:
        """F - I, its columns along the fibre axes."""
        return np.einsum("cai,cqaj->cqij", displacement[self.mesh.cells], self.slope)

    def works(self, frame: int, way: Floats) -> tuple[float, ...]:
        """Work of the blood, and of the passive, active, volumetric and viscous stress, for a motion at a frame, J."""
        here, beat = self.beat.displacement[frame], self.beat
        f = np.swapaxes(self.frames, -1, -2) + self.gradient(here) + 1j * _STEP * self.gradient(way)
        stiffness = beat.stiffness
        parts = (
            stiffness * self._passive(f),
            beat.tension[frame] * self._active(f),
            self._volumetric(f),
            self._viscous(f, frame),
        )
        return self._blood(here, way, beat.pressure[frame]), *(float(part.imag / _STEP) for part in parts)

    def _blood(self, here: Floats, way: Floats, pressure: float) -> float:
        """Pressure times the growth of the volume, which is a cubic function of the share of the way."""

        def growth(share: float) -> float:
            ends = (cavity_volume(self.mesh.nodes + here + side * share * way, self.mesh.endo) for side in (1, -1))
            return next(ends) - next(ends)

        return pressure * (8 * growth(1.0) - growth(2.0)) / 12

    def _passive(self, f: Floats) -> complex:
        local = self.section.local_bulk / 2 * (energies.determinant(f) - 1) ** 2
        return np.sum((energies.passive(f, self.section.material) + local) * self.volume)

    def _active(self, f: Floats) -> complex:
        power = 2.0 if self.section.active.stress == "cauchy" else 0.0
        return np.sum(energies.active(f, self.section.active.length_dependence, power) * self.volume)

    def _volumetric(self, f: Floats) -> complex:
        """Of the mean volume of each cell."""
        unloaded = self.volume.sum(axis=1)
        growth = np.sum(energies.determinant(f) * self.volume, axis=1) / unloaded - 1
        return self.section.si().bulk_modulus / 2 * np.sum(growth**2 * unloaded)

    def _viscous(self, f: Floats, frame: int) -> complex:
        """Potential of the viscous stress: half of viscosity over time, times the growth of strain squared."""
        past = self.pasts[frame]
        if past.time <= 0:
            return 0j
        before = np.swapaxes(self.frames, -1, -2) + self.gradient(self.spread(past.state.solution))
        growth = (_square(f) - _square(before)) / 2
        return self.section.si().viscosity / (2 * past.time) * np.sum(np.sum(growth**2, axis=(-2, -1)) * self.volume)


def _square(f: Floats) -> Floats:
    """F^T F of F of shape (..., 3, 3), complex too."""
    return np.swapaxes(f, -1, -2) @ f


def report(numbers: Numbers) -> Report:
    """Rows of the page."""
    blood, passive, active, volumetric, viscous = numbers.loop * 1e6
    source = "virtual work, with energies written down anew"
    exact = "a closed loop of an elastic energy; what is left is the step of the frames"
    taken, allowed = -1e6 * float(numbers.loop[1:].sum()), abs(blood)
    name = f"imbalance of a frame, {numbers.cells} cells, over the largest work"
    rows = (
        Row(name, numbers.error, None, 1e-6, source, ".1e"),
        Row(
            "work on the blood over the beat, and that of all stresses (uJ)",
            blood,
            taken,
            1e-5 * allowed,
            source,
            ".2f",
        ),
        Row("of it, work of the fibres (uJ)", -active, None, None, "", ".2f"),
        Row("lost to viscosity (uJ)", viscous, None, None, "", ".2f"),
        Row("left in the passive wall (uJ)", passive, None, 0.03 * allowed, exact, ".2f"),
        Row("left in the change of volume (uJ)", volumetric, None, 0.01 * allowed, exact, "z.2f"),
    )
    text = (
        "At every frame the motion from the frame before to the frame after is taken as a virtual one: the cavity "
        "pressure must do the work that passive, active, volumetric and viscous stress take up. Each of these is the "
        "rate of an energy, by a complex step."
    )
    caption = "Work for the motion about each frame: of the blood (line) and of the stresses of the wall (bars)."
    return Report("Work of blood and wall", text, rows, caption)


@style.styled
def draw(numbers: Numbers) -> Figure:
    """Works of each frame."""
    sheet = style.figure(7.2, 3.2)
    axes = sheet.add_subplot()
    colours = (style.LONGITUDINAL, style.RADIAL, style.ASKED, style.CIRCUMFERENTIAL)
    names, width = ("passive", "active", "volume", "viscous"), np.diff(numbers.time[:2])[0] * 1e3 * 0.8
    low, high = np.zeros((2, len(numbers.time)))
    for part, name, colour in zip(numbers.wall.T * 1e6, names, colours, strict=True):
        foot = np.where(part > 0, high, low)
        axes.bar(numbers.time * 1e3, part, width, foot, color=colour, label=name)
        low, high = low + np.minimum(part, 0), high + np.maximum(part, 0)
    axes.plot(numbers.time * 1e3, numbers.blood * 1e6, color=style.MET, label="blood")
    axes.set(xlabel="time (ms)", ylabel="work (uJ)")
    axes.legend(loc="lower right")
    return sheet
