"""How much tissue a view images: the wall in its plane, and what scatters within its beam, of the ideal ellipsoid."""

from math import asin, pi, radians, sqrt
from typing import NamedTuple

from echotruth.config import Config
from echotruth.config.anatomy import HEART_PRESETS

DIFFRACTION = 2.8
"""Thickness of the beam in elevation beyond that of the rays of its lens, in wavelengths of the lowest frequency of the
pulse times range over height."""
LOWEST_FREQUENCY = 0.6
"""Distance of the lowest frequency of the pulse from the centre frequency, over the bandwidth."""
MOTION = 1.65
"""Scatterers that are in the beam in any frame over those at end-diastole: the tissue moves, and the edge of the beam
is blurred."""


class Ellipsoid(NamedTuple):
    """Half axes of an ellipsoid of revolution, mm, and the height above its centre at which the base cuts it, mm."""

    radius: float
    length: float
    base: float

    @property
    def volume(self) -> float:
        """Volume below the base, mm3."""
        return pi * self.radius**2 * (2 / 3 * self.length + self.base * (1 - (self.base / self.length) ** 2 / 3))

    @property
    def long_axis_area(self) -> float:
        """Area of the ellipse below the base, mm2."""
        cut = min(1.0, self.base / self.length)
        return self.radius * self.length * (pi / 2 + asin(cut) + cut * sqrt(1 - cut**2))

    def short_axis_area(self, height: float) -> float:
        """Area of the circle at a height above the centre, mm2."""
        return pi * self.radius**2 * max(0.0, 1 - (height / self.length) ** 2)


def ellipsoids(config: Config) -> tuple[Ellipsoid, Ellipsoid]:
    """Inner and outer surface of a heart; of a mesh from a file, those of the animal that the array is made for."""
    heart, factors = config.geometry, (1.0, 1.0, 1.0, 1.0)
    species = str(config.probe.preset).partition("_")[0]
    lengths = HEART_PRESETS.get(species, HEART_PRESETS["mouse"])
    if heart.file is None and config.motion.kind != "file":
        lengths, factors = heart.lengths(), (heart.dilation, heart.elongation, heart.hypertrophy, heart.scale)
    wider, longer, thicker, scale = factors
    radius, length = lengths["endo_radius_mm"] * wider, lengths["endo_length_mm"] * wider * longer
    outer = radius + lengths["wall_mm"] * thicker, length + lengths["apex_wall_mm"] * thicker
    base = scale * lengths["base_mm"] * wider * longer
    return Ellipsoid(scale * radius, scale * length, base), Ellipsoid(scale * outer[0], scale * outer[1], base)


def areas(config: Config, view: str) -> tuple[float, float]:
    """Areas of the cavity and of the wall in the plane of a view at end-diastole, mm2."""
    surfaces = ellipsoids(config)
    if config.views[view].plane == "long_axis":
        cavity, heart = (surface.long_axis_area for surface in surfaces)
    else:
        base, length = surfaces[0].base, surfaces[0].length
        height = base - config.views[view].position * (base + length)
        cavity, heart = (surface.short_axis_area(height) for surface in surfaces)
    return cavity, heart - cavity


def scatterers(config: Config, view: str) -> tuple[float, float]:
    """Scatterers that are in the beam of a view in any frame: in the heart, and around it."""
    (cavity, wall), outer, realism = areas(config, view), ellipsoids(config)[1], config.realism
    # Mean distance from the middle of the heart along the range: of the long axis, or of a ring with the wall's radius.
    is_long_axis = config.views[view].plane == "long_axis"
    distance = (outer.length + outer.base) / 4 if is_long_axis else 2 / pi * sqrt((cavity + wall / 2) / pi)
    blood = realism.blood.density * cavity if realism.blood.level_dB is not None else 0.0
    heart = (wall + blood) * _thickness(config, distance / config.probe.elevation_focus_mm)
    around = 0.0
    if realism.surroundings.level_dB is not None:
        around = realism.surroundings.density * _surroundings_mm3(config)
    density = config.phantom.density_per_mm3
    return MOTION * density * heart, density * around


def _surroundings_mm3(config: Config) -> float:
    """Volume that the surroundings would fill at their density at the focus, mm3: equal parts of range have as many."""
    rf, probe, side = config.rf, config.probe, config.bmode.field_of_view_mm
    width = radians(rf.sector_deg) * rf.focus_mm if rf.scan == "sector" else rf.width_mm or side
    wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3
    rays = probe.height_mm / 2 * abs(1 - rf.focus_mm / probe.elevation_focus_mm)
    # The integral of a Gaussian with half the beam's half thickness, cut at that half thickness.
    return width * side * 1.2 * (rays + wavelength * rf.focus_mm / probe.height_mm)


def wall_scatterers(config: Config) -> float:
    """Scatterers of the whole wall."""
    inner, outer = ellipsoids(config)
    return config.phantom.density_per_mm3 * (outer.volume - inner.volume)


def _thickness(config: Config, off_focus: float) -> float:
    """Mean thickness of the beam in elevation, mm: of the rays through the lens, and of diffraction.

    Parameters
    ----------
    config : Config
    off_focus : float
        Mean distance from the range of the heart, over the range of the focus of the lens.
    """
    probe, focus, most = config.probe, config.rf.focus_mm, 2 * ellipsoids(config)[1].length
    if not config.rf.elevation_beam:
        return most
    lowest = probe.frequency_MHz * (1 - LOWEST_FREQUENCY * min(probe.bandwidth, 1.2))
    rays = probe.height_mm * max(abs(1 - focus / probe.elevation_focus_mm), off_focus)
    return min(most, rays + DIFFRACTION * probe.sound_speed_m_per_s / lowest / 1e3 * focus / probe.height_mm)
