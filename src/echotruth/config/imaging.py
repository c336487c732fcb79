"""Sections `views`, `phantom`, `rf` and `bmode`."""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat

from echotruth.config.presets import PRESETS
from echotruth.section import Fraction, Name, Positive, Section, as_tuple, check, invalid

Distance = Annotated[FiniteFloat, Field(ge=-1000, le=1000)]


class Offset(Section):
    """Offset of the probe in its plane, along its own axes.

    Without one, the middle of the heart lies at `rf.focus_mm` below the middle of the array.
    """

    lateral_mm: Distance = 0.0
    """Along the array: with a positive one the heart lies farther to the left in the image."""
    axial_mm: Distance = 0.0
    """Towards the heart, which then lies higher in the image."""


class Excursion(Section):
    """Displacement of the heart as a whole along the axes of the image at end-diastole."""

    lateral_mm: Distance = 0.0
    """To the right in the image."""
    axial_mm: Distance = 0.0
    """Away from the probe."""
    elevation_mm: Distance = 0.0
    """Out of the plane, along the elevation axis."""


class Breathing(Excursion):
    """Excursion of the heart from the end of expiration to the end of inspiration, and when it takes place."""

    rate_per_min: Positive | None = None
    """Breaths per minute, f. Default: the heart rate over 4.5, as of mammals of any size at rest (Stahl 1967, J Appl
    Physiol 22:453)."""
    phase_deg: Annotated[FiniteFloat, Field(ge=0, le=360)] = 0.0
    """Phase at end-diastole: 0 at the end of expiration, 180 at that of inspiration."""


class ViewMotion(Section):
    """Rigid motion of the heart relative to the probe, which comes on top of the beat: all are added.

    Either may move. The truth is that of the image: displacement has this motion, strain has not.
    """

    beat: Excursion = Excursion()
    """Excursion from end-diastole to the middle of the beat and back, a raised cosine, as of a heart whose apex knocks
    against the chest."""
    drift: Excursion = Excursion()
    """Displacement in the course of one beat, at a constant rate, as of a hand that slips."""
    breathing: Breathing = Breathing()
    """Excursion of the heart from the end of expiration to the end of inspiration, of which it has made the share
    (1 - cos(2 pi f t + phase)) / 2 a time t after end-diastole, less that at end-diastole."""
    rocking_deg: Annotated[FiniteFloat, Field(ge=-45, le=45)] = 0.0
    """Largest rotation about the middle of the array, counter-clockwise in the image, from end-diastole to the middle
    of the beat and back, as of a probe that the beating chest rocks: a raised cosine."""

    @property
    def is_closed(self) -> bool:
        """Whether the heart is back in its place when the next beat begins."""
        excursions = (self.drift, self.breathing)
        return not any((each.lateral_mm, each.axial_mm, each.elevation_mm) != (0, 0, 0) for each in excursions)


class View(Section):
    """An imaging plane, and the probe in it."""

    plane: Literal["short_axis", "long_axis", "volume"] = "short_axis"
    """`short_axis`: perpendicular to the long axis. `long_axis`: contains it, seen from the apex. `volume`: the heart
    in three dimensions, as the section `volume` says, by a row-column array of `probe.elements` columns and rows; its
    middle plane is that of a short axis; no view is then a slice (docs/volumes.md)."""
    position: Fraction = 0.5
    """Short axis, volume: position of the plane at end-diastole, 0 at the base, 1 at the endocardial apex."""
    rotation_deg: Annotated[FiniteFloat, Field(ge=-180, le=180)] = 0.0
    """Long axis only: rotation of the plane about the long axis; 0 cuts septum and lateral wall."""
    tilt_deg: Annotated[FiniteFloat, Field(ge=-45, le=45)] = 0.0
    """Tilt of the plane about its lateral axis; a positive one moves the upper edge of the image, where the probe is,
    to the side of the elevation axis. Short axis: about the point of the long axis at `position`; the cut is oblique,
    with the anterior wall nearer to the base. Long axis: about the middle of the base; the plane misses the apex, which
    looks foreshortened, and its apical end lies in front of it (`rotation_deg` 0: on the anterior side)."""
    angle_deg: Annotated[FiniteFloat, Field(ge=-180, le=180)] = 0.0
    """Angle of the probe in the plane, about the middle of the heart at `rf.focus_mm`; a positive one turns the probe
    clockwise, and so the heart in the image counter-clockwise."""
    offset: Offset = Offset()
    """Offset of the probe in its plane, along its own axes, after it is turned by `angle_deg`."""
    motion: ViewMotion = ViewMotion()
    """Rigid motion of the heart relative to the probe, on top of the beat. Default: none."""

    @property
    def approach_mm(self) -> float:
        """Upper bound of how much nearer to the heart the probe comes than with offset 0 at end-diastole, mm."""
        motion = self.motion
        towards = (max(-each.axial_mm, 0.0) for each in (motion.beat, motion.drift))
        return self.offset.axial_mm + sum(towards) + abs(motion.breathing.axial_mm)


