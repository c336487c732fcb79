"""Section of the configuration: the pressure-volume loop, or the other cycle, that drives the heart."""

from itertools import accumulate, pairwise
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, FiniteFloat

from echotruth.section import Positive, Section, as_tuple, check

Volume = Annotated[FiniteFloat, Field(gt=0, le=1e8)]
Pressure = Annotated[FiniteFloat, Field(gt=0, le=1e4)]
Prescribed = Literal["pressure_volume", "pressure", "volume"]


Factor = Annotated[FiniteFloat, Field(ge=0.05, le=20)]


class Circulation(Section):
    """The circulation of `kind: circulation`: a closed ring of left ventricle, systemic arteries and veins, right
    heart, lung and left atrium (docs/physiology.md). It is such that the healthy heart gives its measured loop back;
    the factors change it and the muscle, as drugs and diseases do."""

    contractility: Factor = 1.0
    """Factor on the active tension of the whole wall."""
    resistance: Factor = 1.0
    """Factor on the peripheral resistance of the arteries: afterload."""
    compliance: Factor = 1.0
    """Factor on the compliance of the arteries."""
    retained_volume_stroke_volumes: Annotated[FiniteFloat, Field(ge=-20, le=50)] = 0.0
    """Blood that the circulation has gained (or, if negative, lost) since the heart was healthy, in stroke volumes of
    the healthy heart: what the kidneys retain, and what narrow veins give to the rest. Otherwise the volume of the
    healthy circulation is kept. A stroke volume is some 1.4 to 2 % of all blood."""
    baroreflex: bool = True
    """Peripheral resistance and venous tone answer the mean arterial pressure, as in Zenker et al., PLoS Comput Biol 3
    (2007) e204. `false` for pressures to which the reflex has adapted."""
    decay_time_periods: Positive = 2.0
    """Time in which the pressure of the healthy arteries decays, resistance times compliance, in periods of the heart
    beat. The ratio is the same in all mammals (Westerhof & Elzinga, Am J Physiol 261 (1991) R126); 2 is somewhat below
    the 2.3 of people's mean pressure over their pulse pressure (93 and 40 mmHg), because stroke volume over pulse
    pressure overestimates the compliance."""
    characteristic_share: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.06
    """Characteristic resistance of the healthy aorta over the peripheral one; the same in all mammals (likewise)."""
    mitral_gradient_mmHg: Annotated[FiniteFloat, Field(gt=0, le=50)] = 2.5
    """Pressure that drives the fastest filling of the healthy heart: that of blood at 0.8 m/s, 4 v^2."""
    beats_max: Annotated[int, Field(ge=1, le=100)] = 20
    """Beats after which a heart that is not yet steady is given up."""


class Beat(Section):
    """One beat of a clip: the cycle of the file, longer or shorter and with another stroke."""

    length: Factor = 1.0
    """Its period over that of the file or of `heart_rate_per_min`; the clip has it in whole frames."""
    stroke: Factor = 1.0
    """Its stroke volume over that of the cycle, from the same end-diastole and with the same pressures."""


