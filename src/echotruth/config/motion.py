"""What moves the heart: its beat, or a formula."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from echotruth.section import Section, impossible

Kind = Literal["beat", "rigid", "affine", "cylinder"]
Course = Literal["cosine", "triangle", "ramp"]
Shift = Annotated[FiniteFloat, Field(ge=-1e5, le=1e5)]
Turn = Annotated[FiniteFloat, Field(ge=-180, le=180)]
Row = Annotated[list[Annotated[FiniteFloat, Field(ge=-5, le=5)]], Field(min_length=3, max_length=3)]

_REAL = 1e-6
"""Imaginary part below which an eigenvalue counts as real: what rounding leaves of a double one."""


class Rigid(Section):
    """A shift and a turn of the whole heart."""

    lateral_um: Shift = 23.4375
    """Shift along the lateral axis of short-axis images."""
    axial_um: Shift = 23.4375
    """Shift along their axial axis, away from the probe."""
    elevation_um: Shift = 0.0
    """Shift through their plane, towards the base."""
    turn_deg: Turn = 0.0
    """Turn about the long axis, counter-clockwise in short-axis images."""


class Affine(Section):
    """One deformation gradient in all of the heart."""

    gradient: Annotated[list[Row], Field(min_length=3, max_length=3)] = Field(
        default=[[0.9, 0.05, 0.0], [0.0, 1.1, 0.0], [0.0, 0.0, 1.0]]
    )
    """Rows of the deformation gradient in the axes of short-axis images: lateral, axial, elevation."""
    position: Annotated[FiniteFloat, Field(ge=0, le=1)] = 0.5
    """Point of the long axis that stays: 0 at the base, 1 at the endocardial apex, as `position` of a view."""

    @model_validator(mode="after")
    def _flattens_nothing(self) -> Affine:
        values = np.linalg.eigvals(self.gradient)
        worst = min((value.real for value in values if abs(value.imag) < _REAL), default=1.0)
        if worst <= 0:
            remedy = (
                f"has the eigenvalue {worst:.3g} and would flatten the wall on the way there: all real eigenvalues "
                "must be positive (half a turn is a key of rigid)"
            )
            raise impossible("gradient", self.gradient, remedy)
        return self


class Cylinder(Section):
    """A tube that contracts, shortens and twists and keeps its volume."""

    contraction: Annotated[FiniteFloat, Field(ge=-1, lt=1)] = 0.35
    """Share by which the inner radius gets smaller; below 0 the tube is inflated."""
    shortening: Annotated[FiniteFloat, Field(ge=-1, lt=1)] = 0.1
    """Share by which the tube gets shorter; below 0 it is stretched."""
    torsion_deg: Turn = 15.0
    """Turn of the lower end against the base, counter-clockwise seen from below (the apex)."""
    endo_turn_deg: Turn = 6.0
    """Turn of the inside of the wall against its outside, likewise; linear in the radius."""


class Motion(Section):
    """What moves the heart: the beat of the finite-element heart, or a formula that is exactly known."""

    kind: Kind = "beat"
    """`beat`: solved from loop, fibres and mechanics. `rigid`, `affine`, `cylinder`: prescribed, as the section of that
    name says; there are no pressures then, `loop` gives no more than period and frames, and `physiology` no bounds."""
    course: Course = "cosine"
    """Course of a prescribed motion from 0 at end-diastole to the whole at end-systole: `cosine`, to mid-cycle and
    back; `triangle`, likewise in equal steps; `ramp`, in equal steps to the last frame."""
    rigid: Rigid = Rigid()
    """`rigid`: a shift and a turn of the whole heart; by default by a pixel of the default image along both axes."""
    affine: Affine = Affine()
    """`affine`: one deformation gradient in all of the heart."""
    cylinder: Cylinder = Cylinder()
    """`cylinder`: a tube (`geometry.shape`) that contracts, shortens and twists and keeps its volume; by default it
    ejects 0.62 of what it holds."""