ALL_VIEWS = "all"
"""Name of the mean over all views in the leaderboard; no view may have it."""


ScatteringExponent = Annotated[FiniteFloat, Field(ge=0, le=4)]
"""Power n of f / f0 that the amplitude of an echo follows, f0 being the centre frequency of the probe.

0 is the same echo at all frequencies. 2 is the limit of scatterers much smaller than the wavelength (Rayleigh): the
power of the echo goes with f^4, as measured in blood from 5 to 15 MHz (Shung, Sigelmann, Reid 1976, IEEE Trans Biomed
Eng 23:460); from 30 to 90 MHz and at higher haematocrits it rises less (Maruvada, Shung, Wang 2002, Ultrasound Med Biol
28:1081). The power from thin cylinders goes with f^3 if they are much longer than the wavelength, and with f^4 if they
are much shorter (Wear & Harris 2008, doi:10.1121/1.2980524): 1.5 to 2 for fibres of muscle across the beam.
"""


class Phantom(Section):
    """Scatterers in the wall."""

    density_per_mm3: Annotated[FiniteFloat, Field(gt=0, le=1e6)] = 2800.0
    """Scatterers per cubic millimetre of unloaded wall. At 2800 with mouse_25MHz, speckle SNR is 1.816 (1.913 if fully
    developed); tracker error shows no consistent trend with density. Default: from `probe.preset`, at least ten per
    resolution cell."""
    scattering_exponent: ScatteringExponent = 0.0
    """Power of f / f0 that the amplitude of the echo of muscle follows, f0 being `probe.frequency_MHz`: 0 for the same
    echo at all frequencies, 1.5 for thin long fibres, 2 for Rayleigh scattering."""
    in_plane_only: bool = False
    """Scatterers lie in the imaging plane and move within it, as in the paper."""