class Loop(Section):
    """The cycle that drives the heart: what is prescribed over time."""

    kind: Literal["measured", "circulation"] = "measured"
    """`measured`: the heart goes through the curves of the file, whatever its disease. `circulation`: the tension that
    takes the healthy heart - without `pathology`, `hypertrophy`, `dilation` and disarray - through them drives this
    heart against `circulation`, beat after beat until it is steady, and pressure and volume follow."""
    circulation: Circulation = Circulation()
    """The circulation of `kind: circulation`."""
    prescribed: Prescribed = "pressure_volume"
    """What is prescribed: `pressure_volume` (the active tension is solved); `volume` with active tension, zero if
    the file has none (the pressure is solved); or `pressure` with active tension (the volume is solved, and is not
    unique during ejection)."""
    file: str = "mouse"
    """A shipped cycle (`mouse`, `rat`, `human`; `twitch` for `prescribed: volume`), or the path from the working folder
    of a CSV file with columns of time and of the prescribed quantities, each named with its unit: time_ms or _s;
    pressure_mmHg, _kPa or _Pa; volume_uL, _mL or _m3; tension_kPa or _Pa. `LVP [mmHg]` and the like are read too,
    semicolons, tabs, decimal commas, and what LabChart exports as text."""
    heart_rate_per_min: Annotated[FiniteFloat, Field(ge=1, le=10_000)] | None = None
    """Heart rate; the cycle's time is scaled to it. Default: that of the file."""
    edv_uL: Volume | None = None
    """End-diastolic volume; the cycle's volumes are mapped linearly to it. Default: that of the file; a shipped cycle,
    which is that of the default ellipsoid of its species, has it in proportion to the unloaded cavity of this one. In
    a circulation it is that of the heart before its `dilation`."""
    esv_uL: Volume | None = None
    """End-systolic volume, likewise: where one of the two is given, the other keeps to the heart's size."""
    edp_mmHg: Pressure | None = None
    """End-diastolic pressure; pressures up to it are scaled, those above mapped linearly. Default: that of the file."""
    esp_mmHg: Pressure | None = None
    """End-systolic pressure, likewise."""
    right_pressure_ratio: Annotated[FiniteFloat, Field(ge=0, le=2)] = 0.2
    """Pressure in the right ventricle over that in the left at every instant, where the mesh has one
    (`geometry.surface_labels.right_endo`). In people at rest the systolic pressures are 21 +- 4 (Kovacs et al., Eur
    Respir J 34 (2009) 888; recalled) to 25 and some 120 mmHg."""
    frames: Annotated[int, Field(ge=2, le=1000)] = 40
    """Frames of the clip, of all its beats; frame 0 is end-diastole."""
    beats: Annotated[tuple[Beat, ...], BeforeValidator(as_tuple)] = (Beat(),)
    """Beats of the clip, one after the other, 16 at most, as `[{}, {length: 0.8, stroke: 0.7}]`. The heart is solved
    through all of them, and the clip closes. End-systole and the measures of the heart are those of the first beat;
    drift, breathing and rocking of a view go by the mean beat."""

    @property
    def beat_starts(self) -> list[int]:
        """First frame of each beat, and then the number of frames."""
        ends = list(accumulate(beat.length for beat in self.beats))
        return [0, *(round(self.frames * end / ends[-1]) for end in ends)]

    @check
    def _ejects(self) -> None:
        ejects = self.edv_uL is None or self.esv_uL is None or self.esv_uL < self.edv_uL
        self.require(ejects, "esv_uL", f"must be smaller than edv_uL = {self.edv_uL}")
        rises = self.edp_mmHg is None or self.esp_mmHg is None or self.esp_mmHg > self.edp_mmHg
        self.require(rises, "esp_mmHg", f"must be greater than edp_mmHg = {self.edp_mmHg}")

    @check
    def _has_beats(self) -> None:
        self.require(1 <= len(self.beats) <= 16, "beats", "must have 1 to 16 beats")
        for key, needed in {"kind": "measured", "prescribed": "pressure_volume"}.items():
            remedy = f"must be {needed} with loop.beats, because other hearts repeat one beat"
            self.require(self.beats == (Beat(),) or getattr(self, key) == needed, key, remedy)
        fewest = min(end - start for start, end in pairwise(self.beat_starts))
        remedy = f"leaves {fewest} to one of the loop.beats, which need two each: give more frames, or fewer beats"
        self.require(fewest > 1, "frames", remedy)

    @check
    def _circulates(self) -> None:
        if self.kind == "circulation":
            remedy = "must be pressure_volume with loop.kind = circulation, which is calibrated on both"
            self.require(self.prescribed == "pressure_volume", "prescribed", remedy)
            return
        remedy = "needs loop.kind = circulation, because a measured loop is followed whatever the circulation"
        for key in self.circulation.model_dump(exclude_defaults=True):
            self.require(False, f"circulation.{key}", remedy)

    @check
    def _maps_what_it_prescribes(self) -> None:
        for key in ("edv_uL", "esv_uL", "edp_mmHg", "esp_mmHg"):
            given, missing = ("pressure", "volume") if key.endswith("uL") else ("volume", "pressure")
            remedy = f"must be left out, because loop.prescribed = {given} gives no {missing}"
            self.require(self.prescribed != given or getattr(self, key) is None, key, remedy)
