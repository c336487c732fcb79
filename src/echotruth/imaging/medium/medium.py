"""The medium: all that echoes in the frames of one view."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats, MaterialPoints, interpolate
from echotruth.heart import Heart
from echotruth.imaging.medium.blood import Blood, Cavity, fill
from echotruth.imaging.medium.phantom import Scatterers, scatter
from echotruth.imaging.medium.random_process import Random, fading, wandering
from echotruth.imaging.medium.surroundings import Following, outside, surround
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import read_loop

Arrays = dict[str, NDArray[Any]]
InBeam = Callable[[Floats], NDArray[np.bool_]]
"""Positions in the image (n, 3), m, to whether they are within the beam, (n,)."""


def seed(config: Config, heart: Heart, plane: Plane, random: Random, in_beam: InBeam) -> Arrays:
    """Everything that echoes in a view, as arrays that can be handed on; what no frame's beam reaches is left out.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    random : Random
        Of each kind of scatterer.
    in_beam : callable
        As :meth:`echotruth.imaging.rf.full_matrix.FullMatrix.in_beam`.

    Returns
    -------
    dict of ndarray
        cell, xi and amplitude of the scatterers in the wall; blood_* and around_* where there are such.
    """
    frames = [heart.positions(frame) for frame in range(len(heart.displacement))]
    wall = scatter(config, heart, plane, random("phantom"))
    arrays: Arrays = {"cell": wall.points.cell, "xi": wall.points.xi, "amplitude": wall.amplitude}
    arrays = _ever(arrays, (wall.image(nodes, heart.cells, plane) for nodes in frames), in_beam)
    if config.realism.blood.level_dB is not None:
        blood, cavity = fill(config, heart, random("blood")), Cavity(heart.endo)
        found = {"blood_cell": blood.points.cell, "blood_xi": blood.points.xi}
        found |= {"blood_room": blood.room, "blood_amplitude": blood.amplitude}
        carried = (interpolate(cavity.positions(nodes), cavity.cells, blood.points) for nodes in frames)
        reach = FARTHEST * diffusion(config, read_loop(config.loop).period)
        arrays |= _ever(found, (_nearer(plane.image(place), reach) for place in carried), in_beam)
    if config.realism.surroundings.level_dB is not None:
        around = surround(config, heart, plane, random("surroundings"))
        moves = Following(heart, around.position, config.realism.surroundings.si().follow)
        found = {"around_position": around.position, "around_amplitude": around.amplitude}
        arrays |= _ever(found, (plane.image(moves(frame)) for frame in range(len(frames))), in_beam)
    return arrays


def _ever(arrays: Arrays, places: Iterable[Floats], in_beam: InBeam) -> Arrays:
    """Of arrays over scatterers, those that are in the beam in any frame; places (n, 3), m, are those of each."""
    inside = np.logical_or.reduce([in_beam(place) for place in places])
    return {name: values[inside] for name, values in arrays.items()}


def _nearer(place: Floats, distance: float) -> Floats:
    """Places (n, 3), m, moved to the plane by a distance, m, or into it."""
    beside = np.maximum(np.abs(place[:, 2]) - distance, 0)
    return np.column_stack([place[:, :2], beside])


FARTHEST = 5
"""How far blood is taken to diffuse over a cycle, over the standard deviation of its offset."""


def diffusion(config: Config, period: float) -> float:
    """Standard deviation of the offset of blood after a time, s, along an axis, m; see :func:`wandering`."""
    constant, wavelength = _flow(config)
    return float(np.sqrt(2 * period / constant) * wavelength / (4 * np.pi))


def _flow(config: Config) -> tuple[float, float]:
    """Time in which the echo of blood is another, s, and the wavelength, m."""
    probe = config.probe.si()
    return config.realism.blood.si().time, probe.sound_speed / probe.frequency


class Medium:
    """All that echoes, frame by frame.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    time : ndarray of shape (frame,), s
    seeded : dict of ndarray
        As :func:`seed` leaves it.
    random : Random
        Of what changes from frame to frame.
    """

    def __init__(
        self, config: Config, heart: Heart, plane: Plane, *, time: Floats, seeded: Arrays, random: Random
    ) -> None:
        self._config, self._heart, self._plane = config, heart, plane
        points = MaterialPoints(seeded["cell"], seeded["xi"])
        self._wall = Scatterers(points, seeded["amplitude"], config.phantom.in_plane_only)
        self._strength = self._speckle(seeded["amplitude"], time, "wall", random)
        self._blood = self._around = None
        if "blood_cell" in seeded:
            points = MaterialPoints(seeded["blood_cell"], seeded["blood_xi"])
            self._blood = Blood(points, seeded["blood_room"], seeded["blood_amplitude"])
            self._flow = wandering(len(points), time, *_flow(config), random)
        if "around_position" in seeded:
            self._around = Following(heart, seeded["around_position"], config.realism.surroundings.si().follow)
            self._around_strength = self._speckle(seeded["around_amplitude"], time, "surroundings", random)

    def _speckle(self, amplitude: Floats, time: Floats, name: str, random: Random) -> Callable[[int], Floats]:
        constant = self._config.realism.decorrelation.si().time
        return (lambda frame: amplitude) if constant is None else fading(amplitude, time, constant, name, random)

    def wall(self, frame: int) -> tuple[Floats, Floats]:
        """The scatterers of the wall alone: positions in the image (n, 3), m, and amplitudes (n,)."""
        return self._wall.image(self._heart.positions(frame), self._heart.cells, self._plane), self._strength(frame)

    def in_wall(self, frame: int, lateral: Floats, axial: Floats) -> NDArray[np.bool_]:
        """Whether places in the image, each as the coordinates (any shape), m, lie in the wall in a frame."""
        places = np.stack([lateral, axial, np.zeros_like(lateral)], axis=-1).reshape(-1, 3)
        found = locate(self._heart.positions(frame), self._heart.cells, self._plane.heart(places))
        return (found.cell >= 0).reshape(lateral.shape)

    def __call__(self, frame: int) -> tuple[Floats, Floats]:
        """Positions in the image (n, 3), m, and amplitudes (n,) of all scatterers in a frame."""
        parts = [self.wall(frame)]
        if self._blood is not None:
            position, amplitude = self._blood.at(frame, self._heart, self._flow)
            parts.append((self._plane.image(position), amplitude))
        if self._around is not None:
            position, amplitude = self._around(frame), self._around_strength(frame)
            there = outside(self._heart, frame, position)
            there &= self._plane.image(position)[:, 1] > 0
            parts.append((self._plane.image(position[there]), amplitude[there]))
        positions, amplitudes = zip(*parts, strict=True)
        return np.concatenate(positions), np.concatenate(amplitudes)