class Rf(Section):
    """Transmits, scan lines and receive beamforming."""

    focus_mm: Positive = 6.5
    """Transmit focus, at which the heart lies. Default: from `probe.preset`."""
    depth_mm: Positive | None = None
    """Greatest range. Default: `bmode.field_of_view_mm`, which cuts a wide sector at the sides of the image, but with a
    `realism.preset` the range at which the arc of the sector just fits into the image."""
    focal_zones: Annotated[int, Field(ge=1, le=16)] = 5
    """Focused: focal zones, each with one transmit per line. Their foci are centred on `focus_mm`; between two foci, a
    line blends from the echoes of one to those of the other. With 1, there is one focus, and outside its depth of field
    speckle lags behind tissue that rotates. Default: from `probe.preset`."""
    focal_spacing_mm: Positive = 1.0
    """Focused: distance between the foci of neighbouring zones. Default: about half a depth of field, from
    `probe.preset`."""
    scan: Literal["sector", "linear"] = "sector"
    """`sector`: lines from the centre of the array at equal angles. `linear`: parallel lines perpendicular to the
    array. Default: `linear` for `mouse_linear_30MHz` and `mouse_row_column_15MHz`."""
    lines: Annotated[int, Field(ge=16, le=2048)] = 192
    """Scan lines. With the default there are five per beam width, and interpolation between them loses less than 1 % of
    the envelope."""
    sector_deg: Annotated[FiniteFloat, Field(gt=5, le=120)] = 64.0
    """Sector: opening angle. Default: from `probe.preset`."""
    width_mm: Positive | None = None
    """Linear: distance of the outermost lines. Default: the length of the array."""
    transmit: Literal["focused", "plane", "diverging", "synthetic_aperture"] = "focused"
    """`focused`: one focused beam per line. Otherwise plane waves, diverging waves or single elements, and each line is
    the coherent compound of all transmits."""
    transmits: Annotated[int, Field(ge=1, le=512)] = 11
    """Plane, diverging: number of waves; 5, 11 and 31 are usual."""
    angle_span_deg: Annotated[FiniteFloat, Field(ge=0, le=120)] = 40.0
    """Plane, diverging: angle between the first and the last wave; a single wave is not steered."""
    virtual_source_mm: Positive | None = None
    """Diverging: distance of the virtual sources behind the centre of the array. Default: that at which the array
    subtends the angle of the sector."""
    apodization: Literal["hann", "none"] = "hann"
    """Apodization on receive and, if focused or synthetic aperture, on transmit."""
    transmit_apodization: Literal["hann", "none"] | None = None
    """Focused, synthetic aperture: apodization on transmit. Default: `apodization`, and `none` with `realism.preset:
    human`, as side lobes of a harmonic are low."""
    harmonic: bool = False
    """Harmonic imaging: echoes are those of the second harmonic of a wave, which is sent at half of
    `probe.frequency_MHz`. A focused beam is the square of that wave's, narrower and with lower side lobes, and echoes
    grow in proportion to range up to `focus_mm`. Default: true with `realism.preset: human`; where `cases` change it,
    the frequency stays, so give that too."""
    f_number: Annotated[FiniteFloat, Field(ge=0, le=20)] = 0.0
    """Smallest F-number, on receive and focused transmit; 0 uses the whole array at every range. Default: 2 for
    `mouse_linear_30MHz`, 1 for `mouse_row_column_15MHz`."""
    elevation_beam: bool = True
    """Include the lens's elevation beam; with `false`, elements are points in elevation, which send and hear as well to
    all sides of the imaging plane. The error of the RF against the exact sum (relative, L2) is 1.5 % beyond one
    aperture, or beyond two with the tall lens of a human's array, and some per cent nearer or, with attenuation, far
    from the plane; without the lens it is 2e-5 within 32 degrees (24 degrees for `mouse_30MHz` and `mouse_40MHz`)."""
    keep: list[Literal["channels"]] = Field(default=[])
    """RF to keep beside the demodulated lines: `channels`, the echoes in every element of each element transmitting
    alone (full matrix), from which any transmit can be synthesised."""

    @property
    def focal_half_span_mm(self) -> float:
        """Distance of the nearest and of the farthest transmit focus from `focus_mm`, mm."""
        return (self.focal_zones - 1) / 2 * self.focal_spacing_mm if self.transmit == "focused" else 0.0

    @check
    def _check_harmonic(self) -> None:
        remedy = "must be false, as only a focused beam has a harmonic that is known"
        self.require(not self.harmonic or self.transmit == "focused", "harmonic", remedy)

    @check
    def _check_foci(self) -> None:
        foci = f"its focal_zones = {self.focal_zones} foci, focal_spacing_mm = {self.focal_spacing_mm:g} apart"
        remedy = f"must exceed {self.focal_half_span_mm:g}, so that {foci}, lie in front of the array"
        self.require(self.focus_mm > self.focal_half_span_mm, "focus_mm", remedy)


Divisor = Annotated[int, Field(ge=1, le=64)]
Gain = Annotated[FiniteFloat, Field(ge=-60, le=60)]
Length = Annotated[FiniteFloat, Field(ge=0, le=1000)]
FilterWidth = Annotated[FiniteFloat, Field(ge=0.5, le=64)]


