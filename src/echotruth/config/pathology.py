"""What ails the heart."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, model_validator

from echotruth.section import Positive, Section, impossible


def _number(key: Any) -> Any:
    """JSON knows no keys but texts."""
    return int(key) if isinstance(key, str) and key.isdecimal() else key


Segment = Annotated[int, Field(ge=1, le=17)]
Share = Annotated[FiniteFloat, Field(ge=0, le=1)]
Delay = Annotated[FiniteFloat, Field(ge=0, le=1000)]


class Infarct(Section):
    """Tissue that is stiff and does not contract: whole AHA segments, or a ball. None where neither is given."""

    segments: Annotated[list[Segment], Field(min_length=1)] | None = None
    """AHA segments."""
    radius_mm: Positive | None = None
    """Radius of a ball about the middle of the wall at `position` and `azimuth_deg`."""
    position: Share = 0.5
    """Ball only: place of its centre, 0 at the base, 1 at the endocardial apex."""
    azimuth_deg: Annotated[FiniteFloat, Field(ge=-180, le=180)] = 90.0
    """Ball only: azimuth of its centre; septal 0, anterior 90, lateral 180, inferior -90."""
    transmurality: Annotated[FiniteFloat, Field(gt=0, le=1)] = 1.0
    """Wall depth, from the endocardium, down to which the tissue is infarcted."""
    tension_scale: Share = 0.0
    """Active tension over that of healthy tissue; none was found in infarcts of sheep (Wenk 2011)."""
    stiffness_scale: Annotated[FiniteFloat, Field(ge=0.1, le=100)] = 10.0
    """Stiffness over that of healthy tissue: a scar is five to ten times as stiff."""
    border_mm: Annotated[FiniteFloat, Field(ge=0)] = 0.0
    """Width of the border zone, over which both factors return linearly to 1 (Lee 2011)."""

    @model_validator(mode="after")
    def _one_place(self) -> Infarct:
        if self.segments is not None and self.radius_mm is not None:
            raise impossible("radius_mm", self.radius_mm, "give either segments or radius_mm and set the other to null")
        if self.segments is not None and len(set(self.segments)) < len(self.segments):
            raise impossible("segments", self.segments, "list each segment once")
        return self


class LateActivation(Section):
    """Tissue that contracts late."""

    preset: Literal["lbbb"] | None = None
    """`lbbb`: left bundle branch block of a mouse, the lateral wall 8 ms and anterior and inferior wall 4 ms late."""
    delay_ms: dict[Annotated[Segment, BeforeValidator(_number)], Delay] = Field(default_factory=dict)
    """AHA segment to its delay, in place of a preset; segments not named are in time."""
    scale: Annotated[FiniteFloat, Field(ge=0, le=100)] = 1.0
    """Factor on all delays; for the preset in a human heart, about 9."""

    @model_validator(mode="after")
    def _one_pattern(self) -> LateActivation:
        if self.preset is not None and self.delay_ms:
            raise impossible("delay_ms", self.delay_ms, "give either preset or delay_ms and leave the other out")
        return self


class Pathology(Section):
    """Regional disease; hypertrophy and dilation are keys of `geometry`, disarray of `fibres`."""

    infarct: Infarct = Infarct()
    """An infarct."""
    late_activation: LateActivation = LateActivation()
    """Regions that are activated late."""
