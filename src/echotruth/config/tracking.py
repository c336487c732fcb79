"""Settings of the trackers: one section per method, which has the name of its module in `tracking.trackers`."""

from __future__ import annotations

import re
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat

from echotruth.section import OF_ZARR, Name, Positive, Section, check, invalid, tagged

Reference = Annotated[
    Literal["ED", "previous", "bidirectional"],
    Field(
        description="Frame with which each frame is compared: `ED`; the `previous` one, with the steps added along "
        "the path of the tissue; or `bidirectional`, likewise both forwards and backwards around the cycle, averaged "
        "with weights from the correlation of the frames. A clip whose last frame is unlike the first is tracked "
        "forwards only, with a warning."
    ),
]


DynamicRange = Annotated[
    FiniteFloat,
    Field(
        ge=0,
        le=120,
        description="Dynamic range of the images, by which log compression is undone before they are compared. 0 uses "
        "the grey values.",
    ),
]


class PhaseCorrelation(Section):
    """Phase-only correlation of windows, the method of the paper."""

    method: Literal["phase_correlation"] = "phase_correlation"
    """Name of the method."""
    window_px: Annotated[int, Field(ge=8, le=512)] | None = 64
    """Side of a window at every image size; null to give `window_mm` instead."""
    window_mm: Positive | None = None
    """Side of a window in tissue, the same at every image size."""
    stride: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.5
    """Step between windows, as a fraction of the side of a window."""
    taper: Literal["none", "hann"] = "none"
    """Weights of the pixels of a window before the Fourier transform."""
    spectral_threshold: Annotated[FiniteFloat, Field(ge=0, lt=1)] = 0.0
    """Magnitude, relative to the largest, below which a frequency is left out as noise, to which phase-only correlation
    would give the same weight as to speckle."""
    dynamic_range_dB: DynamicRange = 0.0
    reference: Reference = "ED"

    @check
    def _one_window(self) -> None:
        is_one = (self.window_px is None) != (self.window_mm is None)
        self.require(is_one, "window_mm", "give either window_px or window_mm and set the other to null")


class WindowDeformation(Section):
    """Normalised cross-correlation of windows that shrink from pass to pass and deform with the motion."""

    method: Literal["window_deformation"] = "window_deformation"
    """Name of the method."""
    windows_mm: Annotated[list[Positive], Field(min_length=1, max_length=6)] = Field(default=[1.5, 0.75])
    """Side of the windows in each pass; 8 pixels at least. Default: as suits `bmode.field_of_view_mm`."""
    final_passes: Annotated[int, Field(ge=1, le=20)] = 3
    """Number of passes with the last size."""
    dynamic_range_dB: DynamicRange = 0.0
    reference: Reference = "bidirectional"


class BsplineDic(Section):
    """Digital image correlation of the whole wall at once; the motion is a cubic B-spline, of volumes trilinear."""

    method: Literal["bspline_dic"] = "bspline_dic"
    """Name of the method."""
    knots_mm: Positive = 0.4
    """Distance between knots; 5 pixels at least. Default: as suits `bmode.field_of_view_mm`."""
    margin_um: Annotated[FiniteFloat, Field(ge=0)] = 180.0
    """Distance from the wall up to which pixels are used too; the edge of the wall shows how it thickens. Default: as
    suits `bmode.field_of_view_mm`."""
    dynamic_range_dB: Annotated[FiniteFloat, Field(ge=0, le=120)] = 45.0
    """Dynamic range of the images, by which log compression is undone: dark gaps between speckles change more than the
    bright speckles do. 0 uses the grey values."""
    gain_mm: Annotated[FiniteFloat, Field(ge=0)] = 0.6
    """Standard deviation of the Gaussian over which the gain is made even, so that tissue in a shadow counts like the
    rest; 0 for none. Default: as suits `bmode.field_of_view_mm`."""
    blur_px: Annotated[FiniteFloat, Field(ge=0, le=5)] = 0.6
    """Standard deviation of the Gaussian blur of images with pixels much larger than `speckle_pixel_um`, against
    aliasing; images with pixels of that size are not blurred."""
    speckle_pixel_um: Annotated[FiniteFloat, Field(ge=0)] = 16.0
    """Size of pixels that resolve the speckle fully: speed of sound / (6 bandwidth). Default: as suits
    `bmode.field_of_view_mm`."""
    smoothness: Positive | None = None
    """Weight of the bending energy of a step, times the power of the noise over that of the speckle and the speckle
    length over the distance between knots. Default: the weight for which the images of the step give most evidence, and
    2000 in volumes."""
    transmural_scale: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.2
    """Scale of lengths through the wall in the bending energy; lengths along the wall have the scale 1."""
    tolerance: Positive = 4.0
    """Residual, in standard deviations, at which the robust weight of a pixel is 1/4."""
    template_update_ncc: Annotated[FiniteFloat, Field(ge=0, le=1)] = 0.75
    """Correlation of image and template below which the previous frame becomes the template."""
    reference: Annotated[
        Literal["previous", "bidirectional"],
        Field(
            description="Forwards from ED only (`previous`), or `bidirectional`: forwards and backwards around the "
            "cycle, averaged with weights from their variances. A clip whose last frame is unlike the first is "
            "tracked forwards only, with a warning."
        ),
    ] = "bidirectional"


