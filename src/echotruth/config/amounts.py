"""Checks of what keys of several sections amount to together.

The bounds lie several times and more above the default heart, and are checked before anything is made.
"""

from math import floor, isqrt, prod

from echotruth.config.anatomy import Lengths, ellipsoid_mm3
from echotruth.config.cases import Cases
from echotruth.config.geometry import Geometry
from echotruth.config.imaging import Bmode, Phantom, Volume
from echotruth.config.probe import Probe
from echotruth.config.realism import Realism
from echotruth.config.table import MAX_CASES
from echotruth.section import invalid

MAX_CLIP_PIXELS = 10**9
"""Largest number of pixels of a clip; the truth takes some 50 bytes a pixel."""
MAX_SAMPLES = 2 * 10**9
"""Largest number of samples of one frame's RF in all pairs of elements, 4 bytes each, and of a clip's lines, 8 each."""
MAX_SCATTERERS = 5 * 10**7
"""Largest number of scatterers of a view; the default heart has 2 x 10^5."""


def check_cases(cases: Cases) -> None:
    """Check the number of hearts, also of those that conditions leave out."""
    if cases.number > MAX_CASES:
        shape = cases.shape
        product = " x ".join(map(str, shape[:8])) + (" x ..." if len(shape) > 8 else "")
        remedy = f"makes {product} cases: list fewer values, because a repository has at most {MAX_CASES}"
        raise invalid("cases", cases.keys, remedy)


def check_pixels(bmode: Bmode, frames: int) -> None:
    """Check the number of pixels of a clip."""
    size = bmode.size_px
    if frames * size**2 > MAX_CLIP_PIXELS:
        remedy = f"must be at most {isqrt(MAX_CLIP_PIXELS // frames)} with loop.frames = {frames}"
        raise invalid("bmode.size_px", size, remedy)


def check_voxels(volume: Volume, frames: int) -> None:
    """Check the number of voxels of a clip of volumes, whose envelopes are in memory together."""
    if frames * prod(volume.size) > MAX_CLIP_PIXELS:
        remedy = f"its product must be at most {MAX_CLIP_PIXELS // frames} with loop.frames = {frames}, "
        remedy += f"as all volumes take {4 * frames * prod(volume.size) / 1e9:.3g} GB of memory"
        raise invalid("volume.size", volume.size, remedy)


def check_samples(probe: Probe, bmode: Bmode, lines: int, frames: int) -> None:
    """Check the number of samples of a frame's RF, and of a clip's lines."""
    side = bmode.field_of_view_mm
    # Both ways, in samples per mm.
    per_mm = 2 * probe.sampling_MHz * 1e3 / probe.sound_speed_m_per_s
    pairs = probe.elements * (probe.elements + 1) // 2
    for number, what in ((pairs, f"{probe.elements} elements"), (frames * lines, f"{frames} frames of {lines} lines")):
        most = MAX_SAMPLES / number / per_mm
        if side > most:
            remedy = f"must be at most {most:.3g} with {what} sampled at {probe.sampling_MHz:g} MHz"
            raise invalid("bmode.field_of_view_mm", side, remedy)


def check_scatterers(phantom: Phantom, realism: Realism, geometry: Geometry, probe: Probe, side: float) -> None:
    """Check the number of scatterers of a view, whose image has a side (mm)."""
    density, volume = phantom.density_per_mm3, _tissue_mm3(realism, geometry, probe, side)
    if not phantom.in_plane_only and density * volume > MAX_SCATTERERS:
        most = floor(MAX_SCATTERERS / volume * 1000) / 1000
        filled = f"because {volume:.3g} mm^3 are filled with at most {MAX_SCATTERERS} scatterers"
        raise invalid("phantom.density_per_mm3", density, f"must be at most {most:g}, {filled}")


def _tissue_mm3(realism: Realism, geometry: Geometry, probe: Probe, side: float) -> float:
    """Upper estimate of the volume that is filled with scatterers, each part times its density relative to muscle."""
    blood, surroundings, volume = realism.blood, realism.surroundings, 0.0
    if geometry.file is None:
        cavity, whole = ventricle_mm3(geometry.lengths(), geometry.scale * max(geometry.dilation, 1))
        volume = (whole - cavity) * max(geometry.hypertrophy, 1)
        volume += cavity * blood.density if blood.level_dB is not None else 0
    if surroundings.level_dB is not None:
        # The square image, as thick as the beam at its lower edge.
        wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3
        rays = probe.height_mm * max(1.0, side / probe.elevation_focus_mm - 1)
        volume += surroundings.density * 1.5 * side**2 * (rays + 2 * wavelength * side / probe.height_mm)
    return volume


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
    return ellipsoid_mm3(radius, length, base), ellipsoid_mm3(radius + wall, length + apex_wall, base)
