"""The unloaded heart."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Positive, Section, impossible


class Geometry(Section):
    """Unloaded left ventricle: a truncated thick ellipsoid (fitted to Vinhas 2013)."""

    endo_radius_mm: Positive = 1.45
    """Short semi-axis of the endocardial ellipsoid."""
    endo_length_mm: Positive = 5.40
    """Long semi-axis of the endocardial ellipsoid."""
    epi_radius_mm: Positive = 2.45
    """Short semi-axis of the epicardial ellipsoid."""
    epi_length_mm: Positive = 6.20
    """Long semi-axis of the epicardial ellipsoid."""
    base_mm: FiniteFloat = 1.40
    """Height of the base plane above the equator of the ellipsoids."""
    scale: Annotated[FiniteFloat, Field(gt=0.1, lt=100)] = 1.0
    """Factor on all lengths."""
    circumferential_elements: Annotated[int, Field(ge=6, le=120, multiple_of=6)] = 24
    """Elements around the wall."""
    longitudinal_elements: Annotated[int, Field(ge=4, le=120)] = 12
    """Elements from apex to base."""
    transmural_elements: Annotated[int, Field(ge=1, le=20)] = 3
    """Quadratic elements through the wall."""

    @model_validator(mode="after")
    def _epi_outside_endo(self) -> Geometry:
        for part in ("radius", "length"):
            endo, epi = f"endo_{part}_mm", f"epi_{part}_mm"
            if getattr(self, epi) <= getattr(self, endo):
                raise impossible(f"{epi}", getattr(self, epi), f"must be greater than {endo} = {getattr(self, endo)}")
        if abs(self.base_mm) >= self.endo_length_mm:
            raise impossible("base_mm", self.base_mm, f"must lie within +-endo_length_mm = {self.endo_length_mm}")
        return self
