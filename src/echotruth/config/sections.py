"""The configuration, one section a stage. These models are the only truth about keys and defaults.

Keys carry their unit; :meth:`Section.si` gives the values in SI units.
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

UNITS: dict[str, float] = {
    "um": 1e-6,
    "mm": 1e-3,
    "per_mm3": 1e9,
    "uL": 1e-9,
    "ms": 1e-3,
    "per_min": 1 / 60,
    "mmHg": 133.322387415,
    "kPa": 1e3,
    "MHz": 1e6,
    "m_per_s": 1.0,
    "deg": pi / 180,
}
"""Suffix of a key to the factor that makes its value SI (mmHg: NIST SP 811, appendix B.8)."""

Positive = Annotated[FiniteFloat, Field(gt=0)]
Angle = Annotated[FiniteFloat, Field(ge=-90, le=90)]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40)]


def impossible(key: str, value: object, remedy: str) -> PydanticCustomError:
    """An error about one key of a section whose value cannot stand beside its neighbours."""
    return PydanticCustomError("impossible", "{remedy}", {"key": key, "value": value, "remedy": remedy})


def unit_of(key: str) -> str:
    """Unit suffix of a configuration key, or an empty string."""
    return next((unit for unit in UNITS if key.endswith(f"_{unit}")), "")


class Section(BaseModel):
    """A part of the configuration: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True)

    def si(self) -> SimpleNamespace:
        """Values in SI units under their names without the unit (`pitch_um` becomes `pitch`, m)."""
        values: dict[str, Any] = {}
        for key in type(self).model_fields:
            value, unit = getattr(self, key), unit_of(key)
            if isinstance(value, Section):
                value = value.si()
            elif value is not None and unit:
                value *= UNITS[unit]
            values[key.removesuffix(f"_{unit}")] = value
        return SimpleNamespace(**values)


class Geometry(Section):
    """Unloaded left ventricle: a truncated thick ellipsoid (fitted to Vinhas 2013)."""

    endo_radius_mm: Positive = 1.45
    """Short semi-axis of the endocardial ellipsoid."""
    endo_length_mm: Positive = 5.40
    """Long semi-axis of the endocardial ellipsoid."""
    epi_radius_mm: Positive = 2.45
    """Short semi-axis of the epicardial ellipsoid."""
    epi_length_mm: Positive = 6.20
    """Long semi-axis of the epicardial ellipsoid."""
    base_mm: FiniteFloat = 1.40
    """Height of the base plane above the equator of the ellipsoids."""
    scale: Annotated[FiniteFloat, Field(gt=0.1, lt=100)] = 1.0
    """Factor on all lengths."""
    circumferential_elements: Annotated[int, Field(ge=6, le=120, multiple_of=6)] = 24
    """Elements around the wall."""
    longitudinal_elements: Annotated[int, Field(ge=4, le=120)] = 12
    """Elements from apex to base."""
    transmural_elements: Annotated[int, Field(ge=1, le=20)] = 3
    """Quadratic elements through the wall."""

    @model_validator(mode="after")
    def _epi_outside_endo(self) -> Geometry:
        for part in ("radius", "length"):
            endo, epi = f"endo_{part}_mm", f"epi_{part}_mm"
            if getattr(self, epi) <= getattr(self, endo):
                raise impossible(f"{epi}", getattr(self, epi), f"must be greater than {endo} = {getattr(self, endo)}")
        if abs(self.base_mm) >= self.endo_length_mm:
            raise impossible("base_mm", self.base_mm, f"must lie within +-endo_length_mm = {self.endo_length_mm}")
        return self


class Fibres(Section):
    """Fibre directions by a Laplace-Dirichlet rule."""

    endo_deg: Angle = 84.0
    """Helix angle at the endocardium."""
    epi_deg: Angle = -42.0
    """Helix angle at the epicardium."""
    layers: Annotated[int, Field(ge=1, le=24)] = 6
    """Transmural layers for analysis (and for fibres when `stepwise`)."""
    stepwise: bool = False
    """One angle a layer, that of its middle, in place of a linear course."""


class Loop(Section):
    """The pressure-volume loop that drives the heart."""

    file: str = "mouse"
    """A shipped loop (`mouse`) or a CSV with columns time_ms, pressure_mmHg, volume_uL."""
    heart_rate_per_min: Annotated[FiniteFloat, Field(gt=0)] | None = None
    """Heart rate; the loop's time is scaled to it. Default: as in the file."""
    edv_uL: Positive | None = None
    """End-diastolic volume; the loop's volumes are mapped linearly to it. Default: as in the file."""
    esv_uL: Positive | None = None
    """End-systolic volume, likewise."""
    frames: Annotated[int, Field(ge=2, le=1000)] = 40
    """Frames of one cycle; frame 0 is end-diastole."""

    @model_validator(mode="after")
    def _ejects(self) -> Loop:
        if self.edv_uL is not None and self.esv_uL is not None and self.esv_uL >= self.edv_uL:
            raise impossible("esv_uL", self.esv_uL, f"must be smaller than edv_uL = {self.edv_uL}")
        return self


