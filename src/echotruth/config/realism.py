"""Section `realism`: blood, surroundings, noise and artefacts of real clips; all are off by default."""

from math import sqrt
from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat, model_validator

from echotruth.config.imaging import ScatteringExponent
from echotruth.config.merging import difference, merged
from echotruth.config.presets import PRESETS
from echotruth.section import Positive, Section

Level = Annotated[FiniteFloat, Field(ge=-80, le=20)]
BorderLevel = Annotated[FiniteFloat, Field(ge=-80, le=60)]
Time = Annotated[FiniteFloat, Field(ge=0.5, le=1e5)]
Length = Annotated[FiniteFloat, Field(ge=0)]


class Tissue(Section):
    """Scatterers other than those of muscle."""

    level_dB: Level | None = None
    """Mean echo power relative to muscle, at the centre frequency; null for no scatterers."""
    density: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.4
    """Density of scatterers relative to muscle; it does not change the echo power."""
    scattering_exponent: ScatteringExponent = 0.0
    """Power of f / f0 that the amplitude of the echo follows, as `phantom.scattering_exponent`; that of blood is 2."""

    @property
    def amplitude_std(self) -> float:
        """Standard deviation of the amplitudes relative to muscle; echo power is their variance times the density."""
        return 0.0 if self.level_dB is None else 10 ** (self.level_dB / 20) / sqrt(self.density)


class Decorrelation(Section):
    """Decorrelation of the speckle of muscle and surroundings that is not due to their motion."""

    time_ms: Time | None = None
    """Time in which the correlation of the RF of tissue at rest falls to 1/e; null for no decorrelation. Times are
    those of a mouse; in a human heart they are about seven times as long."""


class Blood(Tissue):
    """Scatterers in the cavity, up to the plane of the base."""

    decorrelation_time_ms: Time = 10.0
    """Time in which the correlation of the RF falls to 1/e because of random flow, which adds to the motion of the
    wall."""


class Surroundings(Tissue):
    """Tissue around the heart. `density` is that at `rf.focus_mm` in the imaging plane; elsewhere there are as many
    scatterers in a resolution cell as there."""

    start_mm: Positive = 2.0
    """Range from the array at which the tissue begins."""
    motion_decay_mm: Length = 1.0
    """Distance from the epicardium over which its motion falls to 1/e of that of the epicardium; 0 for no motion, which
    leaves no room for `neighbours.chambers_dB`."""


class Neighbours(Section):
    """What lies around the wall of the left ventricle and in its cavity, in proportion to it. No part of the truth.
    Levels are mean echo powers relative to muscle; null leaves a neighbour out."""

    chambers_dB: Level | None = None
    """Walls of the right ventricle, of both atria and of the aortic root, in which there is `blood`."""
    lung_dB: Level | None = None
    """Lung behind the free wall, at the epicardium, from which on it fades."""
    posterior_dB: Level | None = None
    """What lies behind the atria, at their roof, from which on it fades: pericardium, oesophagus, spine."""
    chest_wall_dB: Level | None = None
    """Brightest layers of the chest wall, between `surroundings.start_mm` and the heart."""
    leaflets_dB: BorderLevel | None = None
    """Mitral and tricuspid leaflets, open while the cavity fills, and cusps of the aortic valve, open while it empties:
    echo power of one that lies across the beam at the focus; as borders, they are fainter where they are oblique."""
    papillary_muscles_dB: Level | None = None
    """Two papillary muscles, which move and shorten with the endocardium; 0 for the echo of muscle."""

    @property
    def any(self) -> bool:
        """Whether there is any."""
        return any(level is not None for level in self.model_dump().values())

    @property
    def around(self) -> dict[str, float | None]:
        """Levels, dB, of those that are tissues of the surroundings, by key."""
        return {key: getattr(self, key) for key in ("chambers_dB", "lung_dB", "posterior_dB", "chest_wall_dB")}


class Noise(Section):
    """Noise of the receiver."""

    snr_dB: Annotated[FiniteFloat, Field(ge=-20, le=120)] | None = None
    """RMS of the echo of muscle at end-diastole over that of the noise, in the focused lines before gain; null for no
    noise."""


class Haze(Section):
    """Reverberation: near echoes are repeated later and out of focus."""

    level_dB: Level | None = None
    """Total power of the repeated echoes relative to the first; null for no reverberation."""
    max_source_range_mm: Positive = 4.0
    """Largest range of echoes that are repeated."""
    mean_extra_range_mm: Positive = 2.0
    """Mean additional range of the repeated echoes, which is exponentially distributed."""


class RingDown(Section):
    """Sound that goes to and fro in the lens of the probe: bands near the array, the same in all frames."""

    level_dB: Level | None = None
    """Its brightest echo over the RMS of the echo of muscle at end-diastole, in the focused lines before gain; null for
    none."""


