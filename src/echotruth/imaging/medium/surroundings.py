"""Surroundings: scatterers around the heart, in the part of space that the probe images."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import Sector, scan_lines
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.anatomy import (
    CAVITIES,
    FOLLOWING_BASE,
    LUNG_FADING_DB,
    POSTERIOR_FADING_DB,
    POSTERIOR_NARROWNESS,
    RIGHT_SHORTENING,
    WALLS,
    Anatomy,
    Place,
    above_lid,
    anatomy_of,
    chest_wall_depth,
    strata_dB,
)
from echotruth.imaging.medium.aortic_root import AORTIC_WALL_DB, aortic_tissue
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.medium.body import Body, Echoes, Scene
from echotruth.imaging.medium.filling import emptied, volumes
from echotruth.imaging.medium.random_process import ar1
from echotruth.imaging.rf.probe import wavelength
from echotruth.imaging.view import Plane
from echotruth.units import mm, ms, per_mm3, um

NEIGHBOURS = 8
"""Epicardial nodes from which the motion of a scatterer is interpolated."""
STD, CUT = 0.5, 2.0
"""Standard deviation of the scatterers across the plane over half the thickness of the beam, and where they end, in
standard deviations: at that half thickness."""
DRAWN, SHOWN = 1.3, 1.01
"""Extent of the scatterers that are drawn, some of which move into the scan, and of those that echo in a frame, over
that of the lines. Echoes are made by sectors of the scan, so that more of them would cost time."""
LUNG_SIDE = 0.5
"""Share of lung in the mixture beside a free wall along the beam."""
LUNG_SHARE = 1 / 3
"""Share of lung from which on the mixture is called lung."""


class SurroundingsMotion:
    """Motion of the surroundings: that of the nearest epicardium times exp(-distance / decay length).

    Nodes are weighted by the inverse square of their distance. With chambers, the distance is that from them: the right
    ventricle moves with the septum, and its free wall also towards it as the left ventricle empties; the atria move
    with the base, less towards their roof, and what lies beside them is drawn along, so that there is no gap. The chest
    wall is at rest.

    What moves rigidly before the probe is the heart with all that lies as deep or deeper. Above it this motion falls in
    proportion to the range, to 0 at the array; the chest wall has none, as the probe is pressed against it.

    Parameters
    ----------
    heart : Heart
    position : ndarray of shape (n, 3), m
        Scatterers at end-diastole, in the heart frame.
    decay_length : float, m
        0 for surroundings that do not follow the beat.
    tissue : ndarray of shape (n,), uint8, optional
        Default: connective tissue alone.
    """

    def __init__(
        self, heart: Heart, position: Floats, decay_length: float, tissue: NDArray[np.uint8] | None = None
    ) -> None:
        self._heart, self._position, self._at_rest = heart, position, decay_length == 0
        if heart.rigid is not None:
            self._rigid_share = self._depth_share(heart.rigid.centre, tissue)
        if self._at_rest:
            return
        from scipy.spatial import cKDTree  # takes 50 ms, and few views have surroundings

        self._epi = epicardial_nodes(heart)
        distance, self._nearest = cKDTree(heart.positions(0)[self._epi]).query(position, NEIGHBOURS)
        weight = 1 / np.maximum(distance, 1e-9) ** 2
        share = np.exp(-distance[:, :1] / decay_length)
        self._inward = None
        if tissue is not None and tissue.any():
            share, self._inward = self._with_neighbours(decay_length, tissue)
            self._emptied = emptied(volumes(heart))
        self._weight = weight / weight.sum(axis=1, keepdims=True) * share

    def _with_neighbours(self, decay_length: float, tissue: NDArray[np.uint8]) -> tuple[Floats, Floats]:
        """Share (n, 1) of the motion of the epicardium, and motion (n, 3), m, towards the septum at end-systole."""
        anatomy = anatomy_of(self._heart)
        place = anatomy.place(self._position)
        share = np.exp(-np.maximum(place.distance - place.gap - place.wall, 0) / decay_length)
        inward = -RIGHT_SHORTENING * (share * np.minimum(place.distance, place.gap))[:, None] * place.outward
        atrial = np.isin(tissue, FOLLOWING_BASE)
        of_atria = anatomy.atrial_share(place)
        share = np.maximum(share, of_atria * np.exp(-anatomy.atrial_distance(self._position) / decay_length))
        share[atrial] = of_atria[atrial]
        at_rest = tissue == TissueLabel.CHEST_WALL
        share[at_rest] = 0
        inward[atrial | at_rest] = 0
        return share[:, None], inward

    def _depth_share(self, array: Floats, tissue: NDArray[np.uint8] | None) -> Floats:
        """Share (n, 1) of the rigid motion before an array, whose middle is given, (3,), m."""
        nearest = np.linalg.norm(self._heart.positions(0) - array, axis=1).min()
        share = np.minimum(np.linalg.norm(self._position - array, axis=1) / nearest, 1.0)
        return np.where(tissue == TissueLabel.CHEST_WALL, 0.0, share)[:, None]

    def __call__(self, frame: int) -> Floats:
        """Positions in a frame, (n, 3), m."""
        position, rigid = self._position if self._at_rest else self._following(frame), self._heart.rigid
        return position if rigid is None else position + self._rigid_share * rigid.displacement(frame, position)

    def _following(self, frame: int) -> Floats:
        """Positions in a frame, (n, 3), m, without a rigid motion."""
        displacement = self._beat(frame)[self._epi]
        position = self._position + np.einsum("pk,pki->pi", self._weight, displacement[self._nearest])
        return position if self._inward is None else position + self._emptied[frame] * self._inward

    def _beat(self, frame: int) -> Floats:
        """Displacement of the nodes since end-diastole, (n_nodes, 3), m, without a rigid motion."""
        heart = self._heart
        if heart.rigid is None:
            return heart.displacement[frame] - heart.displacement[0]
        return heart.rigid.undone(frame, heart.positions(frame)) - heart.positions(0)


@dataclass(frozen=True, eq=False)
class Surroundings(Body):
    """Scatterers around the heart; in a slice they keep their distance from its plane, whatever the heart does.

    Attributes
    ----------
    position : ndarray of shape (n, 3), m
        At end-diastole, in the heart frame: in the scan from `start_mm` to the imaging depth, and in the beam in
        elevation, or before the array that images a volume; those inside the heart are hidden until it moves away.
    amplitude : ndarray of shape (n,)
    tissue : ndarray of shape (n,), uint8
        A :class:`echotruth.imaging.labels.TissueLabel`.
    """

    name, level = "surroundings", "surroundings.level_dB"
    position: Floats
    amplitude: Floats
    tissue: NDArray[np.uint8]

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        """Draw scatterers evenly over the resolution cells of what the probe images.

        A cell is as wide as its range is long and as thick as the beam, so that scatterers are drawn uniformly over
        angle and range, and across the plane as a Gaussian with half the beam's half thickness, where they are seen
        best. Where they are sparser they are stronger: the mean echo power of a volume is that of muscle times the
        level of its tissue. Their amplitudes have one magnitude in a place and a random sign, which takes fewer of them
        for developed speckle than normally distributed ones: the SNR of the envelope is 1.68 to 1.73 at 3 to 12 mm in
        the default array with a density of 0.15, and 1.81 to 1.84 with 0.3; with normally distributed ones it is 1.42
        to 1.48 and 1.62 to 1.72. The wall has 1.82, and 1.91 is fully developed.
        """
        config, plane, random = scene.config, scene.plane, scene.random(cls.name)
        draw = _drawn_in_box if plane.is_volume else _drawn_evenly
        position, density = draw(config, random)
        in_heart = plane.to_heart(position)
        tissue, power = tissues(config, scene.heart, plane, in_heart)
        sign = np.where(random.random(len(position)) < 0.5, -1.0, 1.0)
        amplitude = sign * np.sqrt(power * (config.phantom.density_per_mm3 * per_mm3) / density)
        present = power > 0
        return cls(scene, in_heart[present], amplitude[present], tissue[present])

    def positions(self, frame: int) -> Floats:
        position = self.scene.plane.to_image(self._motion(frame))
        if not self.scene.plane.is_volume:
            position[:, 2] = self.scene.plane.to_image(self.position)[:, 2]
        return position

    def present(self, frame: int, position: Floats) -> NDArray[np.bool_]:
        """Whether those at positions in the image (n, 3), m, are in the scan and not in the heart: (n,)."""
        config, present = self.scene.config, position[:, 1] > 0
        column = config.realism.neighbours.chambers_dB is not None
        if not self.scene.plane.is_volume:
            scan = scan_lines(config.probe, config.rf)
            line, _ = scan.to_scan_coordinates(position[:, 0], position[:, 1])
            present &= np.abs(2 * line / (len(scan.angle) - 1) - 1) < SHOWN
        in_heart = self.scene.plane.to_heart(position[present])
        present[present] = outside_heart(self.scene.heart, frame, in_heart, column=column)
        return present

    def __call__(self, frame: int) -> Echoes:
        position = self.positions(frame)
        present = self.present(frame, position)
        return position[present], self._amplitudes(frame)[present], self._exponents[present]

    @cached_property
    def _motion(self) -> SurroundingsMotion:
        decay = self.scene.config.realism.surroundings.motion_decay_mm * mm
        return SurroundingsMotion(self.scene.heart, self.position, decay, self.tissue)

    @cached_property
    def _amplitudes(self) -> Callable[[int], Floats]:
        """Amplitudes (n,) by frame: blood changes as that in the cavity."""
        scene, sign, blood = self.scene, np.sign(self.amplitude), np.isin(self.tissue, CAVITIES)
        constant = scene.config.realism.blood.decorrelation_time_ms * ms
        # Both of all, so that random numbers do not depend on the tissue, which last bits decide at edges.
        flowing = ar1(sign, scene.time, constant, "chambers", scene.random)
        fading = scene.fading(sign, self.name)
        return lambda frame: np.abs(self.amplitude) * np.where(blood, flowing(frame), fading(frame))

    @property
    def _exponents(self) -> Floats:
        """Powers of the frequency (n,) that echoes follow: those of blood, of muscle, or of the rest."""
        config = self.scene.config
        exponents = np.full(len(self.tissue), config.realism.surroundings.scattering_exponent)
        exponents[np.isin(self.tissue, CAVITIES)] = config.realism.blood.scattering_exponent
        exponents[np.isin(self.tissue, WALLS)] = config.phantom.scattering_exponent
        return exponents


def epicardial_nodes(heart: Heart) -> NDArray[np.int64]:
    """Nodes at which the wall depth is 1."""
    return np.flatnonzero(heart.wall_depth > 1 - 1e-9)


def outside_heart(heart: Heart, frame: int, position: Floats, *, column: bool = False) -> NDArray[np.bool_]:
    """Whether positions (n, 3), m, are neither in the wall, nor in the cavity, nor in the column above its lid; (n,).

    That column is the atrium; `column` says whether it counts as outside, because its blood and its walls scatter.
    """
    nodes, cavity = heart.positions(frame), Cavity(heart.endo)
    outside = column | ~above_lid(nodes, heart.endo, position)
    outside[outside] = locate(nodes, heart.cells, position[outside]).cell < 0
    outside[outside] = locate(cavity.positions(nodes), cavity.cells, position[outside]).cell < 0
    return outside


def _drawn_evenly(config: Config, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Positions in the image (n, 3), m, and the density there, (n,), 1/m^3."""
    start, depth = config.realism.surroundings.start_mm * mm, config.depth_mm * mm
    scan, focus = scan_lines(config.probe, config.rf), config.rf.focus_mm * mm
    if depth <= start:
        return np.empty((0, 3)), np.empty(0)
    at_focus = config.realism.surroundings.density * (config.phantom.density_per_mm3 * per_mm3)
    focal_thickness = beam_half_thickness(config, np.array([focus]))[0]
    width = DRAWN * (np.ptp(scan.angle) * focus if isinstance(scan, Sector) else np.ptp(scan.line_origin))
    number = random.poisson(at_focus * width * (depth - start) * 2 * CUT * focal_thickness * STD)
    line = DRAWN * random.uniform(-0.5, 0.5, number)
    range_, elevation = random.uniform(start, depth, number), random.uniform(-CUT, CUT, number)
    kept = random.random(number) < np.exp(-(elevation**2) / 2)
    line, range_, elevation = line[kept], range_[kept], elevation[kept]
    thickness = STD * beam_half_thickness(config, range_)
    density = at_focus * STD * focal_thickness / thickness * np.exp(-(elevation**2) / 2)
    if isinstance(scan, Sector):
        angle = line * np.ptp(scan.angle)
        lateral, axial, density = np.sin(angle) * range_, np.cos(angle) * range_, density * focus / range_
    else:
        lateral, axial = line * np.ptp(scan.line_origin), range_
    return np.column_stack([lateral, axial, elevation * thickness]), density