class Material(Section):
    """W = C/2 (exp Q - 1), Q = fibre E_ff^2 + transverse (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 shear (E_fs^2 + E_fn^2)."""

    stiffness_kPa: Positive | None = None
    """C. Default: solved, so that the heart has its end-diastolic volume at its end-diastolic pressure.
    When given, the loop's volumes are scaled to the volume the heart then has at end-diastolic pressure."""
    fibre: Positive = 9.2
    """b_f (Omens 1993)."""
    transverse: Positive = 2.0
    """b_t."""
    shear: Positive = 3.7
    """b_fs."""
    bulk_modulus_kPa: Annotated[FiniteFloat, Field(ge=100)] = 2000.0
    """Penalty on volume change; below 2000 kPa it shifts pressures by per cents."""
    length_dependence: Annotated[FiniteFloat, Field(ge=0, le=5)] = 1.4
    """beta in T_a = T_Ca [1 + beta (lambda - 1)]."""


class Mechanics(Section):
    """Finite-element heart driven through its loop."""

    material: Material = Material()
    """The wall."""
    base: Literal["radial_free", "fixed"] = "radial_free"
    """Support of the base: free to widen in its plane, or held."""


class View(Section):
    """An imaging plane."""

    plane: Literal["short_axis", "long_axis"] = "short_axis"
    """Short axis: across the long axis. Long axis: along it, seen from the apex."""
    position: Annotated[FiniteFloat, Field(ge=0, le=1)] = 0.5
    """Short axis only: place of the plane at end-diastole, 0 at the base, 1 at the endocardial apex."""
    rotation_deg: Annotated[FiniteFloat, Field(ge=-180, le=180)] = 0.0
    """Long axis only: turn of the plane about the long axis; 0 cuts septum and lateral wall."""


class Phantom(Section):
    """Scatterers in the wall."""

    density_per_mm3: Positive = 5000.0
    """Scatterers per cubic millimetre of unloaded wall; the default is some thirty a resolution cell, enough
    for fully developed speckle from normally distributed amplitudes, which count for a third."""
    in_plane_only: bool = False
    """Scatterers lie in the imaging plane and move within it, as the paper's phantom is printed."""


class Probe(Section):
    """A phased array."""

    elements: Annotated[int, Field(ge=2, le=512)] = 64
    """Number of elements."""
    frequency_MHz: Positive = 25.0
    """Centre frequency."""
    bandwidth: Annotated[FiniteFloat, Field(gt=0.05, lt=1.5)] = 0.5
    """Two-way -6 dB bandwidth of burst and array over centre frequency: 55 um of axial resolution."""
    pitch_um: Positive = 46.0
    """Distance of element centres."""
    width_um: Positive = 41.0
    """Width of an element."""
    height_mm: Positive = 1.0
    """Height of the elements (elevation)."""
    elevation_focus_mm: Positive = 6.5
    """Focus of the lens in elevation."""
    sound_speed_m_per_s: Annotated[FiniteFloat, Field(ge=300, le=6000)] = 1540.0
    """Speed of sound."""
    sampling_MHz: Positive = 100.0
    """Sampling frequency of the RF."""

    @model_validator(mode="after")
    def _can_be_sampled(self) -> Probe:
        top = self.frequency_MHz * (1 + self.bandwidth)
        if self.sampling_MHz < 2 * top:
            remedy = (
                f"its band reaches {top:g} MHz, above the Nyquist frequency of sampling_MHz = {self.sampling_MHz:g}: "
                f"lower it, or sample at {2 * top:g} MHz or more"
            )
            raise impossible("frequency_MHz", self.frequency_MHz, remedy)
        if self.width_um > self.pitch_um:
            raise impossible("width_um", self.width_um, f"must not exceed pitch_um = {self.pitch_um}")
        return self


class Rf(Section):
    """Focused lines of a sector scan."""

    focus_mm: Positive = 6.5
    """Transmit focus."""
    lines: Annotated[int, Field(ge=16, le=2048)] = 256
    """Lines of the sector."""
    sector_deg: Annotated[FiniteFloat, Field(gt=5, le=120)] = 64.0
    """Opening angle of the sector."""
    apodization: Literal["hann", "none"] = "hann"
    """Weights over the aperture, on transmit and receive."""


