"""Surroundings: scatterers around the heart, in the part of space that the probe images."""

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import imaging_depth, sample_positions, scan_lines
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.view import Plane

NEIGHBOURS = 8
"""Epicardial nodes from which the motion of a scatterer is interpolated."""


class SurroundingsMotion:
    """Motion of the surroundings: that of the nearest epicardium times exp(-distance / decay length).

    Nodes are weighted by the inverse square of their distance.

    Parameters
    ----------
    heart : Heart
    position : ndarray of shape (n, 3), m
        Scatterers at end-diastole, in the heart frame.
    decay_length : float, m
        0 for surroundings at rest.
    """

    def __init__(self, heart: Heart, position: Floats, decay_length: float) -> None:
        self._heart, self._position, self._at_rest = heart, position, decay_length == 0
        if self._at_rest:
            return
        from scipy.spatial import cKDTree  # takes 50 ms, and few views have surroundings

        self._epi = epicardial_nodes(heart)
        distance, self._nearest = cKDTree(heart.positions(0)[self._epi]).query(position, NEIGHBOURS)
        weight = 1 / np.maximum(distance, 1e-9) ** 2
        self._weight = weight / weight.sum(axis=1, keepdims=True) * np.exp(-distance[:, :1] / decay_length)

    def __call__(self, frame: int) -> Floats:
        """Positions in a frame, (n, 3), m."""
        if self._at_rest:
            return self._position
        displacement = (self._heart.displacement[frame] - self._heart.displacement[0])[self._epi]
        return self._position + np.einsum("pk,pki->pi", self._weight, displacement[self._nearest])


def epicardial_nodes(heart: Heart) -> NDArray[np.int64]:
    """Nodes at which the wall depth is 1."""
    return np.flatnonzero(heart.wall_depth > 1 - 1e-9)


def outside_heart(heart: Heart, frame: int, position: Floats) -> NDArray[np.bool_]:
    """Whether positions (n, 3), m, are neither in the wall, nor in the cavity, nor in the column above its lid; (n,).

    That column is the atrium, whose blood is too faint to matter.
    """
    nodes, cavity = heart.positions(frame), Cavity(heart.endo)
    rim = nodes[cavity.rim]
    centre = rim.mean(axis=0)
    radius = np.hypot(*(rim - centre)[:, :2].T).mean()
    outside = (position[:, 2] < centre[2]) | (np.hypot(*(position - centre)[:, :2].T) > radius)
    outside[outside] = locate(nodes, heart.cells, position[outside]).cell < 0
    outside[outside] = locate(cavity.positions(nodes), cavity.cells, position[outside]).cell < 0
    return outside


def seed_surroundings(config: Config, heart: Heart, plane: Plane, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw scatterers uniformly over what the probe images.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    random : Generator

    Returns
    -------
    position : ndarray of shape (n, 3), m
        At end-diastole, in the heart frame: in the scan from `start_mm` to the imaging depth, and in the beam in
        elevation. Those inside the heart are hidden until it moves away.
    amplitude : ndarray of shape (n,)
        Normally distributed; the variance in a volume is that of muscle times the level.
    """
    settings, depth = config.realism.surroundings, imaging_depth(config.rf, config.bmode)
    scan, start = scan_lines(config.probe, config.rf), settings.si().start
    margin = np.abs((heart.displacement - heart.displacement[0])[:, epicardial_nodes(heart)] @ plane.axes[2]).max()
    lateral, _ = sample_positions(scan, np.array([depth]))
    half = np.array([1.1 * np.abs(lateral).max(), beam_half_thickness(config, np.array([start, depth])).max() + margin])
    low = np.array([-half[0], 0, -half[1]])
    size = np.array([2 * half[0], depth, 2 * half[1]])
    number = random.poisson(settings.density * config.phantom.si().density * size.prod())
    position = low + size * random.random((number, 3))
    line, range_ = scan.to_scan_coordinates(position[:, 0], position[:, 1])
    imaged = (np.abs(2 * line / (len(scan.angle) - 1) - 1) < 1.1) & (range_ > start) & (range_ < depth)
    imaged &= np.abs(position[:, 2]) < beam_half_thickness(config, range_) + margin
    position = position[imaged]
    return plane.to_heart(position), settings.amplitude_std * random.standard_normal(len(position))


def beam_half_thickness(config: Config, range_: Floats) -> Floats:
    """Half the thickness of the beam at ranges (n,), m: H / 2 |1 - r / F| (rays) + wavelength r / H (first zero).

    Beyond, the two-way beam is 26 dB and more below its maximum.
    """
    p = config.probe.si()
    rays = p.height / 2 * np.abs(1 - range_ / p.elevation_focus)
    return rays + p.sound_speed / p.frequency * range_ / p.height