class BsplineCnn(BsplineDic):
    """`bspline_dic` and a network, learned from drawn hearts, that corrects its motion."""

    method: Literal["bspline_cnn"] = "bspline_cnn"  # type: ignore[assignment]
    """Name of the method."""
    weights: str | None = None
    """File of weights that `examples/ray_network.py` wrote. Default: those that come with echotruth."""

    @property
    def files(self) -> list[str]:
        """The weights, if they are not those of the package."""
        return [self.weights] if self.weights else []


class Dis(Section):
    """Dense inverse search of OpenCV, unmodified."""

    method: Literal["dis"] = "dis"
    """Name of the method."""
    preset: Literal["ultrafast", "fast", "medium", "fine"] = "medium"
    """Preset of OpenCV; `fine` is `medium` down to the full size of the images, with larger patches: more accurate, and
    several times as slow."""
    reference: Reference = "bidirectional"


TRACKER_ARGUMENTS = ("frames", "points", "mask", "spacing", "frame_time", "seed")
"""Names of the arguments of every tracker, in order."""


def parse_numbers(value: Any) -> Any:
    """The value with text such as 1e-3 as numbers; YAML reads a number in that form only with dot and sign, 1.0e-3."""
    if isinstance(value, dict):
        return {key: parse_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [parse_numbers(item) for item in value]
    is_number = isinstance(value, str) and re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+", value, re.ASCII)
    return float(value) if is_number else value


class External(Section):
    """A tracker from outside the package: a Python callable, an entry point, or a program."""

    method: Literal["external"] = "external"
    """Name of the method."""
    track: Annotated[str, Field(min_length=1)] | None = None
    """A callable as `package.module:function`, or the name of an entry point in the group `echotruth.trackers`."""
    command: Annotated[list[str], Field(min_length=1)] | None = None
    """A program and its arguments; {input} and {output} stand for the .npz files that it reads and writes."""
    timeout_s: Positive = 3600.0
    """Longest time that a program may take for one clip; a callable has no limit."""
    options: Annotated[dict[str, Any], BeforeValidator(parse_numbers)] = Field(default={})
    """Keyword arguments of the callable, or entries of the program's .npz; text such as 1e-3 is a number."""

    @property
    def files(self) -> list[str]:
        """What may be files on which the result depends: the words of the command."""
        return self.command or []

    @check
    def _track_or_command(self) -> None:
        self.require((self.track is None) != (self.command is None), "track", "give either track or command")
        is_name = self.track is None or _is_callable_name(self.track)
        self.require(is_name, "track", "write package.module:function (dots, no path, no .py)")
        for file in ("{input}", "{output}") if self.command else ():
            is_there = any(file in word for word in self.command or ())
            self.require(is_there, "command", f"must contain {file} where the path of that file belongs")

    @check
    def _valid_options(self) -> None:
        for key, value in self.options.items():
            remedy = ""
            if key in TRACKER_ARGUMENTS:
                remedy = f"must have another name, because {key} is an argument of every tracker"
            elif not _is_json(value):
                remedy = "must be finite numbers, text, true, false, null, lists of them, or mappings with text as keys"
            elif self.command and not _is_array(value):
                remedy = (
                    "must be a number of 64 bits, text or a list of one kind: the program's .npz holds it as an array"
                )
            if remedy:
                raise invalid(f"options.{key}", value, remedy)


def _is_callable_name(track: str) -> bool:
    """Whether the text has the form `package.module:function` or that of an entry point."""
    module, colon, function = track.partition(":")
    if module.endswith(".py"):
        return False
    if not colon:
        return re.fullmatch(r"\w[\w.-]*", track) is not None
    return all(part.isidentifier() for part in (*module.split("."), *function.split(".")))


def _is_json(value: Any) -> bool:
    """Whether JSON, in which the workflow passes on a configuration, can hold the value."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and _is_json(item) for key, item in value.items())
    if isinstance(value, list):
        return all(map(_is_json, value))
    return isfinite(value) if isinstance(value, float) else value is None or isinstance(value, int | str)


def _is_array(value: Any) -> bool:
    """Whether NumPy makes an array of the value that does not hold Python objects."""
    values = value if isinstance(value, list) else [value]
    if all(isinstance(item, str) for item in values):
        return True
    # An integer of more than 64 bits would be an object.
    return all(isinstance(item, float) or (isinstance(item, int) and abs(item) < 2**63) for item in values)


class OnnxSignature(Section):
    """What a model in ONNX takes and gives, as the file beside it declares it (docs/trackers.md lists the keys)."""

    # T frames of H rows and W columns, N points, and the sizes of other axes: batch, channels and coordinates.
    frames: Literal["THW", "T1HW", "T3HW", "THW1", "THW3", "1THW", "1T1HW", "1T3HW", "1THW1", "1THW3"] | None = None
    points: Literal["N2", "1N2", "N3", "1N3"] | None = None
    tracks: Literal["TN2", "NT2", "1TN2", "1NT2"] | None = None
    coordinates: Literal["xy", "row_column"] = "xy"
    unit: Literal["px", "normalised"] = "px"
    values: Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)] | None = None
    inputs: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None
    outputs: Annotated[list[str], Field(min_length=1, max_length=2)] | None = None
    side_px: Annotated[int, Field(ge=1, le=65_536)] | None = None
    frames_per_call: Annotated[int, Field(ge=2)] | None = None
    points_per_call: Annotated[int, Field(ge=1)] | None = None

    @check
    def _two_values(self) -> None:
        self.require(self.values is None or self.values[0] != self.values[1], "values", "must be black and then white")


class Onnx(Section):
    """A learned point tracker in ONNX, which ONNX Runtime runs on one core."""

    method: Literal["onnx"] = "onnx"
    """Name of the method."""
    model: Annotated[str, Field(min_length=1)]
    """File of the model. A file beside it of the same name with the ending .yaml declares what its graph does not say
    (docs/trackers.md)."""
    timeout_s: Positive = 3600.0
    """Longest time that the model may take for one clip."""

    @property
    def files(self) -> list[str]:
        """The model, its signature, and the weights that PyTorch saves beside a large one."""
        return [self.model, str(Path(self.model).with_suffix(".yaml")), f"{self.model}.data"]


OUTSIDE = (External, Onnx)
"""Sections of trackers from outside the package."""

METHODS: tuple[type[Section], ...] = (
    PhaseCorrelation,
    WindowDeformation,
    BsplineDic,
    BsplineCnn,
    Dis,
    *OUTSIDE,
)
"""Sections of all methods of tracking."""

VOLUMETRIC: tuple[type[Section], ...] = (BsplineDic, External)
"""Sections of methods that track volumes."""

BUILTIN = tuple(method.model_fields["method"].default for method in METHODS if method not in OUTSIDE)
"""Names of the methods of echotruth."""

ENTRY_POINT_GROUP = "echotruth.trackers"
"""Group of entry points under which a package names its trackers."""

DEFAULT = "phase_correlation"
"""Method of a tracker that names none."""


def name_of(method: type[Section]) -> str:
    """Name of a method: the default of its key `method`."""
    return method.model_fields["method"].default


if TYPE_CHECKING:
    Tracker = Section
else:
    Tracker = tagged("method", DEFAULT, {name_of(method): method for method in METHODS})
"""Section of one of the methods."""


def default_trackers(scale: float = 1.0) -> dict[str, Any]:
    """The default trackers: the paper's as corrected, stronger ones, and one of a library.

    Parameters
    ----------
    scale : float
        Side of the field of view over 12 mm, at which 64 pixels of 512, the paper's window, are 1.5 mm.
    """
    window: dict[str, Any] = {"window_px": None, "window_mm": 1.5 * scale}
    return {
        "corrected": PhaseCorrelation(**window, taper="hann", spectral_threshold=0.01, reference="bidirectional"),
        "window_deformation": WindowDeformation(),
        "dis": Dis(),
        "bspline_dic": BsplineDic(),
    }


class Tracking(Section):
    """Trackers and the grid they report on."""

    grid: Annotated[FiniteFloat, Field(gt=0, le=0.25)] = 0.01
    """Spacing of the points at which displacement is reported, over the side of the image, rounded to whole pixels of
    the largest image: 0.01 are 5 of 512. The points are the same at all image sizes and lie in the wall at
    end-diastole. There is no strain at the borders of the wall if they are more than 0.015 apart."""
    frame_step: Annotated[int, Field(ge=1, le=1000)] = 1
    """Trackers are given every n-th frame, as of a scanner with an n-th of the frame rate. Displacement and quality in
    the frames between are interpolated linearly in time; the cycle closes, so that after the last given frame they lead
    back to those of end-diastole one period later, and stay in a view that drifts or breathes."""
    trackers: Annotated[dict[Name, Tracker], Field(min_length=1, max_length=64)] = Field(
        default_factory=default_trackers
    )
    """Settings by name: `corrected` is the tracker of the paper with tapered windows of the same size in tissue for
    every image size, without the frequencies that have no speckle, and bidirectional."""

    @check
    def _check_names(self) -> None:
        for name in OF_ZARR.keys() & self.trackers:
            raise invalid("trackers", name, OF_ZARR[name])
