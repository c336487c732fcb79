"""Section `pathology`: infarct and late activation."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.config.regional import Segment, SegmentKey
from echotruth.section import Fraction, Positive, Section, check

Delay = Annotated[FiniteFloat, Field(ge=0, le=1000)]


class Infarct(Section):
    """Stiff tissue that does not contract: whole AHA segments, or a sphere. There is none if neither is given."""

    segments: Annotated[list[Segment], Field(min_length=1)] | None = None
    """AHA segments."""
    radius_mm: Positive | None = None
    """Radius of a sphere centred in the middle of the wall at `position` and `azimuth_deg`."""
    position: Fraction = 0.5
    """Sphere only: position of its centre along the long axis, 0 at the base, 1 at the endocardial apex."""
    azimuth_deg: Annotated[FiniteFloat, Field(ge=-180, le=180)] = 90.0
    """Sphere only: azimuth of its centre; septal 0, anterior 90, lateral 180, inferior -90."""
    transmurality: Annotated[FiniteFloat, Field(gt=0, le=1)] = 1.0
    """Wall depth to which the tissue is infarcted, from the endocardium."""
    tension_scale: Fraction = 0.0
    """Active tension relative to healthy tissue; infarcts of sheep had none (Wenk 2011)."""
    stiffness_scale: Annotated[FiniteFloat, Field(ge=0.1, le=100)] = 20.0
    """Stiffness relative to healthy tissue. With the default, an infarct of a third of the wall stretches by a few
    percent when the heart ejects; in mice it shortens by 0.7 +- 4.4 % (Epstein 2002, Magn Reson Med 48, 399)."""
    border_mm: Annotated[FiniteFloat, Field(ge=0)] = 0.0
    """Width of the border zone, in which both factors return linearly to 1 (Lee 2011)."""

    @check
    def _check_region(self) -> None:
        is_one = self.segments is None or self.radius_mm is None
        self.require(is_one, "radius_mm", "give either segments or radius_mm and set the other to null")


class LateActivation(Section):
    """Delay of the active tension by AHA segment."""

    preset: Literal["lbbb"] | None = None
    """`lbbb`: left bundle branch block of a mouse; the lateral wall is 8 ms late, anterior and inferior wall 4 ms. Let
    it beat with `loop.kind: circulation`: to follow a healthy heart's loop the tension of what is early may have to
    oscillate from frame to frame, which marks the heart as implausible (`physiology.tension_variation_max`)."""
    delay_ms: dict[SegmentKey, Delay] = Field(default_factory=dict)
    """Delay of the middle of each AHA segment, instead of a preset; other segments have none, and between the middles
    of the segments of a level it changes linearly."""
    scale: Annotated[FiniteFloat, Field(ge=0, le=100)] = 1.0
    """Factor on all delays; about 9 for the preset in a human heart."""

    @check
    def _check_delays(self) -> None:
        is_one = self.preset is None or not self.delay_ms
        self.require(is_one, "delay_ms", "give either preset or delay_ms and leave the other out")


class Pathology(Section):
    """Disease; hypertrophy and dilation are keys of `geometry`, disarray of `fibres`, load and strength of
    `loop.circulation`."""

    preset: Literal["hypertension", "dcm"] | None = None
    """Growth and load of a disease, which let the heart beat in a circulation (docs/physiology.md); keys that are given
    take precedence. `hypertension`: concentric growth - a wall thicker by a fifth, narrow and stiff arteries, and
    contractility kept. `dcm`: dilated cardiomyopathy, eccentric growth - a wider cavity, weak muscle and retained
    fluid."""
    infarct: Infarct = Infarct()
    """Stiff tissue that does not contract: whole AHA segments, or a sphere. There is none if neither is given."""
    late_activation: LateActivation = LateActivation()
    """Delay of the active tension by AHA segment."""
