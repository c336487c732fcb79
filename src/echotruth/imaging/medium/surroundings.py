"""Surroundings: scatterers around the heart, in the part of space that the probe images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Floats
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import imaging_depth, points, scan_lines
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.view import Plane

NEIGHBOURS = 8
"""Nodes of the epicardium whose motion a scatterer outside of it takes on."""


@dataclass(frozen=True)
class Surroundings:
    """Scatterers around the heart.

    Attributes
    ----------
    position : ndarray of shape (n, 3), m
        At end-diastole, in the heart frame. Some lie in the heart: they come out where it draws back.
    amplitude : ndarray of shape (n,)
    """

    position: Floats
    amplitude: Floats


class Following:
    """Motion of the surroundings: that of the epicardium near by, fading with the distance from it.

    Parameters
    ----------
    heart : Heart
    position : ndarray of shape (n, 3), m
        Of scatterers at end-diastole, in the heart frame.
    length : float, m
        Distance over which the motion falls to 1/e; 0 if nothing follows.
    """

    def __init__(self, heart: Heart, position: Floats, length: float) -> None:
        self._heart, self._position, self._moves = heart, position, length > 0
        if not self._moves:
            return
        self._epi = epicardium(heart)
        distance, self._near = cKDTree(heart.positions(0)[self._epi]).query(position, NEIGHBOURS)
        share = 1 / np.maximum(distance, 1e-9) ** 2
        self._share = share / share.sum(axis=1, keepdims=True) * np.exp(-distance[:, :1] / length)

    def __call__(self, frame: int) -> Floats:
        """Positions in a frame, (n, 3), m."""
        if not self._moves:
            return self._position
        moved = (self._heart.displacement[frame] - self._heart.displacement[0])[self._epi]
        return self._position + np.einsum("pk,pki->pi", self._share, moved[self._near])


def epicardium(heart: Heart) -> NDArray[np.int64]:
    """Nodes of the epicardium, where the wall depth is 1."""
    return np.flatnonzero(heart.wall_depth > 1 - 1e-9)


def outside(heart: Heart, frame: int, position: Floats) -> NDArray[np.bool_]:
    """Which places (n, 3), m, are neither in the wall nor in the cavity nor in the column above its lid, (n,).

    That column is where the atrium is, and full of blood too faint to matter.
    """
    nodes, cavity = heart.positions(frame), Cavity(heart.endo)
    rim = nodes[cavity.rim]
    middle = rim.mean(axis=0)
    radius = np.hypot(*(rim - middle)[:, :2].T).mean()
    found = (position[:, 2] < middle[2]) | (np.hypot(*(position - middle)[:, :2].T) > radius)
    found[found] = locate(nodes, heart.cells, position[found]).cell < 0
    found[found] = locate(cavity.positions(nodes), cavity.cells, position[found]).cell < 0
    return found


def surround(config: Config, heart: Heart, plane: Plane, random: np.random.Generator) -> Surroundings:
    """Scatter points evenly over what the probe images.

    Parameters
    ----------
    config : Config
    heart : Heart
    plane : Plane
    random : Generator

    Returns
    -------
    Surroundings
        Within the sector, from `start_mm` to the greatest depth, within the beam in elevation. Their amplitudes are
        normally distributed; the variance in a volume is that of muscle times the level.
    """
    around, depth = config.realism.surroundings, imaging_depth(config.rf, config.bmode)
    scan, start = scan_lines(config.probe, config.rf), around.si().start
    leeway = np.abs((heart.displacement - heart.displacement[0])[:, epicardium(heart)] @ plane.axes[2]).max()
    side, _ = points(scan, np.array([depth]))
    half = np.array([1.1 * np.abs(side).max(), beam_thickness(config, np.array([start, depth])).max() + leeway])
    low = np.array([-half[0], 0, -half[1]])
    size = np.array([2 * half[0], depth, 2 * half[1]])
    number = random.poisson(around.density * config.phantom.si().density * size.prod())
    place = low + size * random.random((number, 3))
    line, reach = scan.place(place[:, 0], place[:, 1])
    seen = (np.abs(2 * line / (len(scan.angle) - 1) - 1) < 1.1) & (reach > start) & (reach < depth)
    seen &= np.abs(place[:, 2]) < beam_thickness(config, reach) + leeway
    place = place[seen]
    return Surroundings(plane.heart(place), around.strength * random.standard_normal(len(place)))


def beam_thickness(config: Config, reach: Floats) -> Floats:
    """Half the thickness of the beam at a range (n,), m: by rays, and up to the first zero of its diffraction.

    Beyond, the two-way beam is 26 dB and more below its maximum.
    """
    p = config.probe.si()
    rays = p.height / 2 * np.abs(1 - reach / p.elevation_focus)
    return rays + p.sound_speed / p.frequency * reach / p.height
