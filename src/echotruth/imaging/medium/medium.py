"""The medium: all scatterers in the frames of one view."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config, Phantom
from echotruth.config.realism import Tissue
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats, MaterialPoints, interpolate
from echotruth.heart import Heart
from echotruth.imaging.medium.anatomy import CAVITIES
from echotruth.imaging.medium.backscatter import FibreEcho, variation
from echotruth.imaging.medium.blood import Blood, Cavity, seed_blood
from echotruth.imaging.medium.borders import Border, border_amplitude, seed_border
from echotruth.imaging.medium.mitral_valve import Leaflets, seed_leaflets
from echotruth.imaging.medium.papillary_muscles import PapillaryMuscles, seed_papillary_muscles
from echotruth.imaging.medium.random_process import Random, ar1, brownian, diffusion_std
from echotruth.imaging.medium.surroundings import AroundHeart, exponents, seed_surroundings
from echotruth.imaging.medium.wall import Scatterers, seed_wall
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import read_loop

Arrays = dict[str, NDArray[Any]]
InBeam = Callable[[Floats], NDArray[np.bool_]]
"""Positions in the image (n, 3), m, to whether they are within the beam, (n,)."""

BORDERS = {"endocardium": "endo", "epicardium": "epi"}
"""Names of the borders of the wall, and of their surfaces of the mesh."""

IN_CAVITY: dict[str, Any] = {"leaflets": Leaflets, "papillary_muscles": PapillaryMuscles}
"""Names of the bodies in the cavity, and their classes."""

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
        cell, xi and amplitude of the scatterers in the wall; endocardium_*, epicardium_*, blood_*, surroundings_*,
        leaflets_* and
        papillary_muscles_* where there are such.
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
        drawn = seed_surroundings(config, heart, plane, random("surroundings"))
        around = AroundHeart(config, heart, plane, drawn["position"], drawn["tissue"])
        candidates = {f"surroundings_{name}": values for name, values in drawn.items()}
        arrays |= _ever_in_beam(candidates, map(around.positions, range(len(frames))), in_beam)
    for name, seed in _in_cavity(config).items():
        drawn = seed(config, heart, random(name))
        body = IN_CAVITY[name](heart, **drawn)
        candidates = {f"{name}_{key}": values for key, values in drawn.items()}
        arrays |= _ever_in_beam(candidates, (plane.to_image(body.positions(k)) for k in range(len(frames))), in_beam)
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


def _in_cavity(config: Config) -> dict[str, Callable[..., Arrays]]:
    """Bodies in the cavity that echo: functions that draw their scatterers."""
    seeds: dict[str, Callable[..., Arrays]] = {"leaflets": seed_leaflets, "papillary_muscles": seed_papillary_muscles}
    return {name: seed for name, seed in seeds.items() if getattr(config.realism.neighbours, f"{name}_dB") is not None}


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
        self._variation = self._varied(partial(interpolate, heart.nodes, heart.cells, points), random)
        self._borders = self._seeded_borders(seeded, random)
        self._blood: Blood | None = None
        self._surroundings: AroundHeart | None = None
        if "blood_cell" in seeded:
            points = MaterialPoints(seeded["blood_cell"], seeded["blood_xi"])
            self._blood = Blood(points, seeded["blood_jacobian_threshold"], seeded["blood_amplitude"])
            self._diffusion = brownian(len(points), time, *_blood_decorrelation(config), random)
        if "surroundings_position" in seeded:
            tissue = seeded["surroundings_tissue"]
            self._surroundings = AroundHeart(config, heart, plane, seeded["surroundings_position"], tissue)
            self._surroundings_exponent = exponents(config, tissue)
            self._surroundings_amplitude = self._amplitudes_around(seeded, time, random)
        self._bodies = [
            IN_CAVITY[name](heart, **_named(name, seeded)) for name in IN_CAVITY if f"{name}_amplitude" in seeded
        ]

    def _varied(self, unloaded: Callable[[], Floats], random: Random) -> Floats | float:
        """Factors (n,) on the amplitudes of muscle or a border, whose unloaded positions are (n, 3), m; or one."""
        backscatter = self._config.realism.backscatter
        return variation(backscatter, unloaded(), random("variation")) if backscatter.variation_dB else 1.0

    def _seeded_borders(self, seeded: Arrays, random: Random) -> list[Border]:
        borders = []
        for name, (_, level_dB) in _borders(self._config).items():
            border = Border(seeded[f"{name}_facets"], seeded[f"{name}_xi"], border_amplitude(self._config, level_dB))
            varied = self._varied(partial(border.positions, self._heart.nodes), random)
            borders.append(replace(border, amplitude=border.amplitude * varied))
        return borders

    def _amplitudes_around(self, seeded: Arrays, time: Floats, random: Random) -> Callable[[int], Floats]:
        """Amplitudes by frame of what is around the heart: blood changes as that in the cavity."""
        amplitude, blood = seeded["surroundings_amplitude"], np.isin(seeded["surroundings_tissue"], CAVITIES)
        sign, strength = np.sign(amplitude), np.abs(amplitude)
        fading = self._amplitudes(sign[~blood], time, "surroundings", random)
        flowing = ar1(sign[blood], time, self._config.realism.blood.si().decorrelation_time, "chambers", random)

        def of_frame(frame: int) -> Floats:
            signs = np.empty_like(sign)
            signs[~blood], signs[blood] = fading(frame), flowing(frame)
            return strength * signs

        return of_frame

    def _amplitudes(self, amplitude: Floats, time: Floats, name: str, random: Random) -> Callable[[int], Floats]:
        """Amplitudes by frame: constant, or decorrelating."""
        constant = self._config.realism.decorrelation.si().time
        return (lambda frame: amplitude) if constant is None else ar1(amplitude, time, constant, name, random)

    def wall(self, frame: int) -> tuple[Floats, Floats, Floats]:
        """Positions in the image (n, 3), m, amplitudes (n,) and exponents (n,) of the scatterers in the wall."""
        position = self._wall.image_positions(self._heart.positions(frame), self._heart.cells, self._plane)
        amplitude = self._wall_amplitude(frame) * self._variation
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
            position = self._surroundings.positions(frame)
            present = self._surroundings.present(frame, position)
            amplitude = self._surroundings_amplitude(frame)[present]
            parts.append((position[present], amplitude, self._surroundings_exponent[present]))
        for body in self._bodies:
            position = body.positions(frame)
            present = locate(nodes, self._heart.cells, position).cell < 0
            position = self._plane.to_image(position[present])
            parts.append(_of_tissue(self._config.phantom, position, body.amplitudes(frame)[present]))
        together = tuple(map(np.concatenate, zip(*parts, strict=True)))
        return together[0], together[1], together[2]


def _named(name: str, seeded: Arrays) -> Arrays:
    """Arrays whose names begin with that of a kind of scatterers, without it."""
    return {key.removeprefix(f"{name}_"): values for key, values in seeded.items() if key.startswith(f"{name}_")}


def _of_tissue(tissue: Phantom | Tissue, position: Floats, amplitude: Floats) -> tuple[Floats, Floats, Floats]:
    """Scatterers (n,) with the exponent of their tissue."""
    return position, amplitude, np.full(len(amplitude), tissue.scattering_exponent)
