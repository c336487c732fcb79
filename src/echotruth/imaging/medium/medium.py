"""The medium: all scatterers in the frames of one view."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config, Phantom
from echotruth.config.realism import Tissue
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats, MaterialPoints, interpolate
from echotruth.heart import Heart
from echotruth.imaging.medium.backscatter import FibreEcho
from echotruth.imaging.medium.blood import Blood, Cavity, seed_blood
from echotruth.imaging.medium.borders import Border, border_amplitude, seed_border
from echotruth.imaging.medium.random_process import Random, ar1, brownian, diffusion_std
from echotruth.imaging.medium.surroundings import SurroundingsMotion, outside_heart, seed_surroundings
from echotruth.imaging.medium.wall import Scatterers, seed_wall
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import read_loop

Arrays = dict[str, NDArray[Any]]
InBeam = Callable[[Floats], NDArray[np.bool_]]
"""Positions in the image (n, 3), m, to whether they are within the beam, (n,)."""

BORDERS = {"endocardium": "endo", "epicardium": "epi"}
"""Names of the borders of the wall, and of their surfaces of the mesh."""

MAX_DIFFUSION = 5
"""Offset that blood is assumed not to exceed over a cycle, in standard deviations."""


def seed_medium(config: Config, heart: Heart, plane: Plane, random: Random, in_beam: InBeam) -> Arrays:
    """Seed all scatterers of a view, as arrays that can be stored, omitting scatterers that never enter the beam.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    random : Random
        For each kind of scatterer.
    in_beam : callable
        As :meth:`echotruth.imaging.rf.full_matrix.FullMatrix.in_beam`.

    Returns
    -------
    dict of ndarray
        cell, xi and amplitude of the scatterers in the wall; endocardium_*, epicardium_*, blood_* and surroundings_*
        where there are such.
    """
    frames = [heart.positions(frame) for frame in range(len(heart.displacement))]
    wall = seed_wall(config, heart, plane, random("phantom"))
    arrays: Arrays = {"cell": wall.points.cell, "xi": wall.points.xi, "amplitude": wall.amplitude}
    arrays = _ever_in_beam(arrays, (wall.image_positions(nodes, heart.cells, plane) for nodes in frames), in_beam)
    for name, (surface, level_dB) in _borders(config).items():
        facets, xi = seed_border(config, heart, surface, random(name))
        border = Border(facets, xi, border_amplitude(config, level_dB))
        candidates: Arrays = {f"{name}_facets": facets, f"{name}_xi": xi}
        arrays |= _ever_in_beam(candidates, (plane.to_image(border.positions(nodes)) for nodes in frames), in_beam)
    if config.realism.blood.level_dB is not None:
        blood, cavity = seed_blood(config, heart, random("blood")), Cavity(heart.endo)
        candidates = {"blood_cell": blood.points.cell, "blood_xi": blood.points.xi}
        candidates |= {"blood_jacobian_threshold": blood.jacobian_threshold, "blood_amplitude": blood.amplitude}
        carried = (interpolate(cavity.positions(nodes), cavity.cells, blood.points) for nodes in frames)
        offset = MAX_DIFFUSION * diffusion_std(read_loop(config.loop).period, *_blood_decorrelation(config))
        nearest = (_moved_towards_plane(plane.to_image(position), offset) for position in carried)
        arrays |= _ever_in_beam(candidates, nearest, in_beam)
    if config.realism.surroundings.level_dB is not None:
        position, amplitude = seed_surroundings(config, heart, plane, random("surroundings"))
        motion = SurroundingsMotion(heart, position, config.realism.surroundings.si().motion_decay)
        candidates = {"surroundings_position": position, "surroundings_amplitude": amplitude}
        arrays |= _ever_in_beam(candidates, (plane.to_image(motion(k)) for k in range(len(frames))), in_beam)
    return arrays


def _ever_in_beam(arrays: Arrays, positions: Iterable[Floats], in_beam: InBeam) -> Arrays:
    """Entries of the scatterers that are in the beam in any frame; positions in the image of each frame (n, 3), m."""
    kept = np.logical_or.reduce([in_beam(position) for position in positions])
    return {name: values[kept] for name, values in arrays.items()}


def _moved_towards_plane(position: Floats, distance: float) -> Floats:
    """Positions (n, 3), m, moved towards the plane by a distance, m, at most onto it."""
    elevation = np.maximum(np.abs(position[:, 2]) - distance, 0)
    return np.column_stack([position[:, :2], elevation])


def _borders(config: Config) -> dict[str, tuple[str, float]]:
    """Borders that echo: their surface of the mesh and their level, dB."""
    levels = {name: getattr(config.realism.borders, f"{name}_dB") for name in BORDERS}
    return {name: (BORDERS[name], level) for name, level in levels.items() if level is not None}


def _blood_decorrelation(config: Config) -> tuple[float, float]:
    """Time constant of the echo of blood, s, and wavelength, m."""
    probe = config.probe.si()
    return config.realism.blood.si().decorrelation_time, probe.sound_speed / probe.frequency


class Medium:
    """All scatterers, frame by frame.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    time : ndarray of shape (frame,), s
    seeded : dict of ndarray
        As :func:`seed_medium` returns it.
    random : Random
        For what changes from frame to frame.
    """

    def __init__(
        self, config: Config, heart: Heart, plane: Plane, *, time: Floats, seeded: Arrays, random: Random
    ) -> None:
        self._config, self._heart, self._plane = config, heart, plane
        points = MaterialPoints(seeded["cell"], seeded["xi"])
        self._wall = Scatterers(points, seeded["amplitude"], config.phantom.in_plane_only)
        self._wall_amplitude = self._amplitudes(seeded["amplitude"], time, "wall", random)
        backscatter = config.realism.backscatter
        depends = backscatter.anisotropy_dB or backscatter.fibre_strain_dB
        self._fibre_echo = FibreEcho(backscatter, heart, plane, points) if depends else None
        self._borders = [
            Border(seeded[f"{name}_facets"], seeded[f"{name}_xi"], border_amplitude(config, level_dB))
            for name, (_, level_dB) in _borders(config).items()
        ]
        self._blood = self._surroundings = None
        if "blood_cell" in seeded:
            points = MaterialPoints(seeded["blood_cell"], seeded["blood_xi"])
            self._blood = Blood(points, seeded["blood_jacobian_threshold"], seeded["blood_amplitude"])
            self._diffusion = brownian(len(points), time, *_blood_decorrelation(config), random)
        if "surroundings_position" in seeded:
            decay_length = config.realism.surroundings.si().motion_decay
            self._surroundings = SurroundingsMotion(heart, seeded["surroundings_position"], decay_length)
            amplitude = seeded["surroundings_amplitude"]
            self._surroundings_amplitude = self._amplitudes(amplitude, time, "surroundings", random)

    def _amplitudes(self, amplitude: Floats, time: Floats, name: str, random: Random) -> Callable[[int], Floats]:
        """Amplitudes by frame: constant, or decorrelating."""
        constant = self._config.realism.decorrelation.si().time
        return (lambda frame: amplitude) if constant is None else ar1(amplitude, time, constant, name, random)

    def wall(self, frame: int) -> tuple[Floats, Floats, Floats]:
        """Positions in the image (n, 3), m, amplitudes (n,) and exponents (n,) of the scatterers in the wall."""
        position = self._wall.image_positions(self._heart.positions(frame), self._heart.cells, self._plane)
        amplitude = self._wall_amplitude(frame)
        if self._fibre_echo is not None:
            amplitude = amplitude * self._fibre_echo(frame, position)
        return _of_tissue(self._config.phantom, position, amplitude)

    def in_wall(self, frame: int, lateral: Floats, axial: Floats) -> NDArray[np.bool_]:
        """Whether points of the image lie in the wall in a frame; all arrays of one shape, coordinates in m."""
        position = np.stack([lateral, axial, np.zeros_like(lateral)], axis=-1).reshape(-1, 3)
        points = locate(self._heart.positions(frame), self._heart.cells, self._plane.to_heart(position))
        return (points.cell >= 0).reshape(lateral.shape)

    def __call__(self, frame: int) -> tuple[Floats, Floats, Floats]:
        """Positions in the image (n, 3), m, amplitudes (n,) and exponents (n,) of all scatterers in a frame."""
        parts, realism = [self.wall(frame)], self._config.realism
        nodes = self._heart.positions(frame)
        for border in self._borders:
            position = self._plane.to_image(border.positions(nodes))
            parts.append(_of_tissue(self._config.phantom, position, border.amplitudes(nodes, self._heart.nodes)))
        if self._blood is not None:
            position, amplitude = self._blood.at(frame, self._heart, self._diffusion)
            parts.append(_of_tissue(realism.blood, self._plane.to_image(position), amplitude))
        if self._surroundings is not None:
            position, amplitude = self._surroundings(frame), self._surroundings_amplitude(frame)
            present = outside_heart(self._heart, frame, position)
            present &= self._plane.to_image(position)[:, 1] > 0
            position = self._plane.to_image(position[present])
            parts.append(_of_tissue(realism.surroundings, position, amplitude[present]))
        positions, amplitudes, exponents = map(np.concatenate, zip(*parts, strict=True))
        return positions, amplitudes, exponents


def _of_tissue(tissue: Phantom | Tissue, position: Floats, amplitude: Floats) -> tuple[Floats, Floats, Floats]:
    """Scatterers (n,) with the exponent of their tissue."""
    return position, amplitude, np.full(len(amplitude), tissue.scattering_exponent)