def _drawn_in_box(config: Config, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Positions (n, 3), m, before an array that images a volume, and the density there, (n,), 1/m^3."""
    half, start = config.probe.elements * (config.probe.pitch_um * um) / 2, config.realism.surroundings.start_mm * mm
    end = max((config.rf.focus_mm + config.volume.field_mm[0] / 2) * mm, start)
    density = config.realism.surroundings.density * (config.phantom.density_per_mm3 * per_mm3)
    number = random.poisson(density * (2 * half) ** 2 * (end - start))
    position = random.uniform([-half, start, -half], [half, end, half], (number, 3))
    return position, np.full(number, density)


def tissues(config: Config, heart: Heart, plane: Plane, position: Floats) -> tuple[NDArray[np.uint8], Floats]:
    """Tissue (n,) and echo power (n,) relative to muscle of positions (n, 3), m, in the heart frame at end-diastole.

    The power is 0 where there is nothing.
    """
    realism = config.realism
    tissue, level = np.zeros(len(position), np.uint8), np.full(len(position), _decibels(realism.surroundings.level_dB))
    if all(value is None for value in realism.neighbours.around.values()):
        return tissue, 10 ** (level / 10)
    anatomy = anatomy_of(heart)
    place = anatomy.place(position)
    _set_lung(config, plane, (tissue, level), place, anatomy.radius)
    _set_posterior(config, plane, (tissue, level), anatomy, position)
    if realism.neighbours.chambers_dB is not None:
        chambers, root = anatomy.chambers(position, place), aortic_tissue(heart, position)
        chambers[root > 0] = root[root > 0]
        cavity = np.isin(chambers, CAVITIES)
        levels = np.where(cavity, _decibels(realism.blood.level_dB), realism.neighbours.chambers_dB)
        levels[root == TissueLabel.AORTIC_WALL] += AORTIC_WALL_DB
        tissue[chambers > 0], level[chambers > 0] = chambers[chambers > 0], levels[chambers > 0]
    if realism.neighbours.chest_wall_dB is not None:
        start = realism.surroundings.start_mm * mm
        depth, (lateral, axial, _) = chest_wall_depth(heart, plane, start), plane.to_image(position).T
        near, thickness = axial < depth, max(depth - start, 1e-12)
        tissue[near] = TissueLabel.CHEST_WALL
        strata = strata_dB((axial[near] - start) / thickness, lateral[near] / thickness)
        level[near] = realism.neighbours.chest_wall_dB + strata
    return tissue, 10 ** (level / 10)


def _set_lung(config: Config, plane: Plane, of: tuple[NDArray[np.uint8], Floats], place: Place, radius: float) -> None:
    """Set tissue (n,) and level (n,), dB, where there is lung: behind the free walls as the probe sees them.

    It is mixed with the connective tissue where a free wall looks sideways.
    """
    lung_dB = config.realism.neighbours.lung_dB
    if lung_dB is None:
        return
    tissue, level = of
    behind = np.clip(LUNG_SIDE + place.outward @ plane.axes[1], 0, 1)
    lung = 10 ** ((lung_dB - LUNG_FADING_DB * np.maximum(place.distance - place.gap - place.wall, 0) / radius) / 10)
    power = behind * lung + (1 - behind) * 10 ** (level / 10)
    tissue[behind > LUNG_SHARE] = TissueLabel.LUNG
    level[:] = 10 * np.log10(np.maximum(power, 1e-30))


def _set_posterior(
    config: Config, plane: Plane, of: tuple[NDArray[np.uint8], Floats], anatomy: Anatomy, position: Floats
) -> None:
    """Set tissue (n,) and level (n,), dB, at positions (n, 3), m, that lie behind the atria as the probe sees them.

    It is mixed with what is there, less towards the sides.
    """
    posterior_dB = config.realism.neighbours.posterior_dB
    if posterior_dB is None:
        return
    tissue, level = of
    outward = position - anatomy.base
    behind = np.clip(outward @ plane.axes[1] / np.maximum(np.linalg.norm(outward, axis=1), 1e-12), 0, 1)
    fading = POSTERIOR_FADING_DB * anatomy.atrial_distance(position) / anatomy.radius
    share = np.where(outward[:, 2] > 0, behind, 0) ** POSTERIOR_NARROWNESS
    power = share * 10 ** ((posterior_dB - fading) / 10) + (1 - share) * 10 ** (level / 10)
    tissue[share > 1 / 2] = TissueLabel.OTHER
    level[:] = 10 * np.log10(np.maximum(power, 1e-30))


def _decibels(level: float | None) -> float:
    """A level, dB; -inf for none."""
    return -np.inf if level is None else level


def beam_half_thickness(config: Config, range_: Floats) -> Floats:
    """Half the thickness of the beam at ranges (n,), m: H / 2 |1 - r / F| (rays) + wavelength r / H (first zero).

    Beyond, the two-way beam is 26 dB and more below its maximum.
    """
    probe, height = config.probe, config.probe.height_mm * mm
    rays = height / 2 * np.abs(1 - range_ / (probe.elevation_focus_mm * mm))
    return rays + wavelength(probe) * range_ / height
