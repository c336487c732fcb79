"""How much tissue a view images: the wall in its plane, and what scatters within its beam, of the ideal ellipsoid.

It is counted on a grid of points, within a few milliseconds, before any mesh is made.
"""

from __future__ import annotations

from functools import lru_cache
from math import exp, log
from typing import NamedTuple

import numpy as np

from echotruth.config import Config
from echotruth.config.anatomy import HEART_PRESETS, Lengths

PIXELS, SLICES, AREA_PIXELS = 48, 9, 160
"""Points of the grid along each side of the image and through the beam, and of that of areas."""
DIFFRACTION = 2.8
"""Thickness of the beam in elevation beyond that of the rays of its lens, in wavelengths of the lowest frequency of the
pulse times range over height."""
LOWEST_FREQUENCY = 0.6
"""Distance of the lowest frequency of the pulse from the centre frequency, over the bandwidth."""
MOTION = 1.65
"""Scatterers that are in the beam in any frame over those of this grid: the tissue moves, and the edge of the beam is
blurred. With it, the scatterers of views of hearts of mice are met within 12 %."""
STEP = 0.05
"""Step to which the logarithms of lengths are rounded where many hearts share a count."""


class ImagedTissue(NamedTuple):
    """What a view contains at end-diastole.

    Attributes
    ----------
    wall_mm2 : float
        Area of the wall in the image.
    plane_mm2 : float
        Area of the wall in the plane, also outside the image.
    wall_mm3, blood_mm3, surroundings_mm3 : float
        Volumes in the beam.
    """

    wall_mm2: float
    plane_mm2: float
    wall_mm3: float
    blood_mm3: float
    surroundings_mm3: float


class Ellipsoid(NamedTuple):
    """Wall between two half ellipsoids with one centre, cut at the base.

    Attributes
    ----------
    radius_mm, length_mm : float
        Of the cavity: greatest radius, and distance of the apex from the centre.
    outer_radius_mm, outer_length_mm : float
        Those of the outer surface.
    base_mm : float
        Height of the base above the centre.
    """

    radius_mm: float
    length_mm: float
    outer_radius_mm: float
    outer_length_mm: float
    base_mm: float


class Beam(NamedTuple):
    """Plane and beam of a view.

    Attributes
    ----------
    is_long_axis : bool
    position : float
        Of a short-axis plane: 0 at the base, 1 at the apex.
    side_mm : float
        Side of the image.
    focus_mm : float
        Depth at which the heart lies.
    height_mm, lens_mm, wavelength_mm : float
        Height of an element, focus of its lens, longest wavelength; the height is infinite without a lens.
    """

    is_long_axis: bool
    position: float
    side_mm: float
    focus_mm: float
    height_mm: float
    lens_mm: float
    wavelength_mm: float


def imaged_tissue(config: Config, view: str, is_rough: bool = False) -> ImagedTissue:
    """What a view of a heart contains.

    Parameters
    ----------
    config : Config
        Configuration of one case.
    view : str
        Name of the view.
    is_rough : bool
        Whether lengths are rounded to steps of 5 %, so that the hearts of a large sweep share few counts.
    """
    return _counted(rough_ellipsoid(config) if is_rough else ellipsoid(config), beam(config, view))


def rough_ellipsoid(config: Config) -> Ellipsoid:
    """Wall of a heart, with its lengths rounded to steps of 5 %."""
    return Ellipsoid(*map(_rounded, ellipsoid(config)))


def _rounded(length: float) -> float:
    """Length rounded to a step of 5 %."""
    return exp(round(log(length) / STEP) * STEP) if length > 0 else length


def ellipsoid(config: Config) -> Ellipsoid:
    """Wall of a heart; of a mesh from a file, which is not read, that of the animal that the array is made for."""
    geometry = config.geometry
    if geometry.file is not None or config.motion.kind == "file":
        lengths, factors = _of_the_array(config), (1.0, 1.0, 1.0, 1.0)
    else:
        lengths = geometry.lengths()
        factors = geometry.dilation, geometry.elongation, geometry.hypertrophy, geometry.scale
    wider, longer, thicker, scale = factors
    radius, length = lengths["endo_radius_mm"] * wider, lengths["endo_length_mm"] * wider * longer
    outer = radius + lengths["wall_mm"] * thicker, length + lengths["apex_wall_mm"] * thicker
    base = lengths["base_mm"] * wider * longer
    return Ellipsoid(*(scale * value for value in (radius, length, *outer, base)))