class TimeGain(Section):
    """Curve of gain over range, as the sliders of a scanner set it, on top of `bmode.tgc_dB_per_cm_MHz`."""

    range_mm: Annotated[list[Length], Field(max_length=64)] = Field(default=[])
    """Ranges from the array, increasing; the gain is linear between them and constant before the first and after the
    last."""
    gain_dB: Annotated[list[Gain], Field(max_length=64)] = Field(default=[])
    """Gain at each of the ranges."""

    @check
    def _check_points(self) -> None:
        remedy = f"must have one gain for each of the {len(self.range_mm)} ranges in range_mm"
        self.require(len(self.gain_dB) == len(self.range_mm), "gain_dB", remedy)
        rises = all(each < following for each, following in pairwise(self.range_mm))
        self.require(rises, "range_mm", "every range must be larger than the one before it")


class Dropout(Section):
    """Loss of echoes that comes and goes, as of poor contact or lung beside the window of the probe."""

    loss_dB: Annotated[FiniteFloat, Field(ge=0, le=60)] = 0.0
    """Size of the loss: it is this times the positive part of a smooth random function of unit variance over lines,
    range and time, which returns with the cycle; half of the echoes lose nothing. 0 for no loss."""
    edge_loss_dB: Annotated[FiniteFloat, Field(ge=0, le=60)] = 0.0
    """Further loss of the outermost lines at the greatest range, where beams are steered most; towards the middle and
    towards the array it falls to 0 as the squares of the distances from them."""
    width: Annotated[FiniteFloat, Field(ge=0.02, le=1)] = 0.1
    """Distance over which the first loss changes, as a fraction of the scan and of the depth: standard deviation of its
    Gaussian correlation."""


VoxelCount = Annotated[int, Field(ge=8, le=1024)]
VoxelSide = Annotated[FiniteFloat, Field(gt=0, le=1000)]


class Volume(Section):
    """Voxels of views whose plane is `volume`: a box whose middle is at `rf.focus_mm` below the middle of the array."""

    size: Annotated[tuple[VoxelCount, VoxelCount, VoxelCount], BeforeValidator(as_tuple)] = (144, 128, 96)
    """Voxels in the axial direction, in elevation and in the lateral direction."""
    field_mm: Annotated[tuple[VoxelSide, VoxelSide, VoxelSide], BeforeValidator(as_tuple)] = (6.3, 8.4, 6.3)
    """Sides of the box in the same order. Default: the heart of a mouse, which is longest in elevation."""

    @property
    def voxel_mm(self) -> tuple[float, ...]:
        """Sides of a voxel, in the order of `size`, mm."""
        return tuple(side / count for side, count in zip(self.field_mm, self.size, strict=True))


