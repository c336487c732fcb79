"""Trackers: one section a method, the method's name being that of its module in `tracking`."""

from __future__ import annotations

import re
from math import isfinite
from typing import Annotated, Any, Literal, Union

from pydantic import BeforeValidator, Discriminator, Field, FiniteFloat, Tag, model_validator

from echotruth.section import Name, Positive, Section, impossible

Reference = Annotated[
    Literal["ED", "previous", "cycle"],
    Field(
        description="Each frame against `ED`; or against the `previous` one, the steps added along the tissue's path; "
        "or likewise from ED both forwards and, as the cycle closes, backwards, averaged by how alike the frames were."
    ),
]
"""How the motion of pairs of frames makes that of a clip."""


class PhaseCorrelation(Section):
    """Phase-only correlation of windows, the paper's."""

    method: Literal["phase_correlation"] = "phase_correlation"
    """Name of the method."""
    window_px: Annotated[int, Field(ge=8, le=512)] | None = 64
    """Side of a window at every image size; or null, and `window_mm` holds."""
    window_mm: Positive | None = None
    """Side of a window in tissue, the same at every image size."""
    stride: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.5
    """Step between windows over the side of a window."""
    taper: Literal["none", "hann"] = "none"
    """Weights over a window before its transform."""
    floor: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.0
    """Magnitude over the greatest below which a frequency does not count: there is only noise, and phase-only
    correlation makes it as loud as the speckle."""
    reference: Reference = "ED"

    @model_validator(mode="after")
    def _one_window(self) -> PhaseCorrelation:
        if (self.window_px is None) == (self.window_mm is None):
            raise impossible(
                "window_mm", self.window_mm, "give either window_px or window_mm and set the other to null"
            )
        return self


class WindowDeformation(Section):
    """Normalised cross-correlation of windows that shrink from pass to pass and deform with the field found so far."""

    method: Literal["window_deformation"] = "window_deformation"
    """Name of the method."""
    windows_mm: Annotated[list[Positive], Field(min_length=1, max_length=6)] = Field(default=[1.5, 0.75])
    """Sides of the windows, one a pass; 8 pixels at least. Default: as suits `bmode.field_of_view_mm`."""
    sweeps: Annotated[int, Field(ge=1, le=20)] = 3
    """Passes at the last size."""
    reference: Reference = "cycle"


class AffineDic(Section):
    """Digital image correlation of one subset about every point, affine, by inverse compositional Gauss-Newton."""

    method: Literal["affine_dic"] = "affine_dic"
    """Name of the method."""
    subset_mm: Positive = 1.0
    """Side of a subset; 17 pixels at least. Default: as suits `bmode.field_of_view_mm`."""
    reference: Reference = "cycle"


class BsplineDic(Section):
    """Digital image correlation of the whole wall at once, its motion a B-spline."""

    method: Literal["bspline_dic"] = "bspline_dic"
    """Name of the method."""
    knots_mm: Positive = 0.4
    """Distance of the knots, five pixels at least. Default: as suits `bmode.field_of_view_mm`."""
    margin_um: Annotated[FiniteFloat, Field(ge=0)] = 180.0
    """How far around the wall pixels count; its edge shows how it thickens. Default: as suits
    `bmode.field_of_view_mm`."""
    range_dB: Annotated[FiniteFloat, Field(ge=0, le=120)] = 45.0
    """Decibels from black to white, by which grey values are made amplitudes again: dark gaps between speckles change
    more than the bright speckles do. 0 takes the grey values."""
    blur_px: Annotated[FiniteFloat, Field(ge=0, le=5)] = 0.6
    """Standard deviation of the Gaussian that blurs images of pixels much larger than `resolved_um`, against their
    aliasing; of pixels of that size, none."""
    resolved_um: Annotated[FiniteFloat, Field(ge=0)] = 16.0
    """Size of pixels that show all of the speckle: a sixth of the speed of sound over the bandwidth. Default: as suits
    `bmode.field_of_view_mm`."""
    smoothness: Positive = 3000.0
    """Weight of the roughness of a step from one frame to the next over that of the images, were noise as strong as the
    speckle and speckle as long as the knots are apart."""
    across: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.2
    """Length of a unit through the wall where roughness is measured; of one along it, 1."""
    tolerance: Positive = 4.0
    """Difference of grey values at which a pixel has a quarter of its weight, over their standard deviation."""
    renewal: Annotated[FiniteFloat, Field(ge=0, le=1)] = 0.75
    """Correlation of image and template below which the frame before becomes the template."""


class Dis(Section):
    """Dense inverse search of OpenCV as it is."""

    method: Literal["dis"] = "dis"
    """Name of the method."""
    preset: Literal["ultrafast", "fast", "medium"] = "medium"
    """Preset of OpenCV."""
    reference: Reference = "cycle"


class Ilk(Section):
    """Iterative Lucas-Kanade of scikit-image as it is."""

    method: Literal["ilk"] = "ilk"
    """Name of the method."""
    radius_px: Annotated[int, Field(ge=1, le=64)] = 7
    """Radius of the window about a pixel."""
    reference: Reference = "cycle"


GIVEN = ("frames", "points", "mask", "spacing", "frame_time", "seed")
"""Names of what every tracker is given, in their order."""


