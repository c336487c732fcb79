"""CPU time, memory and bytes that the work of a stage is expected to take, from its size.

What a job asks a cluster for (:mod:`.demand`), the estimate before a run (:mod:`.estimate`) and the time left of a run
follow from these functions. Their constants are fitted to ledgers of repositories on one core of an AMD EPYC; on which
of them, and how well others are met, stands in docs/estimate.md.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

from echotruth.config import Config, Geometry
from echotruth.config.tracking import AffineDic, BsplineDic, Dis, Ilk, PhaseCorrelation, WindowDeformation
from echotruth.section import Section
from echotruth.workflow.imaged_tissue import imaged_tissue

START_SECONDS = 3.0
"""CPU time of a process before its first stage."""
COMPILE_SECONDS = {"mechanics": 11.0, "view": 38.0}
"""CPU time that fills the cache of compiled functions of each group, once for a version of the code."""
MINIATURE_SECONDS = 7.0
"""CPU time that finds all functions of a view compiled already, for other settings."""
PHYSIOLOGY_SECONDS = 0.2
"""CPU time of the measures of a heart."""
REPORT_SECONDS = 40.0
"""CPU time of the jobs of the report."""
VERIFY_SECONDS, VERIFY_VIEW_SECONDS = 5.0, 0.05
"""CPU time of the publication, and for each view of a heart."""
RUN_SECONDS, JOB_SECONDS = 10.0, 0.1
"""CPU time of Snakemake, and for each of its jobs."""
FILE_CELLS = 60_000
"""Tetrahedra assumed in a mesh from a file, whose size is not known before it is read."""
NODES_PER_CELL = 1.55
"""Nodes of quadratic tetrahedra over tetrahedra."""
BASE_MB = 400.0
"""Memory of a process with its modules."""
CELLS, SCATTERERS, FRAMES, PIXELS = 4320, 196_000, 40, 512**2
"""The defaults, over which the memory of a job is fitted."""

STAGES = ("mechanics", "physiology", "phantom", "truth", "rf", "bmode", "tracking", "evaluation")
"""Stages with a record, in their order."""


class Content(NamedTuple):
    """Amounts that the images of a view consist of.

    Attributes
    ----------
    is_long_axis : bool
    frames : int
    seeded : float
        Scatterers that are seeded in wall, cavity and surroundings.
    scatterers, around : float
        Those in the beam, and of these the ones around the heart.
    wall_pixels : tuple of float
        Pixels of the wall in one frame, by image size.
    filled_pixels : tuple of float
        Pixels that are not black.
    points : float
        Points at which trackers report.
    """

    is_long_axis: bool
    frames: int
    seeded: float
    scatterers: float
    around: float
    wall_pixels: tuple[float, ...]
    filled_pixels: tuple[float, ...]
    points: float


def content(config: Config, view: str, is_rough: bool = False) -> Content:
    """What the images of a view consist of.

    Parameters
    ----------
    config : Config
        Configuration of one case.
    view : str
        Name of the view.
    is_rough : bool
        As for :func:`.imaged_tissue.imaged_tissue`.
    """
    tissue, sizes, realism = imaged_tissue(config, view, is_rough), config.bmode.sizes, config.realism
    share = tissue.wall_mm2 / config.bmode.field_of_view_mm**2
    # Blood, surroundings and noise fill the sector, which is three quarters of the square.
    filled = 0.75 if realism.surroundings.level_dB is not None or realism.noise.snr_dB is not None else share
    wall = tuple(share * size**2 for size in sizes)
    density = config.phantom.density_per_mm3
    blood = density * realism.blood.density * tissue.blood_mm3 if realism.blood.level_dB is not None else 0.0
    surroundings, rest = realism.surroundings, tissue.surroundings_mm3
    around = density * surroundings.density * rest if surroundings.level_dB is not None else 0.0
    return Content(
        config.views[view].plane == "long_axis",
        config.loop.frames,
        density * max(wall_volume(config.geometry), tissue.wall_mm3) + blood + around,
        density * tissue.wall_mm3 + blood + around,
        around,
        wall,
        tuple(filled * size**2 for size in sizes),
        wall[0] / config.tracking.grid_px**2,
    )


def cells(config: Config) -> float:
    """Tetrahedra of the mesh."""
    geometry = config.geometry
    if (geometry.file or config.motion.kind == "file") and not geometry.remesh:
        return FILE_CELLS
    # Each hexahedron is cut into five tetrahedra.
    return 5 * geometry.circumferential_elements * geometry.longitudinal_elements * geometry.transmural_elements


def mechanics_seconds(config: Config) -> float:
    """CPU time of the motion of a heart; a Newton step takes cells^1.3 (benchmarks/results/mechanics.md)."""
    size, frames = cells(config) / CELLS, config.loop.frames
    if config.motion.kind == "file":
        return 0.16 * frames * size
    if config.motion.kind != "beat":
        return 0.7 + 1.5 * size + 0.05 * frames * size
    # The steps that inflate the heart and carry it through the cycle depend little on the number of frames.
    step = size**1.3
    seconds = 1.3 + 25.7 * step + frames * (0.17 + 0.29 * step)
    return seconds * (2.0 if config.geometry.given_state == "end_diastole" else 1.0)


def view_seconds(config: Config, view: str, is_rough: bool = False) -> dict[str, float]:
    """CPU time of each stage of a view.

    Parameters
    ----------
    config : Config
        Configuration of one case.
    view : str
        Name of the view.
    is_rough : bool
        As for :func:`.imaged_tissue.imaged_tissue`.
    """
    seen = content(config, view, is_rough)
    trackers = sum(tracker_seconds(tracker, config, seen) for tracker in config.tracking.trackers.values())
    scores = len(config.tracking.trackers) * len(config.bmode.sizes) * seen.frames * seen.points
    return {
        "phantom": 1.9 * lens_size(config) ** 1.5 + 3.9e-7 * seen.frames * seen.seeded,
        "truth": 0.3 + 1.0e-5 * seen.frames * sum(seen.wall_pixels),
        "rf": rf_seconds(config, seen),
        "bmode": 0.1 + 1.1e-7 * seen.frames * sum(size**2 for size in config.bmode.sizes),
        "tracking": 0.1 + 0.1 * len(config.tracking.trackers) * len(config.bmode.sizes) + trackers,
        "evaluation": 0.4 + 3.2e-6 * scores,
    }


def rf_seconds(config: Config, seen: Content) -> float:
    """CPU time of the echoes of all scatterers, and of the lines that are made from them."""
    rf, elements = config.rf, config.probe.elements / 64
    waves = rf.lines * rf.focal_zones if rf.transmit == "focused" else 8 * (rf.transmits + rf.lines)
    # Many of those around the heart, and at the apex, are so near the array that every pair of elements is computed.
    scatterers = (1.3 if seen.is_long_axis else 1.0) * (seen.scatterers - seen.around) + 1.3 * seen.around
    echo = (9e-6 * lens_size(config) ** 1.5 if rf.elevation_beam else 5e-6) * sqrt(elements)
    start, kept = 1.2 + 3e-3 * elements * waves, (1.0 if "channels" in rf.keep else 0.0) * elements**2
    return start + seen.frames * (echo * scatterers + 0.15 * elements**2 + 6e-4 * elements * waves + kept)


def lens_size(config: Config) -> float:
    """Height of the elements in wavelengths, over that of the array for mice."""
    probe = config.probe
    return probe.height_mm * probe.frequency_MHz * 1e3 / probe.sound_speed_m_per_s / 16.2


def tracker_seconds(tracker: Section, config: Config, seen: Content) -> float:
    """CPU time of a tracker at all sizes; constants from 40 frames of a short-axis view of the default heart."""
    scale, seconds = config.bmode.field_of_view_mm / 12, 0.0
    for size, wall in zip(config.bmode.sizes, seen.wall_pixels, strict=True):
        amounts = _TrackedAmounts(size**2 / PIXELS, seen.points / 760, wall / 20_000, scale)
        seconds += _method_seconds(tracker, amounts)
    return seen.frames / config.tracking.frame_step / FRAMES * seconds


class _TrackedAmounts(NamedTuple):
    """Pixels of an image, points and pixels of the wall relative to the default heart at 512 px, and field of view."""

    pixels: float
    points: float
    wall: float
    scale: float


def _method_seconds(tracker: Section, of: _TrackedAmounts) -> float:
    """CPU time of a tracker for 40 frames at one size."""
    passes = 2 if getattr(tracker, "reference", "") == "bidirectional" else 1
    match tracker:
        case PhaseCorrelation():
            seconds = (0.05 + 0.45 * of.pixels) * (0.5 / tracker.stride) ** 2 * (1.5 if passes == 2 else 1)
        case WindowDeformation():
            seconds = passes * (0.5 + 3.0 * of.pixels) * (tracker.final_passes + 1) / 4
        case AffineDic():
            seconds = passes * of.points * (1.1 + 7.9 * of.pixels * (tracker.subset_mm / of.scale) ** 2)
        case Dis():
            seconds = passes * (0.1 + (7.5 if tracker.preset == "fine" else 1.6) * of.pixels)
        case Ilk():
            seconds = 146 * of.pixels
        case BsplineDic():
            knots = tracker.knots_mm / of.scale / 0.4
            # Images in which knots are 8 pixels apart or more are aligned twice, blurred at first.
            seconds = (6.0 + 4.0 * sqrt(of.wall)) / knots * (1.6 if 17 * knots * sqrt(of.pixels) >= 8 else 1.0)
        case _:  # from outside: not known
            seconds = 5 * of.pixels
    return seconds


def mechanics_megabytes(config: Config) -> float:
    """Peak memory of the motion of a heart."""
    size, frames = cells(config) / CELLS, config.loop.frames / FRAMES
    if config.motion.kind == "file":
        return BASE_MB + 180 * frames * size
    return BASE_MB + 400 * size ** (4 / 3) + 50 * frames * size


def images_megabytes(config: Config) -> float:
    """Peak memory of the images of a view."""
    frames, pixels = config.loop.frames / FRAMES, max(config.bmode.sizes) ** 2 / PIXELS
    # Blood and surroundings are sparser, but fill the rest of the sector.
    realism = config.realism
    around = 3 if realism.blood.level_dB is not None or realism.surroundings.level_dB is not None else 1
    scatterers = around * config.phantom.density_per_mm3 * wall_volume(config.geometry) / SCATTERERS
    channels = 2000 * frames if "channels" in config.rf.keep else 0
    # The tables of the lens are gone when the truth is made.
    tables = max(500, 300 + 130 * lens_size(config) ** 4) if config.rf.elevation_beam else 500
    return max(tables, BASE_MB + frames * (620 * pixels + 300 * scatterers)) + channels


def tracking_megabytes(config: Config) -> float:
    """Peak memory of the tracking of a view."""
    return BASE_MB + 720 * max(config.bmode.sizes) ** 2 / PIXELS * config.loop.frames / FRAMES


def heart_bytes(config: Config) -> float:
    """Bytes of a heart without its views: displacements of nodes, strains of cells, directions."""
    size, frames = cells(config), config.loop.frames
    return frames * size * (21 * NODES_PER_CELL + 2.8) + 80 * size + 20_000


def view_bytes(config: Config, view: str) -> float:
    """Bytes of a view: truth, images, what was tracked and its scores, and the RF that is kept."""
    seen, trackers, sizes = content(config, view), len(config.tracking.trackers), len(config.bmode.sizes)
    truth = sum(11 * wall + 550 * sqrt(wall) for wall in seen.wall_pixels)
    is_filled = seen.filled_pixels != seen.wall_pixels
    images = sum((0.85 if is_filled else 1.75) * pixels for pixels in seen.filled_pixels)
    points = sizes * seen.points * (4.6 * trackers + 6.6)
    return seen.frames * (truth + images + points + 400 * trackers * sizes) + rf_bytes(config) + 5000


def rf_bytes(config: Config) -> float:
    """Bytes of the RF that is kept of a view."""
    depth, probe, frames = 1.12 * config.bmode.field_of_view_mm, config.probe, config.loop.frames
    # Lines are sampled at the bandwidth of the pulse, channels at 2.1 times their highest frequency at least.
    samples_per_mm = 2 * probe.frequency_MHz * 1e3 / probe.sound_speed_m_per_s
    lines = 8 * config.rf.lines * depth * samples_per_mm * 1.6 * frames if "lines" in config.rf.keep else 0.0
    channels = 2 * probe.elements**2 * depth * samples_per_mm * 3.5 * frames if "channels" in config.rf.keep else 0.0
    return 0.92 * lines + 0.85 * channels


def wall_volume(geometry: Geometry) -> float:
    """Volume of the wall, mm3, between two ellipsoids cut by the base; of the preset, if it is from a file."""
    lengths = geometry.lengths()
    radius, length, base = lengths["endo_radius_mm"], lengths["endo_length_mm"], lengths["base_mm"]
    outer = _ellipsoid_volume(radius + lengths["wall_mm"], length + lengths["apex_wall_mm"], base)
    return (outer - _ellipsoid_volume(radius, length, base)) * (1 if geometry.file else geometry.scale**3)


def _ellipsoid_volume(radius: float, length: float, base: float) -> float:
    """Volume of an ellipsoid of revolution below the plane at the height `base` over its middle."""
    return pi * radius**2 * (2 / 3 * length + base * (1 - (base / length) ** 2 / 3))