def beam(config: Config, view: str) -> Beam:
    """Plane and beam of a view."""
    seen, probe = config.views[view], config.probe
    lowest = probe.frequency_MHz * (1 - LOWEST_FREQUENCY * min(probe.bandwidth, 1.2))
    wavelength = probe.sound_speed_m_per_s / lowest / 1e3
    height = probe.height_mm if config.rf.elevation_beam else float("inf")
    scan = config.bmode.field_of_view_mm, config.rf.focus_mm, height, probe.elevation_focus_mm
    return Beam(seen.plane == "long_axis", seen.position, *scan, wavelength)


def _of_the_array(config: Config) -> Lengths:
    species = str(config.probe.preset).partition("_")[0]
    return HEART_PRESETS.get(species, HEART_PRESETS["mouse"])


@lru_cache(maxsize=4096)
def _counted(wall: Ellipsoid, beam: Beam) -> ImagedTissue:
    across = (np.arange(PIXELS) + 0.5) / PIXELS
    through = (np.arange(SLICES) + 0.5) / SLICES * 2 - 1
    axial, lateral, slope = np.meshgrid(across * beam.side_mm, (across - 0.5) * beam.side_mm, through, indexing="ij")
    thickness = _thickness(beam, np.hypot(axial, lateral), 2 * wall.outer_length_mm)
    muscle, cavity = _inside(wall, beam, lateral, axial, slope * thickness / 2)
    volume = thickness * (beam.side_mm / PIXELS) ** 2 / SLICES
    amounts = [MOTION * float(volume[part].sum()) for part in (muscle, cavity, ~(muscle | cavity))]
    seen = _wall_area(wall, beam, beam.focus_mm - beam.side_mm / 2, beam.side_mm)
    present = _wall_area(wall, beam, 0.0, 2.2 * (wall.outer_radius_mm + wall.outer_length_mm))
    return ImagedTissue(seen, max(seen, present), *amounts)


def _wall_area(wall: Ellipsoid, beam: Beam, shift: float, side: float) -> float:
    """Area of the wall, mm2, in a square about the middle of the heart that is shifted upwards."""
    along = ((np.arange(AREA_PIXELS) + 0.5) / AREA_PIXELS - 0.5) * side
    axial, lateral = np.meshgrid(along + beam.focus_mm - shift, along, indexing="ij")
    muscle, _ = _inside(wall, beam, lateral, axial, np.zeros_like(axial))
    return float(muscle.sum()) * (side / AREA_PIXELS) ** 2


def _thickness(beam: Beam, range_: np.ndarray, most: float) -> np.ndarray:
    """Thickness of the beam in elevation at some ranges, mm: of the rays through the lens, and of diffraction."""
    if not np.isfinite(beam.height_mm):
        return np.full_like(range_, most)
    rays = beam.height_mm * np.abs(1 - range_ / beam.lens_mm)
    return np.minimum(rays + DIFFRACTION * beam.wavelength_mm * range_ / beam.height_mm, most)


def _inside(
    wall: Ellipsoid, beam: Beam, lateral: np.ndarray, axial: np.ndarray, elevation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whether points of the image, mm, lie in the wall, and in the cavity."""
    apex = -(wall.base_mm + wall.length_mm)
    if beam.is_long_axis:
        square, height = lateral**2 + elevation**2, apex / 2 + axial - beam.focus_mm
    else:
        square, height = lateral**2 + (axial - beam.focus_mm) ** 2, beam.position * apex + elevation
    height = height + wall.base_mm
    below = height < wall.base_mm
    cavity = (square / wall.radius_mm**2 + height**2 / wall.length_mm**2 < 1) & below
    outer = (square / wall.outer_radius_mm**2 + height**2 / wall.outer_length_mm**2 < 1) & below
    return outer & ~cavity, cavity