class Bmode(Section):
    """From RF to 8-bit images."""

    field_of_view_mm: Positive = 12.0
    """Side of the square image; the array stands in the middle of its upper edge."""
    size_px: Annotated[int, Field(ge=32, le=4096)] = 512
    """Pixels along a side of the full image."""
    downsampling: Annotated[tuple[Annotated[int, Field(ge=1, le=64)], ...], Field(min_length=1)] = (1, 2, 4)
    """Sizes kept, as divisors of the full size."""
    dynamic_range_dB: Annotated[FiniteFloat, Field(gt=10, le=120)] = 55.0
    """Range of the log compression below the brightest echo of the clip."""

    @property
    def sizes(self) -> tuple[int, ...]:
        """Pixels along a side of every image size kept, largest first."""
        return tuple(self.size_px // divisor for divisor in sorted(self.downsampling))

    @model_validator(mode="after")
    def _divides(self) -> Bmode:
        for divisor in self.downsampling:
            if self.size_px % divisor or self.size_px // divisor < 16:
                remedy = f"every entry must divide size_px = {self.size_px} and leave 16 px or more"
                raise impossible("downsampling", list(self.downsampling), remedy)
        if len(set(self.downsampling)) < len(self.downsampling):
            raise impossible("downsampling", list(self.downsampling), "entries must differ")
        return self


class Tracker(Section):
    """A way to find the motion in a clip."""

    method: Literal["phase_correlation"] = "phase_correlation"
    """Phase-only correlation of windows, the paper's."""
    window_px: Annotated[int, Field(ge=8, le=512)] | None = 64
    """Side of a window at every image size; or null, and `window_mm` holds."""
    window_mm: Positive | None = None
    """Side of a window in tissue, the same at every image size."""
    stride: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.5
    """Step between windows over the side of a window."""
    taper: Literal["none", "hann"] = "none"
    """Weights over a window before its transform."""
    reference: Literal["ED", "previous"] = "ED"
    """Each frame against ED, or against the frame before it with the steps added along the tissue's path."""

    @model_validator(mode="after")
    def _one_window(self) -> Tracker:
        if (self.window_px is None) == (self.window_mm is None):
            raise impossible(
                "window_mm", self.window_mm, "give either window_px or window_mm and set the other to null"
            )
        return self


class Tracking(Section):
    """Trackers and the grid they report on."""

    grid_px: Annotated[int, Field(ge=1, le=128)] = 10
    """Spacing of the points at which displacement is reported."""
    trackers: Annotated[dict[Name, Tracker], Field(min_length=1)] = {
        "faithful": Tracker(),
        "corrected": Tracker(taper="hann", reference="previous"),
    }
    """Name to settings: `faithful` is the paper as printed, `corrected` tapers and goes frame to frame."""


def standard_views() -> dict[str, View]:
    """Three short-axis planes and a long-axis one, as in the paper."""
    return {
        "base": View(position=0.2),
        "mid": View(position=0.5),
        "apex": View(position=0.8),
        "long_axis": View(plane="long_axis"),
    }


class Config(Section):
    """A repository to be made."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=60)] = "demo"
    """Name of the repository; it is written to out/NAME."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Start of all random draws."""
    geometry: Geometry = Geometry()
    fibres: Fibres = Fibres()
    loop: Loop = Loop()
    mechanics: Mechanics = Mechanics()
    views: Annotated[dict[Name, View], Field(min_length=1)] = Field(default_factory=standard_views)
    """Name to imaging plane."""
    phantom: Phantom = Phantom()
    probe: Probe = Probe()
    rf: Rf = Rf()
    bmode: Bmode = Bmode()
    tracking: Tracking = Tracking()
    cases: dict[str, Annotated[list[Any], Field(min_length=1)]] = {}
    """Sweep: key (as `fibres.endo_deg`) to its values; the cases are all combinations."""

    @model_validator(mode="after")
    def _fits_together(self) -> Config:
        smallest, view = self.bmode.sizes[-1], self.bmode.field_of_view_mm
        for name, tracker in self.tracking.trackers.items():
            place = f"tracking.trackers.{name}"
            if tracker.window_px is not None and tracker.window_px > smallest:
                remedy = f"must not exceed the smallest image, {smallest} px"
                raise impossible(f"{place}.window_px", tracker.window_px, remedy)
            if tracker.window_mm is not None and tracker.window_mm > view:
                remedy = f"must not exceed bmode.field_of_view_mm = {view:g}"
                raise impossible(f"{place}.window_mm", tracker.window_mm, remedy)
        if self.tracking.grid_px > smallest:
            raise impossible(
                "tracking.grid_px", self.tracking.grid_px, f"must not exceed the smallest image, {smallest} px"
            )
        if self.rf.focus_mm >= view:
            raise impossible("rf.focus_mm", self.rf.focus_mm, f"must be smaller than bmode.field_of_view_mm = {view:g}")
        return self
