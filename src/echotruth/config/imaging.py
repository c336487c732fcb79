"""Views, phantom, lines and images."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, model_validator

from echotruth.section import Positive, Section, impossible


def _number(value: Any) -> Any:
    """A number that YAML took for text: it wants a dot in 2e-5."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


class View(Section):
    """An imaging plane."""

    plane: Literal["short_axis", "long_axis"] = "short_axis"
    """Short axis: across the long axis. Long axis: along it, seen from the apex."""
    position: Annotated[FiniteFloat, Field(ge=0, le=1)] = 0.5
    """Short axis only: place of the plane at end-diastole, 0 at the base, 1 at the endocardial apex."""
    rotation_deg: Annotated[FiniteFloat, Field(ge=-180, le=180)] = 0.0
    """Long axis only: turn of the plane about the long axis; 0 cuts septum and lateral wall."""


ALL = "all"
"""Stands for all views of a heart where scores are told, and so is the name of none."""


class Phantom(Section):
    """Scatterers in the wall."""

    density_per_mm3: Positive = 2800.0
    """Scatterers per cubic millimetre of unloaded wall; the default is ten a resolution cell, the fewest that
    make fully developed speckle. Default: as suits `probe.preset`."""
    in_plane_only: bool = False
    """Scatterers lie in the imaging plane and move within it, as the paper's phantom is printed."""


class Rf(Section):
    """Transmits, and lines focused on receive."""

    focus_mm: Positive = 6.5
    """Transmit focus, where the heart stands. Default: as suits `probe.preset`."""
    zones: Annotated[int, Field(ge=1, le=16)] = 5
    """Focused: focal zones, each with its transmit for every line. Their foci lie about `focus_mm`; between two, a line
    fades over from the one's echoes to the other's. 1: one focus, off which speckle lags behind tissue that turns.
    Default: as suits `probe.preset`."""
    zone_mm: Positive = 1.0
    """Focused: distance between the foci of neighbouring zones. Default: half a depth of field, as suits
    `probe.preset`."""
    scan: Literal["sector", "linear"] = "sector"
    """Lines that fan out from the centre of the array, or parallel ones straight ahead."""
    lines: Annotated[int, Field(ge=16, le=2048)] = 192
    """Scan lines. The default are five in the width of the beam: what an image loses between them is less than 1 % of
    the envelope."""
    sector_deg: Annotated[FiniteFloat, Field(gt=5, le=120)] = 64.0
    """Sector: opening angle. Default: as suits `probe.preset`."""
    width_mm: Positive | None = None
    """Linear: distance of the outermost lines. Default: the length of the array."""
    transmit: Literal["focused", "plane", "diverging", "synthetic_aperture"] = "focused"
    """What is sent: a focused beam for every line; or plane waves, diverging waves or every element in its turn, from
    all of which all lines are made (coherent compounding)."""
    transmits: Annotated[int, Field(ge=1, le=512)] = 11
    """Plane, diverging: number of waves."""
    tilt_deg: Annotated[FiniteFloat, Field(ge=0, le=120)] = 40.0
    """Plane, diverging: angle between the first and the last wave; a single one goes straight ahead."""
    source_mm: Positive | None = None
    """Diverging: distance of the virtual sources behind the centre of the array. Default: that from which the array is
    seen under the angle of the sector."""
    apodization: Literal["hann", "none"] = "hann"
    """Weights over the aperture, on receive and, where focused or synthetic, on transmit."""
    f_number: Annotated[FiniteFloat, Field(ge=0, le=20)] = 0.0
    """Least range over aperture, on receive and focused transmit; 0 takes the whole array at every range."""
    accuracy: Annotated[FiniteFloat, BeforeValidator(_number), Field(ge=2e-5, le=1e-3)] = 2e-5
    """Error against the exact sum that the RF of a plane may have, relative (L2); 1e-3 is faster. Only without
    `elevation`, whose own error is greater: 1.5 % beyond one aperture, or beyond two under the tall lens of
    a human's array, and some per cent nearer or, with attenuation, far beside the plane."""
    elevation: bool = True
    """Whether scatterers beside the plane are heard through the lens; without it elements are strips without end."""
    keep: list[Literal["lines", "channels"]] = Field(default=[])
    """What of the RF stays in the repository: `lines`, demodulated, and `channels`, the echoes of each element sending
    alone in all elements, from which any transmit can be made."""

    @property
    def zones_mm(self) -> float:
        """Distance of the nearest and of the farthest transmit focus from `focus_mm`."""
        return (self.zones - 1) / 2 * self.zone_mm if self.transmit == "focused" else 0.0

    @model_validator(mode="after")
    def _foci_before_the_array(self) -> Rf:
        if self.focus_mm <= self.zones_mm:
            foci = f"its zones = {self.zones} foci, zone_mm = {self.zone_mm:g} apart"
            remedy = f"must exceed {self.zones_mm:g}, so that {foci}, lie in front of the array"
            raise impossible("focus_mm", self.focus_mm, remedy)
        return self

    @model_validator(mode="after")
    def _kept_once(self) -> Rf:
        if len(set(self.keep)) < len(self.keep):
            raise impossible("keep", self.keep, "name each once")
        return self


class Bmode(Section):
    """From RF to 8-bit images."""

    field_of_view_mm: Positive = 12.0
    """Side of the square image; the array stands in the middle of its upper edge. Default: as suits `probe.preset`."""
    size_px: Annotated[int, Field(ge=32, le=4096)] = 512
    """Pixels along a side of the full image."""
    downsampling: Annotated[tuple[Annotated[int, Field(ge=1, le=64)], ...], Field(min_length=1)] = (1, 2, 4)
    """Sizes kept, as divisors of the full size."""
    dynamic_range_dB: Annotated[FiniteFloat, Field(gt=10, le=120)] = 55.0
    """Range of the log compression below the brightest echo of the clip."""
    tgc_dB_per_cm_MHz: Annotated[FiniteFloat, Field(ge=0, le=3)] | None = None
    """Time gain compensation: what the gain makes good for on each way, at the centre frequency. Default: the
    attenuation of the probe's tissue."""

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


def standard_views() -> dict[str, View]:
    """Three short-axis planes and a long-axis one, as in the paper."""
    return {
        "base": View(position=0.2),
        "mid": View(position=0.5),
        "apex": View(position=0.8),
        "long_axis": View(plane="long_axis"),
    }