def numbers(value: Any) -> Any:
    """The same with numbers where YAML took them for text: it wants dot and sign in 1.0e-3."""
    if isinstance(value, dict):
        return {key: numbers(each) for key, each in value.items()}
    if isinstance(value, list):
        return [numbers(each) for each in value]
    written = isinstance(value, str) and re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+", value, re.ASCII)
    return float(value) if written else value


class Guest(Section):
    """A tracker from elsewhere: a Python callable, an entry point, or a program."""

    method: Literal["guest"] = "guest"
    """Name of the method."""
    track: Annotated[str, Field(min_length=1)] | None = None
    """A callable as `package.module:function`, or the name of an entry point in the group `echotruth.trackers`."""
    command: Annotated[list[str], Field(min_length=1)] | None = None
    """A program and its arguments, in which {input} and {output} stand for the .npz files it reads and writes."""
    timeout_s: Positive = 3600.0
    """Longest time a program may take over one clip; a callable is not timed."""
    options: Annotated[dict[str, Any], BeforeValidator(numbers)] = Field(default={})
    """Keyword arguments of the callable, or entries of the program's .npz; text such as 1e-3 is a number."""

    @model_validator(mode="after")
    def _one_way_in(self) -> Guest:
        if (self.track is None) == (self.command is None):
            raise impossible("track", self.track, "give either track or command")
        if self.track is not None and not _is_name(self.track):
            raise impossible("track", self.track, "write package.module:function (dots, no path, no .py)")
        for place in ("{input}", "{output}") if self.command else ():
            if not any(place in part for part in self.command or ()):
                raise impossible("command", self.command, f"must say where the path of the {place[1:-1]} goes: {place}")
        return self

    @model_validator(mode="after")
    def _options_fit(self) -> Guest:
        for key, value in self.options.items():
            if key in GIVEN:
                raise impossible(f"options.{key}", value, f"must have another name, for every tracker is given {key}")
            if not _is_plain(value):
                remedy = "must be finite numbers, text, true, false, null, lists of them, or mappings with text as keys"
                raise impossible(f"options.{key}", value, remedy)
            if self.command and not _is_array(value):
                remedy = (
                    "must be a number of 64 bits, a text or a list of one kind: it is an array in the program's .npz"
                )
                raise impossible(f"options.{key}", value, remedy)
        return self


def _is_name(track: str) -> bool:
    """Whether that may be `package.module:function` or the name of an entry point."""
    module, colon, function = track.partition(":")
    if module.endswith(".py"):
        return False
    if not colon:
        return re.fullmatch(r"\w[\w.-]*", track) is not None
    return all(part.isidentifier() for part in (*module.split("."), *function.split(".")))


def _is_plain(value: Any) -> bool:
    """Whether JSON, as which the workflow hands a configuration on, can say it."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and _is_plain(each) for key, each in value.items())
    if isinstance(value, list):
        return all(map(_is_plain, value))
    return isfinite(value) if isinstance(value, float) else value is None or isinstance(value, int | str)


def _is_array(value: Any) -> bool:
    """Whether a value of YAML is an array without being made an object."""
    values = value if isinstance(value, list) else [value]
    if all(isinstance(each, str) for each in values):
        return True
    # An integer of more than 64 bits would be an object.
    return all(isinstance(each, float) or (isinstance(each, int) and abs(each) < 2**63) for each in values)


METHODS: tuple[type[Section], ...] = (PhaseCorrelation, WindowDeformation, AffineDic, BsplineDic, Dis, Ilk, Guest)
"""Sections of all methods."""

DEFAULT = "phase_correlation"
"""The method where none is named."""


def name_of(method: type[Section]) -> str:
    """What `method` says in a section of that kind."""
    return method.model_fields["method"].default


def _named(values: Any) -> Any:
    return values.get("method", DEFAULT) if isinstance(values, dict) else getattr(values, "method", DEFAULT)


Tracker = Annotated[
    Union[tuple(Annotated[method, Tag(name_of(method))] for method in METHODS)],  # noqa: UP007
    Discriminator(_named),
]
"""Section of any of the methods."""


def standard_trackers(scale: float = 1.0) -> dict[str, Any]:
    """The paper's as printed and as corrected, stronger ones, and one of a library.

    Parameters
    ----------
    scale : float
        Side of the field of view over the 12 mm at which 64 pixels of 512, the paper's window, are 1.5 mm.
    """
    window = {"window_px": None, "window_mm": 1.5 * scale}
    return {
        "faithful": PhaseCorrelation(),
        "corrected": PhaseCorrelation(**window, taper="hann", floor=0.01, reference="cycle"),
        "window_deformation": WindowDeformation(),
        "affine_dic": AffineDic(),
        "dis": Dis(),
        "bspline_dic": BsplineDic(),
    }


class Tracking(Section):
    """Trackers and the grid they report on."""

    grid_px: Annotated[int, Field(ge=1, le=128)] = 5
    """Spacing of the points at which displacement is reported, in pixels of the largest image; the points are the same
    at all sizes, and lie in the wall at end-diastole."""
    trackers: Annotated[dict[Name, Tracker], Field(min_length=1)] = Field(default_factory=standard_trackers)
    """Name to settings: `faithful` is the paper as printed, `corrected` has tapered windows of the same
    tissue at every image size, leaves out frequencies without speckle, and goes frame to frame around the cycle."""
