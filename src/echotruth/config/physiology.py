"""Section `physiology`: bounds on the behaviour of a solved heart."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Fraction, Section, invalid


class Physiology(Section):
    """Bounds on a solved heart; a heart outside is kept and marked with the reason. `null` switches a bound off."""

    exclude_implausible: bool = True
    """Do not image and track a heart outside the bounds; `false` images and tracks it. In both cases it is marked
    `implausible`, and figures and scores include it only if no heart is within the bounds."""
    longitudinal_strain_max: FiniteFloat | None = 0.0
    """Largest wall-mean longitudinal strain at end-systole. Hearts shorten: -0.18 in mice (Zhong 2011, doi
    10.1186/1532-429X-13-83); with the wrong fibres, an incompressible wall may lengthen instead."""
    twist_max_deg: Annotated[FiniteFloat, Field(gt=0)] | None = 40.0
    """Largest rotation of the apex relative to the base in any frame, in either direction. Three times the 13 deg of
    healthy hearts (Young & Cowan 2012, doi 10.1186/1532-429X-14-49); with the wrong fibres it is 60 to 90 deg."""
    volume_ratio_min: Fraction | None = 0.2
    """Smallest det F at any point in any frame. Lower values mean that elements nearly collapse, whereas myocardium
    hardly changes its volume; the default heart has 0.45 at the apex."""
    loop_error_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.005
    """Largest relative difference between prescribed and solved pressure or volume in any frame."""
    tension_min_kPa: FiniteFloat | None = -1.0
    """Smallest active tension in any frame. Muscle does not push, but solving for a loop may give slightly negative
    values."""
    tension_es_min_kPa: FiniteFloat | None = 20.0
    """Smallest active tension at end-systole; the default heart ejects between 20 and 90 kPa (43 kPa for its loop)."""
    tension_es_max_kPa: FiniteFloat | None = 90.0
    """Largest active tension at end-systole."""
    ejection_fraction_min: Fraction | None = 0.2
    """Smallest ejection fraction; healthy mice and rats have 0.42 to 0.89 (Pacher 2008, doi 10.1038/nprot.2008.138,
    table 1), failing hearts less."""
    ejection_fraction_max: Fraction | None = 0.9
    """Largest ejection fraction."""

    @model_validator(mode="after")
    def _check_order(self) -> Physiology:
        for lower_key, upper_key in (
            ("tension_es_min_kPa", "tension_es_max_kPa"),
            ("ejection_fraction_min", "ejection_fraction_max"),
        ):
            lower, upper = getattr(self, lower_key), getattr(self, upper_key)
            if lower is not None and upper is not None and lower >= upper:
                raise invalid(lower_key, lower, f"must be smaller than {upper_key} = {upper:g}")
        return self
