"""Time and memory that a job asks a cluster for, from the size of its work.

Fitted to ledgers on one core: the mouse of the defaults (mechanics 61-72 s and 830 MB; images of a view 130 s, its
tracking by six trackers 280 s, 1020 MB), a small and a human heart, config/paper.yaml and config/fimh25.yaml. Asked
is three times the time and one and a half times the memory, because nodes differ.
"""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

from echotruth.config import Config, Geometry

TIME_MARGIN = 3.0
"""Time asked for over the time expected."""
MEMORY_MARGIN = 1.5
"""Memory asked for over the memory expected."""
START_SECONDS = 120.0
"""Time to start a process and, once, to compile its functions, s."""
BASE_MB = 400.0
"""Memory of a process with its modules."""
FILE_CELLS = 60_000
"""Tetrahedra assumed in a mesh from a file, whose size is not known before it is read."""
CELLS, SCATTERERS, FRAMES, LINES, PIXELS = 4320, 196_000, 40, 192, 512**2
"""The defaults, for which the constants below hold."""


class Demand(NamedTuple):
    """Time, min, and memory, MB, that a job asks for."""

    minutes: int
    megabytes: int


def mechanics(config: Config) -> Demand:
    """Demand of the mechanics and the measures of a heart; a step takes cells^1.5 (benchmarks/results/mechanics.md)."""
    cells, frames = _cells(config) / CELLS, config.loop.frames / FRAMES
    if config.motion.kind == "file":
        return _demand(60 * frames * cells, 180 * frames * cells)
    return _demand(60 * frames * cells**1.5, 400 * cells ** (4 / 3) + 50 * frames * cells)


def images(config: Config) -> Demand:
    """Demand of the phantom, the truth, RF, B-mode, tracking and scores of a view."""
    frames, scatterers = config.loop.frames / FRAMES, _scatterers(config) / SCATTERERS
    transmits = (1 + config.rf.focal_zones) / 6 * config.rf.lines / LINES
    pixels = max(config.bmode.sizes) ** 2 / PIXELS
    seconds = frames * (120 * scatterers * transmits + 10 * pixels) + tracking_seconds(config)
    channels = 2000 * frames if "channels" in config.rf.keep else 0
    return _demand(seconds, frames * (620 * pixels + 300 * scatterers) + channels)


def tracking(config: Config) -> Demand:
    """Demand of the tracking and the scores of a view."""
    pixels = max(config.bmode.sizes) ** 2 / PIXELS
    return _demand(tracking_seconds(config), 720 * pixels * config.loop.frames / FRAMES)


def tracking_seconds(config: Config) -> float:
    """Expected time of all trackers at all sizes, s."""
    pixels = sum(size**2 for size in config.bmode.sizes) / (1.3125 * PIXELS)
    return 60 * len(config.tracking.trackers) * pixels * config.loop.frames / FRAMES


def publication(cases: int, views: int) -> Demand:
    """Demand of the verification of a repository, and of its report."""
    return _demand(60 + 0.5 * cases * views, 700 + 0.1 * cases * views)


def _demand(seconds: float, megabytes: float) -> Demand:
    minutes = ceil(TIME_MARGIN * (START_SECONDS + seconds) / 60)
    return Demand(minutes, 100 * ceil(MEMORY_MARGIN * (BASE_MB + megabytes) / 100))


def _cells(config: Config) -> float:
    geometry = config.geometry
    if (geometry.file or config.motion.kind == "file") and not geometry.remesh:
        return FILE_CELLS
    # Each hexahedron is cut into five tetrahedra.
    return 5 * geometry.circumferential_elements * geometry.longitudinal_elements * geometry.transmural_elements


def _scatterers(config: Config) -> float:
    realism = config.realism
    # Blood and surroundings are sparser, but fill the rest of the sector.
    around = 3 if realism.blood.level_dB is not None or realism.surroundings.level_dB is not None else 1
    return around * config.phantom.density_per_mm3 * wall_volume(config.geometry)


def wall_volume(geometry: Geometry) -> float:
    """Volume of the wall, mm3, between two ellipsoids cut by the base; of the preset, if it is from a file."""
    lengths = geometry.lengths()
    radius, length, base = lengths["endo_radius_mm"], lengths["endo_length_mm"], lengths["base_mm"]
    outer = _ellipsoid_volume(radius + lengths["wall_mm"], length + lengths["apex_wall_mm"], base)
    return (outer - _ellipsoid_volume(radius, length, base)) * (1 if geometry.file else geometry.scale**3)


def _ellipsoid_volume(radius: float, length: float, base: float) -> float:
    """Volume of an ellipsoid of revolution below the plane at the height `base` over its middle."""
    return pi * radius**2 * (2 / 3 * length + base * (1 - (base / length) ** 2 / 3))