class Aberration(Section):
    """Aberration: tissue near the array delays what each element sends and receives. It is the same in all frames of a
    view; the beam is wider and has higher side lobes."""

    delay_ns: Annotated[FiniteFloat, Field(ge=0, le=1000)] = 0.0
    """Root mean square of the delay on each way; 0 for no aberration. The human chest wall has 21 ns (Hinkelman, Szabo
    & Waag 1997)."""
    correlation_length_mm: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 2.5
    """Full width at half maximum of the Gaussian correlation of the delay along the array; 2.5 mm there."""


class Shadow(Section):
    """Acoustic shadow of a rib, which blocks part of the array."""

    side: Literal["none", "left", "right"] = "none"
    """Side of the image that is in the shadow; none for no rib."""
    depth_mm: Positive = 1.5
    """Depth of the rib."""
    edge_deg: Annotated[FiniteFloat, Field(gt=-60, lt=60)] = 10.0
    """Direction of the rib's edge seen from the middle of the array: angle from the axial axis towards `side`."""
    edge_width_mm: Length = 0.5
    """Length of the array over which elements change from open to blocked; 0 for a sharp edge."""
    level_dB: Annotated[FiniteFloat, Field(ge=-120, le=0)] = -40.0
    """One-way transmission of the rib."""


class Backscatter(Section):
    """Echo of muscle that depends on its fibres; its mean over all directions at end-diastole stays what it was."""

    anisotropy_dB: Annotated[FiniteFloat, Field(ge=0, le=40)] = 0.0
    """Echo power across the fibres over that along them; 14.5 dB in fixed myocardium, less in fresh one."""
    fibre_strain_dB: Annotated[FiniteFloat, Field(ge=0, le=200)] = 0.0
    """Change of the echo power per unit of strain along the fibres since end-diastole: with 30, muscle that has
    shortened by 15 % echoes 4.5 dB less, as the muscle of mice does at end-systole (Kovacs 2003)."""
    variation_dB: Annotated[FiniteFloat, Field(ge=0, le=20)] = 0.0
    """Standard deviation of a random change of the echo power of muscle and borders from place to place, which moves
    with them; 0 for none."""
    variation_length_mm: Positive = 1.0
    """Distance over which that changes: standard deviation of its Gaussian correlation."""


class Borders(Section):
    """Specular echoes of the surfaces of the wall, bright where they face the probe."""

    endocardium_dB: BorderLevel | None = None
    """Echo power of the endocardium where it lies across the beam at the focus, relative to muscle; null for none."""
    epicardium_dB: BorderLevel | None = None
    """That of epicardium and pericardium."""


REALISM_PRESETS: dict[str, dict[str, Any]] = PRESETS["realism"]
"""Values of keys of each `realism.preset`."""


class Realism(Section):
    """Properties of real images that the paper's phantom does not have; all are off by default."""

    preset: Literal["none", "mouse", "human"] = "none"
    """Levels, lengths and times of the keys below that are not given: as in clips of such hearts, or all off. With
    `mouse` and `human` the defaults of `probe.bandwidth`, `probe.attenuation_dB_per_cm_MHz`, `phantom.density_per_mm3`
    and of gain, edges, smoothing and grey map in `bmode` change too, and with `human` those of `probe.frequency_MHz`,
    `rf.harmonic`, `rf.transmit_apodization`, `rf.focus_mm`, `rf.sector_deg` and `bmode.field_of_view_mm`,
    but not where `cases` change this key from heart to heart."""
    backscatter: Backscatter = Backscatter()
    """Echo of muscle that depends on its fibres; its mean over all directions at end-diastole stays what it was."""
    borders: Borders = Borders()
    """Specular echoes of the surfaces of the wall, bright where they face the probe."""
    decorrelation: Decorrelation = Decorrelation()
    """Decorrelation of the speckle of muscle and surroundings that is not due to their motion."""
    blood: Blood = Blood()
    """Scatterers in the cavity, up to the plane of the base."""
    surroundings: Surroundings = Surroundings()
    """Tissue around the heart."""
    neighbours: Neighbours = Neighbours()
    """What lies around the wall of the left ventricle and in its cavity, in proportion to it."""
    noise: Noise = Noise()
    """Noise of the receiver."""
    haze: Haze = Haze()
    """Reverberation: near echoes are repeated later and out of focus."""
    ring_down: RingDown = RingDown()
    """Sound that goes to and fro in the lens of the probe."""
    aberration: Aberration = Aberration()
    """Aberration by tissue near the array."""
    shadow: Shadow = Shadow()
    """Acoustic shadow of a rib, which blocks part of the array."""

    def given(self) -> dict[str, Any]:
        """Keys and values, without those that they have by `preset`, so that another one can replace it."""
        values, by_preset = self.model_dump(), type(self)(preset=self.preset).model_dump()
        sections: dict[str, Any] = {name: {} for name, value in values.items() if isinstance(value, dict)}
        return {"preset": self.preset} | sections | difference(values, by_preset)

    @model_validator(mode="before")
    @classmethod
    def _fill_from_preset(cls, values: Any) -> Any:
        preset = values.get("preset") if isinstance(values, dict) else None
        return merged(REALISM_PRESETS.get(preset, {}), values) if isinstance(preset, str) else values
