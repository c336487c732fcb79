"""Bounds on what keys amount to together, so that no configuration exhausts the memory or takes days for one heart.

They lie a hundred times and more above the default heart, and are checked before anything is made.
"""

from __future__ import annotations

from math import floor, isqrt, pi
from typing import TYPE_CHECKING

from echotruth.config.anatomy import Lengths
from echotruth.section import invalid

if TYPE_CHECKING:
    from echotruth.config.sections import Config

MAX_CASES = 100_000
"""Largest number of cases of a repository, also of those that conditions leave out."""
MAX_TABLE_BYTES = 2 * 2**20
"""Size of the largest table of hearts: 10 000 rows of 200 characters."""
MAX_TABLE_COLUMNS = 256
"""Largest number of columns of a table; each may become an array of the repository."""
MAX_CELL = 4000
"""Longest cell of a table, as a note may be, characters."""
MAX_DRAWN_KEYS = 64
"""Largest number of keys that are drawn."""
MAX_CONDITIONS = 100
"""Largest number of conditions."""
MAX_CONDITION = 1000
"""Longest condition, characters."""
MAX_VIEWS = 64
"""Largest number of views of a heart."""
MAX_TRACKERS = 64
"""Largest number of trackers."""
MAX_CLIP_PIXELS = 10**9
"""Largest number of pixels of a clip; the truth takes some 50 bytes a pixel."""
MAX_ECHO_SAMPLES = 2 * 10**9
"""Largest number of samples of one frame's RF, in all pairs of elements; 4 bytes each."""
MAX_LINE_SAMPLES = 2 * 10**9
"""Largest number of samples of a clip's lines; 8 bytes each."""
MAX_SCATTERERS = 5 * 10**7
"""Largest number of scatterers of a view; the default heart has 2 x 10^5."""


def check_amounts(config: Config) -> None:
    """Check that cases, pixels, samples and scatterers are within their bounds.

    Raises
    ------
    PydanticCustomError
        With the key that exceeds a bound and the largest value that does not.
    """
    _check_cases(config)
    _check_pixels(config)
    _check_samples(config)
    _check_scatterers(config)


def _check_cases(config: Config) -> None:
    if config.cases.number > MAX_CASES:
        shape = config.cases.shape
        product = " x ".join(map(str, shape[:8])) + (" x ..." if len(shape) > 8 else "")
        remedy = f"makes {product} cases: list fewer values, because a repository has at most {MAX_CASES}"
        raise invalid("cases", config.cases.keys, remedy)


def _check_pixels(config: Config) -> None:
    size, frames = config.bmode.size_px, config.loop.frames
    if frames * size**2 > MAX_CLIP_PIXELS:
        remedy = f"must be at most {isqrt(MAX_CLIP_PIXELS // frames)} with loop.frames = {frames}"
        raise invalid("bmode.size_px", size, remedy)


def _check_samples(config: Config) -> None:
    side, probe = config.bmode.field_of_view_mm, config.probe
    # Both ways, in samples per mm; the corners of the image are 1.12 times as deep.
    per_mm = 2 * 1.12 * probe.sampling_MHz * 1e3 / probe.sound_speed_m_per_s
    pairs = probe.elements * (probe.elements + 1) // 2
    frames, lines = config.loop.frames, config.rf.lines
    amounts = (
        (pairs, MAX_ECHO_SAMPLES, f"{probe.elements} elements"),
        (frames * lines, MAX_LINE_SAMPLES, f"{frames} frames of {lines} lines"),
    )
    for number, most, what in amounts:
        if number * side * per_mm > most:
            remedy = f"must be at most {most / number / per_mm:.3g} with {what} sampled at {probe.sampling_MHz:g} MHz"
            raise invalid("bmode.field_of_view_mm", side, remedy)


def _check_scatterers(config: Config) -> None:
    density = config.phantom.density_per_mm3
    volume = 0.0 if config.phantom.in_plane_only else _tissue_mm3(config)
    if density * volume > MAX_SCATTERERS:
        most = floor(MAX_SCATTERERS / volume * 1000) / 1000
        remedy = (
            f"must be at most {most:g}, because {volume:.3g} mm^3 are filled with at most {MAX_SCATTERERS} scatterers"
        )
        raise invalid("phantom.density_per_mm3", density, remedy)


def _tissue_mm3(config: Config) -> float:
    """Estimate of the volume that is filled with scatterers, each part times its density relative to muscle, mm^3."""
    blood, surroundings, geometry, volume = config.realism.blood, config.realism.surroundings, config.geometry, 0.0
    if geometry.file is None:
        cavity, whole = ventricle_mm3(geometry.lengths(), geometry.scale * max(geometry.dilation, 1))
        volume = (whole - cavity) * max(geometry.hypertrophy, 1)
        volume += cavity * blood.density if blood.level_dB is not None else 0
    if surroundings.level_dB is not None:
        volume += surroundings.density * _imaged_mm3(config)
    return volume


def _imaged_mm3(config: Config) -> float:
    """Upper estimate of the volume of the beam: the square image, as thick as the beam at its lower edge, mm^3."""
    side, probe = config.bmode.field_of_view_mm, config.probe
    wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3
    rays = probe.height_mm * max(1.0, side / probe.elevation_focus_mm - 1)
    return 1.5 * side**2 * (rays + 2 * wavelength * side / probe.height_mm)


def ventricle_mm3(lengths: Lengths, scale: float = 1.0) -> tuple[float, float]:
    """Volume of the cavity, and of cavity and wall, of a truncated ellipsoid.

    Parameters
    ----------
    lengths : dict
        Of :meth:`echotruth.config.geometry.Geometry.lengths`, mm.
    scale : float
        Factor on all of them.

    Returns
    -------
    tuple of float, mm^3
    """
    radius, length, base = (lengths[key] * scale for key in ("endo_radius_mm", "endo_length_mm", "base_mm"))
    wall, apex_wall = lengths["wall_mm"] * scale, lengths["apex_wall_mm"] * scale
    return _truncated_mm3(radius, length, base), _truncated_mm3(radius + wall, length + apex_wall, base)


def _truncated_mm3(radius: float, length: float, base: float) -> float:
    """Integral of pi radius^2 (1 - z^2 / length^2) from the apex at -length to the base, mm^3."""
    return pi * radius**2 * (length + base - (length**3 + base**3) / (3 * length**2))