class Bmode(Section):
    """Conversion of RF to 8-bit images: gain, log compression, and what a scanner does to images after it."""

    field_of_view_mm: Annotated[FiniteFloat, Field(gt=0, le=1000)] = 12.0
    """Side of the square image; the array is in the middle of its upper edge. Default: from `probe.preset`."""
    size_px: Annotated[int, Field(ge=32, le=4096)] = 512
    """Pixels along a side of the full image."""
    downsampling: Annotated[tuple[Divisor, ...], Field(min_length=1), BeforeValidator(as_tuple)] = (1, 2, 4)
    """Image sizes, as divisors of the full size."""
    dynamic_range_dB: Annotated[FiniteFloat, Field(gt=10, le=120)] = 55.0
    """Range of the log compression below the brightest echo of the clip."""
    tgc_dB_per_cm_MHz: Annotated[FiniteFloat, Field(ge=0, le=3)] | None = None
    """Time gain compensation: attenuation on each way that the gain compensates, at the centre frequency. Default:
    `probe.attenuation_dB_per_cm_MHz`."""
    time_gain: TimeGain = TimeGain()
    """Curve of gain over range, as the sliders of a scanner set it, on top of `bmode.tgc_dB_per_cm_MHz`."""
    dropout: Dropout = Dropout()
    """Loss of echoes that comes and goes, as of poor contact or lung beside the window of the probe."""
    gain_dB: Gain = 0.0
    """Gain of the compressed images: at 0 the brightest echo of the clip is just white. Above, all echoes down to this
    far below it are white; below, as much is lost at the dark end."""
    persistence: Annotated[FiniteFloat, Field(ge=0, le=0.95)] = 0.0
    """Weight of the image before in every image shown, the rest being the new one; 0 for none. The clip is taken as one
    cycle that repeats, unless drift or breathing keep it from closing. Speckle and borders lag behind the tissue by
    persistence / (1 - persistence) frames."""
    smoothing: Fraction = 0.0
    """Share of a Gaussian mean of the compressed image in the image shown, the rest being the image itself, as scanners
    smooth to reduce speckle; 0 for none, 1 for the mean alone."""
    smoothing_width_px: FilterWidth = 2.0
    """Standard deviation of the Gaussian of `smoothing`, px of the largest image."""
    edge_enhancement: Annotated[FiniteFloat, Field(ge=0, le=5)] = 0.0
    """Unsharp mask, after `smoothing`: the difference of the image from its Gaussian mean, times this, is added to it;
    0 for none."""
    edge_width_px: FilterWidth = 2.0
    """Standard deviation of the Gaussian of `edge_enhancement`, px of the largest image."""
    grey_map: Literal["linear", "s_curve"] = "linear"
    """Grey level u of the compressed images, from 0 to 1, as shown. `linear`: u. `s_curve`: 3 u^2 - 2 u^3, steep at
    middle levels and flat at both ends."""
    grey_gamma: Annotated[FiniteFloat, Field(ge=0.2, le=5)] = 1.0
    """Power to which the grey level is raised after `grey_map`; above 1 middle levels become darker."""

    @property
    def sizes(self) -> tuple[int, ...]:
        """Pixels along a side of every image size, largest first."""
        return tuple(self.size_px // divisor for divisor in sorted(self.downsampling))

    @check
    def _check_sizes(self) -> None:
        remedy = f"every entry must divide size_px = {self.size_px} and leave 16 px or more"
        divides = all(self.size_px % each == 0 and self.size_px // each >= 16 for each in self.downsampling)
        self.require(divides, "downsampling", remedy)
        self.require(len(set(self.sizes)) == len(self.sizes), "downsampling", "entries must differ")

    @check
    def _check_gain(self) -> None:
        remedy = f"must lie within dynamic_range_dB = {self.dynamic_range_dB:g}, or the image is all black or all white"
        self.require(abs(self.gain_dB) < self.dynamic_range_dB, "gain_dB", remedy)


VIEWS = {name: {view: View(**keys) for view, keys in views.items()} for name, views in PRESETS["views"].items()}
"""Views of each `views.preset`."""


def named_views(value: Any) -> Any:
    """Views of a section `views`, in which those of its `preset`, if it has one, are named."""
    if not isinstance(value, dict) or "preset" not in value:
        return value
    preset = value["preset"]
    if not isinstance(preset, str) or preset not in VIEWS:
        raise invalid("preset", preset, f"must be one of {', '.join(VIEWS)}")
    return VIEWS[preset] | {name: view for name, view in value.items() if name != "preset"}


def _with_preset(schema: dict[str, Any]) -> None:
    """Let editors know the key `preset`, which is no view."""
    planes = schema.pop("patternProperties")
    schema["patternProperties"] = {f"^(?!preset$){name.lstrip('^')}": plane for name, plane in planes.items()}
    schema["properties"] = {"preset": {"enum": list(VIEWS)}}


Views = Annotated[
    dict[Name, View],
    Field(min_length=1, max_length=64, json_schema_extra=_with_preset),
    BeforeValidator(named_views),
]
"""Imaging planes by name, or a preset of them."""
