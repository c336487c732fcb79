"""What speaks against a run: it does not fit this machine, or its images cannot show the heart or its strain."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import psutil

from echotruth.config import Config
from echotruth.evaluation.strain import largest_grid
from echotruth.workflow.estimate import Estimate, format_bytes, free_bytes
from echotruth.workflow.imaged_tissue import ellipsoids

MAX_PIXEL_WAVELENGTHS = 2.0
"""Pixel of the largest image over the wavelength from which on speckle is lost between pixels: it is about one
wavelength long."""


class Concern(NamedTuple):
    """A reason not to run a configuration as it is: a sentence that names key and remedy, and whether it is refused."""

    text: str
    is_absurd: bool


def concerns(config: Config, estimate: Estimate, folder: Path, is_local: bool = True) -> list[Concern]:
    """What speaks against a run.

    Parameters
    ----------
    config : Config
    estimate : Estimate
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    is_local : bool
        Whether the jobs run on this machine.
    """
    found = [*_of_the_images(config), *_of_the_file(config), *(_of_the_memory(estimate) if is_local else ())]
    free, needed = free_bytes(folder), estimate.bytes * estimate.seconds_left / estimate.seconds
    if needed > 0.95 * free:
        text = f"{folder}: its disk has {format_bytes(free)} free, and the run needs {format_bytes(needed)}"
        remedy = "make space, ask for fewer cases, views or frames, a smaller bmode.size_px, or an empty rf.keep"
        found.append(Concern(f"{text}: {remedy}", True))
    return found


def _of_the_memory(estimate: Estimate) -> Iterator[Concern]:
    memory = psutil.virtual_memory().total / 1e6
    rule, most = max(estimate.megabytes.items(), key=lambda entry: entry[1])
    takes, has = format_bytes(1e6 * most), format_bytes(1e6 * memory)
    text = f"a job of {rule} takes {takes} of memory, and this machine has {has}"
    if most > memory:
        keys = "the elements of geometry" if rule == "mechanics" else "bmode.size_px, phantom.density_per_mm3"
        yield Concern(f"{text}: decrease {keys} or loop.frames", True)
    elif min(estimate.cores, estimate.parts[rule].jobs) * most > memory:
        yield Concern(f"--cores {estimate.cores}: {text}: use --cores {max(1, int(memory / most))}", False)


def _of_the_images(config: Config) -> Iterator[Concern]:
    side, probe = config.bmode.field_of_view_mm, config.probe
    wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3
    width = 2 * ellipsoids(config)[1].radius
    if config.geometry.file is None and config.motion.kind != "file" and width > side:
        text = f"the heart is {width:.3g} mm wide, so that the image does not show its wall"
        remedy = "use a larger one, and an array and rf.focus_mm that suit it, or leave all to geometry.preset"
        yield Concern(f"bmode.field_of_view_mm = {side:g}: {text}: {remedy}", True)
    pixel = side / max(config.bmode.sizes) / wavelength
    if pixel > MAX_PIXEL_WAVELENGTHS:
        text = f"a pixel is {pixel:.2g} wavelengths wide, so that speckle is lost between pixels"
        remedy = f"use {side / (MAX_PIXEL_WAVELENGTHS * wavelength):.0f} px or more"
        yield Concern(f"bmode.size_px = {config.bmode.size_px}: {text}: {remedy}", False)
    most = largest_grid(config.bmode.size_px)
    if config.tracking.grid_px > most >= 1:
        apart = config.tracking.grid_px * side / config.bmode.size_px
        text = (
            f"points {apart:.2g} mm apart are too few through the wall for strain at its borders, which is left empty"
        )
        yield Concern(f"tracking.grid_px = {config.tracking.grid_px}: {text}: use {most} or less", False)


def _of_the_file(config: Config) -> Iterator[Concern]:
    """A file that holds no wall; whether the wall has a solution, only the mechanics tells."""
    if config.geometry.file is None or config.motion.kind == "file":
        return
    from echotruth.mechanics.geometry import imported_mesh
    from echotruth.mechanics.geometry.mesh_quality import GeometryError

    try:
        imported_mesh.read(config.geometry)
    except GeometryError as error:
        yield Concern(str(error), True)
