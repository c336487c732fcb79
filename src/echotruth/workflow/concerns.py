"""What speaks against a run: it does not fit this machine, takes absurdly long, or images what no array can see."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from math import radians
from pathlib import Path

import psutil

from echotruth.config import Config
from echotruth.workflow.estimate import Estimate
from echotruth.workflow.estimate_text import format_bytes
from echotruth.workflow.imaged_tissue import imaged_tissue

YEAR_SECONDS = 365.25 * 86_400
"""CPU time of a run from which on it is warned of."""
MANY_FILES = 5_000_000
"""Number of files from which on it is warned of."""
DISK_RESERVE = 0.05
"""Share of the free disk that a run is to leave."""
ATTENUATION_DB_PER_CM_MHZ = 0.52
"""Attenuation of the heart on one way (table 4 of Diagnostics 13 (2023) 855, doi:10.3390/diagnostics13050855)."""
MAX_LOSS_DB = 120.0
"""Loss on the way to the middle of the heart and back from which on an echo is lost in the noise of any receiver: our
bound, 20 bits of amplitude. The arrays of the package lose 17 to 27 dB in their hearts."""
MIN_WALL_IN_IMAGE = 0.5
"""Share of the wall in the plane of a view that its image must show."""
MAX_PIXEL_WAVELENGTHS = 2.0
"""Pixel of the largest image over the wavelength from which on speckle is lost between pixels: it is about one
wavelength long."""
BEAM_WIDTH = 1.47
"""Width of the two-way beam at -6 dB, in wavelengths over the aperture: mouse_25MHz, 0.20 mm at 6.5 mm."""
MIN_LINES_PER_BEAM = 1.0
"""Scan lines per width of the beam."""


@dataclass(frozen=True)
class Concern:
    """A reason not to run a configuration as it is.

    Attributes
    ----------
    text : str
        One sentence that names the key and the remedy.
    is_absurd : bool
        Whether the run is refused, unless it is asked for all the same.
    """

    text: str
    is_absurd: bool


def concerns(config: Config, estimate: Estimate, folder: Path, is_local: bool = True) -> list[Concern]:
    """What speaks against a run, the absurd first.

    Parameters
    ----------
    config : Config
    estimate : Estimate
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    is_local : bool
        Whether the jobs run on this machine.
    """
    found = [*_of_the_disk(estimate, folder), *_of_the_machine(estimate, is_local), *_of_the_array(config)]
    found += _of_the_mesh(config)
    return sorted(found, key=lambda concern: not concern.is_absurd)


def _of_the_disk(estimate: Estimate, folder: Path) -> Iterator[Concern]:
    place = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.is_dir())
    system = os.statvfs(place)
    free = system.f_bavail * system.f_frsize
    stands = _bytes_below(folder) if folder.is_dir() and estimate.seconds_left < estimate.seconds else 0
    needed = max(0.0, estimate.bytes + estimate.scratch_bytes - stands)
    if needed > (1 - DISK_RESERVE) * free:
        remedy = "make space, ask for fewer cases, views or frames, a smaller bmode.size_px, or an empty rf.keep"
        yield Concern(
            f"{place}: has {format_bytes(free)} free, and the run needs {format_bytes(needed)}: {remedy}", True
        )
    if system.f_files and estimate.files > system.f_favail:
        remedy = "use a file system with more, or fewer cases and views"
        yield Concern(
            f"{place}: can take {system.f_favail} more files, and the run makes {estimate.files}: {remedy}", True
        )
    elif estimate.files > MANY_FILES:
        remedy = "make several repositories of it if your file system is slow with so many"
        yield Concern(f"cases: the run makes {estimate.files / 1e6:.3g} million files: {remedy}", False)


def _bytes_below(folder: Path) -> int:
    """Size of a repository as far as it stands."""
    return sum(os.stat(os.path.join(at, name)).st_size for at, _, names in os.walk(folder) for name in names)


def _of_the_machine(estimate: Estimate, is_local: bool) -> Iterator[Concern]:
    if estimate.seconds_left > YEAR_SECONDS:
        years = estimate.seconds_left / YEAR_SECONDS
        remedy = "ask for fewer cases, views, frames or trackers, or run it on a cluster (docs/cluster.md)"
        yield Concern(f"cases: the run takes {years:.3g} years of CPU time: {remedy}", False)
    if not is_local:
        return
    memory = psutil.virtual_memory().total / 1e6
    rule = max(estimate.megabytes, key=lambda name: estimate.megabytes[name])
    most = estimate.megabytes[rule]
    if most > memory:
        remedy = _smaller(rule)
        text = f"a job of {rule} takes {format_bytes(1e6 * most)} of memory"
        yield Concern(f"{text}, and this machine has {format_bytes(1e6 * memory)}: {remedy}", True)
    elif min(estimate.cores, estimate.hearts * estimate.views) * most > memory:
        cores = max(1, int(memory / most))
        together = f"{estimate.cores} jobs of {format_bytes(1e6 * most)} at the same time"
        text = f"{together} exceed the {format_bytes(1e6 * memory)} of memory"
        yield Concern(f"--cores {estimate.cores}: {text}: use --cores {cores}", False)


def _smaller(rule: str) -> str:
    if rule == "mechanics":
        return (
            "decrease geometry.circumferential_elements, longitudinal_elements or transmural_elements, or loop.frames"
        )
    return "decrease bmode.size_px, loop.frames or phantom.density_per_mm3, or leave channels out of rf.keep"


def _of_the_array(config: Config) -> Iterator[Concern]:
    """What the array cannot see, or the images cannot show."""
    probe, side = config.probe, config.bmode.field_of_view_mm
    wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3
    loss = 2 * ATTENUATION_DB_PER_CM_MHZ * probe.frequency_MHz * config.rf.focus_mm / 10
    if loss > MAX_LOSS_DB:
        most = MAX_LOSS_DB * 10 / (2 * ATTENUATION_DB_PER_CM_MHZ * config.rf.focus_mm)
        depth = f"{config.rf.focus_mm:g} mm"
        text = f"no array sees a heart {depth} deep at this frequency, because tissue attenuates its echoes"
        remedy = f"use at most {most:.2g} MHz, such as probe.preset: human_2_7MHz for a human heart"
        yield Concern(f"probe.frequency_MHz = {probe.frequency_MHz:g}: {text} by {loss:.0f} dB: {remedy}", True)
    yield from _outside_the_image(config)
    pixel = side / max(config.bmode.sizes)
    if pixel > MAX_PIXEL_WAVELENGTHS * wavelength:
        least = side / (MAX_PIXEL_WAVELENGTHS * wavelength)
        text = f"a pixel is {pixel / wavelength:.2g} wavelengths wide, so that speckle is lost between pixels"
        yield Concern(f"bmode.size_px = {config.bmode.size_px}: {text}: use {least:.0f} px or more", False)
    if config.rf.scan == "sector":
        beam = BEAM_WIDTH * wavelength / (probe.elements * probe.pitch_um / 1e3)
        spacing = radians(config.rf.sector_deg) / (config.rf.lines - 1)
        if beam < MIN_LINES_PER_BEAM * spacing:
            least = int(MIN_LINES_PER_BEAM * radians(config.rf.sector_deg) / beam) + 2
            text = f"lines lie {spacing / beam:.2g} widths of the beam apart, so that speckle is lost between them"
            yield Concern(f"rf.lines = {config.rf.lines}: {text}: use {least} or more", False)


def _of_the_mesh(config: Config) -> Iterator[Concern]:
    """A file that holds no wall; whether the wall has a solution, only the mechanics tells."""
    if config.geometry.file is None or config.motion.kind == "file":
        return
    from echotruth.mechanics.geometry import imported_mesh
    from echotruth.mechanics.geometry.mesh_quality import GeometryError

    try:
        imported_mesh.read(config.geometry)
    except GeometryError as error:
        yield Concern(str(error), True)


def _outside_the_image(config: Config) -> Iterator[Concern]:
    """A view whose image shows less than half of the wall; of hearts whose shape is known before a mesh is made."""
    if config.geometry.file is not None or config.motion.kind == "file" or config.geometry.shape != "ellipsoid":
        return
    shown = {}
    for view in config.views:
        tissue = imaged_tissue(config, view)
        if tissue.plane_mm2:
            shown[view] = tissue.wall_mm2 / tissue.plane_mm2
    if not shown:
        return
    view = min(shown, key=lambda name: shown[name])
    if shown[view] < MIN_WALL_IN_IMAGE:
        side = config.bmode.field_of_view_mm
        text = f"the image of the view {view} shows {100 * shown[view]:.0f} % of the wall"
        remedy = "use a larger one, and an array and rf.focus_mm that suit it, or leave all to geometry.preset"
        yield Concern(f"bmode.field_of_view_mm = {side:g}: {text}: {remedy}", True)
