"""Section `inference`: the muscle that is inferred from what a tracker saw."""

from typing import Annotated

from pydantic import Field, FiniteFloat

from echotruth.section import Name, Section, check

MeanAndDeviation = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class Inference(Section):
    """Contractility of segments, and what else motion depends on, inferred from what a tracker saw (docs/inference.md).
    Nothing is inferred unless a tracker is named."""

    tracker: Name | None = None
    """One of `tracking.trackers`; its error must be known."""
    size_px: Annotated[int, Field(ge=1)] | None = None
    """Side of the images in which it tracked. Default: the largest."""
    errors: str | None = None
    """Table of the errors of trackers, .csv, that `benchmarks/tracker_errors.py` makes. Default: the package's."""
    prior: dict[str, MeanAndDeviation | None] = Field(default_factory=dict)
    """What is known of parameters before anything is seen, by their keys: mean and standard deviation, as
    `fibres.endo_deg: [75, 3]`, or `null` for what is known as the model has it. `mechanics.regional.contractility` and
    `mechanics.regional.stiffness` stand for all segments. Default: docs/inference.md."""

    @check
    def _has_tracker(self) -> None:
        for key in ("size_px", "errors", "prior"):
            is_used = self.tracker is not None or getattr(self, key) in (None, {})
            self.require(is_used, key, "needs inference.tracker: name it, or leave this out")
