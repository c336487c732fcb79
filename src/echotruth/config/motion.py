"""Section `motion`: the beat of the heart, or a motion prescribed by a formula."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Fraction, Section, invalid

Kind = Literal["beat", "rigid", "affine", "tube"]
TimeCourse = Literal["cosine", "triangle", "ramp"]
Translation = Annotated[FiniteFloat, Field(ge=-1e5, le=1e5)]
Rotation = Annotated[FiniteFloat, Field(ge=-180, le=180)]
Row = Annotated[list[Annotated[FiniteFloat, Field(ge=-5, le=5)]], Field(min_length=3, max_length=3)]

_IMAGINARY_TOLERANCE = 1e-6
"""Imaginary part below which an eigenvalue counts as real: rounding error of a double eigenvalue."""


class Rigid(Section):
    """Translation and rotation of the whole heart."""

    lateral_um: Translation = 23.4375
    """Translation along the lateral axis of short-axis images."""
    axial_um: Translation = 23.4375
    """Translation along the axial axis of short-axis images, away from the probe."""
    elevation_um: Translation = 0.0
    """Translation perpendicular to short-axis images, towards the base."""
    rotation_deg: Rotation = 0.0
    """Rotation about the long axis, counter-clockwise in short-axis images."""


class Affine(Section):
    """Uniform deformation gradient in the whole heart."""

    gradient: Annotated[list[Row], Field(min_length=3, max_length=3)] = Field(
        default=[[0.9, 0.05, 0.0], [0.0, 1.1, 0.0], [0.0, 0.0, 1.0]]
    )
    """Rows of the deformation gradient in the axes of short-axis images: lateral, axial, elevation."""
    position: Fraction = 0.5
    """Fixed point on the long axis: 0 at the base, 1 at the endocardial apex, as `position` of a view."""

    @model_validator(mode="after")
    def _check_eigenvalues(self) -> Affine:
        # F = I + a (A - I) becomes singular at some fraction a of the motion if A has a real eigenvalue <= 0.
        values = np.linalg.eigvals(self.gradient)
        smallest = min((value.real for value in values if abs(value.imag) < _IMAGINARY_TOLERANCE), default=1.0)
        if smallest <= 0:
            remedy = (
                f"has the eigenvalue {smallest:.3g} and would flatten the wall during the motion: all real eigenvalues "
                "must be positive (for a rotation by 180 degrees use rigid)"
            )
            raise invalid("gradient", self.gradient, remedy)
        return self


class TubeMotion(Section):
    """Contraction, shortening and torsion of a tube at constant wall volume."""

    contraction: Annotated[FiniteFloat, Field(ge=-1, lt=1)] = 0.35
    """Relative decrease of the inner radius; negative values inflate the tube."""
    shortening: Annotated[FiniteFloat, Field(ge=-1, lt=1)] = 0.1
    """Relative decrease of the length; negative values stretch the tube."""
    torsion_deg: Rotation = 15.0
    """Rotation of the lower (apical) end relative to the base, counter-clockwise seen from the apex."""
    endo_rotation_deg: Rotation = 6.0
    """Rotation of the inner surface relative to the outer one, counter-clockwise seen from the apex; linear in the
    radius."""


class Motion(Section):
    """Motion of the heart: the beat of the finite-element heart, or an exact formula."""

    kind: Kind = "beat"
    """`beat`: solved from loop, fibres and mechanics. `rigid`, `affine`, `tube`: prescribed by the section of that
    name, without pressures; only the period and the frames of `loop` apply, and the bounds of `physiology` do not."""
    time_course: TimeCourse = "cosine"
    """Time course of a prescribed motion, from 0 at end-diastole to the full motion at end-systole: `cosine`, to
    mid-cycle and back; `triangle`, the same in equal steps; `ramp`, in equal steps to the last frame."""
    rigid: Rigid = Rigid()
    """`rigid`: translation and rotation of the whole heart; by default one pixel of the default image along both
    axes."""
    affine: Affine = Affine()
    """`affine`: uniform deformation gradient in the whole heart."""
    tube: TubeMotion = TubeMotion()
    """`tube`: contraction, shortening and torsion of a tube (`geometry.shape`) at constant wall volume; by default
    the ejection fraction is 0.62."""
