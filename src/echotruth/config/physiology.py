"""What a heart must do to count as one."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Section, impossible

Share = Annotated[FiniteFloat, Field(ge=0, le=1)]


class Physiology(Section):
    """Bounds on a solved heart; one outside is kept and marked with the reason. A bound that is null is not used."""

    exclude: bool = True
    """Leave a heart outside the bounds without images and tracking; `false` images and tracks it as any other.
    Either way it is marked `implausible`; figures and scores take it in only where no heart is within the bounds."""
    longitudinal_strain_max: FiniteFloat | None = 0.0
    """Wall-mean longitudinal strain at end-systole. A heart shortens: -0.18 in mice (Zhong 2011, doi
    10.1186/1532-429X-13-83); a wall that keeps its volume may lengthen instead, with the wrong fibres."""
    twist_max_deg: Annotated[FiniteFloat, Field(gt=0)] | None = 40.0
    """Rotation of the apex against the base at any frame, either way. Three times the 13 deg of healthy hearts
    (Young & Cowan 2012, doi 10.1186/1532-429X-14-49); with the wrong fibres it is 60 to 90 deg."""
    volume_ratio_min: Share | None = 0.2
    """Smallest det F of any point at any frame: what is nearer to collapse says nothing about a wall, which hardly
    changes its volume; 0.45 at the apex of the default heart."""
    loop_error_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.005
    """Largest relative difference between what was prescribed and what was met, pressure or volume, at any frame."""
    tension_min_kPa: FiniteFloat | None = -1.0
    """Smallest active tension at any frame: muscle does not push; less than 0 is what solving to a loop may leave."""
    tension_es_min_kPa: FiniteFloat | None = 20.0
    """Smallest active tension at end-systole; between 20 and 90 kPa the default heart ejects (43 kPa to its loop)."""
    tension_es_max_kPa: FiniteFloat | None = 90.0
    """Largest active tension at end-systole, likewise."""
    ejection_fraction_min: Share | None = 0.2
    """Smallest ejection fraction: healthy mice and rats have 0.42 to 0.89 (Pacher 2008, doi 10.1038/nprot.2008.138,
    table 1), and failing ones less."""
    ejection_fraction_max: Share | None = 0.9
    """Largest ejection fraction, likewise."""

    @model_validator(mode="after")
    def _in_order(self) -> Physiology:
        for low, high in (
            ("tension_es_min_kPa", "tension_es_max_kPa"),
            ("ejection_fraction_min", "ejection_fraction_max"),
        ):
            least, most = getattr(self, low), getattr(self, high)
            if least is not None and most is not None and least >= most:
                raise impossible(low, least, f"must be smaller than {high} = {most:g}")
        return self
