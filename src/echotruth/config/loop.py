"""The loop that drives the heart."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Positive, Section, impossible


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
