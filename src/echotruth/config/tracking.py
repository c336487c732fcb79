"""Trackers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Name, Positive, Section, impossible


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


def standard_trackers() -> dict[str, Tracker]:
    """The paper's as printed, and as corrected."""
    return {"faithful": Tracker(), "corrected": Tracker(taper="hann", reference="previous")}


class Tracking(Section):
    """Trackers and the grid they report on."""

    grid_px: Annotated[int, Field(ge=1, le=128)] = 10
    """Spacing of the points at which displacement is reported."""
    trackers: Annotated[dict[Name, Tracker], Field(min_length=1)] = Field(default_factory=standard_trackers)
    """Name to settings: `faithful` is the paper as printed, `corrected` tapers and goes frame to frame."""
