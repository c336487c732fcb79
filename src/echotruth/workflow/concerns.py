"""What speaks against a run: its images cannot show the heart or its strain, or a file holds no wall."""

from collections.abc import Iterator
from math import ceil
from typing import NamedTuple

from echotruth.config import Config
from echotruth.config.tracking import VOLUMETRIC
from echotruth.evaluation.no_estimate import coarse_grid

MAX_PIXEL_WAVELENGTHS = 2.0
"""Pixel of the largest image over the wavelength from which on speckle is lost between pixels: it is about one
wavelength long."""


class Concern(NamedTuple):
    """A reason not to run a configuration as it is: a sentence that names key and remedy, and whether it is refused."""

    text: str
    is_absurd: bool


def concerns(config: Config) -> Iterator[Concern]:
    """What speaks against a run."""
    yield from (_of_the_volumes if config.has_volumes else _of_the_images)(config)
    yield from _of_the_file(config)


def _of_the_images(config: Config) -> Iterator[Concern]:
    side, probe = config.bmode.field_of_view_mm, config.probe
    wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3
    if config.geometry.file is None and config.motion.kind != "file" and 2 * config.geometry.outer_radius_mm() > side:
        width = 2 * config.geometry.outer_radius_mm()
        text = f"the heart is {width:.3g} mm wide, so that the image does not show its wall"
        remedy = "use a larger one, and an array and rf.focus_mm that suit it, or leave all to geometry.preset"
        yield Concern(f"bmode.field_of_view_mm = {side:g}: {text}: {remedy}", True)
    pixel = side / max(config.bmode.sizes) / wavelength
    if pixel > MAX_PIXEL_WAVELENGTHS:
        text = f"a pixel is {pixel:.2g} wavelengths wide, so that speckle is lost between pixels"
        remedy = f"use {side / (MAX_PIXEL_WAVELENGTHS * wavelength):.0f} px or more"
        yield Concern(f"bmode.size_px = {config.bmode.size_px}: {text}: {remedy}", False)
    if text := coarse_grid(config):
        yield Concern(text, False)


def _of_the_volumes(config: Config) -> Iterator[Concern]:
    for name, tracker in config.tracking.trackers.items():
        if type(tracker) not in VOLUMETRIC:
            remedy = "use bspline_dic, or a function or program"
            yield Concern(f"tracking.trackers.{name}.method tracks slices, and the views are volumes: {remedy}", True)
    if config.geometry.file is not None or config.motion.kind == "file":
        return
    (depth, _, width), radius = config.volume.field_mm, config.geometry.outer_radius_mm()
    for name, view in config.views.items():
        for along, side in (("axial", depth), ("lateral", width)):
            offset = abs(getattr(view.offset, f"{along}_mm"))
            if offset + radius > side / 2:
                is_beside = offset - radius >= side / 2
                where = "is beside" if is_beside else "reaches beyond"
                text = f"the heart, {2 * radius:.3g} mm wide, {where} the volume of the view {name}"
                remedy = f"use {ceil(20 * (offset + radius)) / 10:g} or more for the {along} side"
                remedy += f", or a smaller views.{name}.offset.{along}_mm" if offset else ""
                yield Concern(f"volume.field_mm = {list(config.volume.field_mm)}: {text}: {remedy}", is_beside)


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
