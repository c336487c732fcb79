"""Section `motion`: the beat of the heart, or a motion prescribed by a formula or read from a file."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from echotruth.section import Fraction, Section, check

Kind = Literal["beat", "rigid", "affine", "tube", "file"]
TimeCourse = Literal["cosine", "triangle", "ramp"]
Translation = Annotated[FiniteFloat, Field(ge=-1e5, le=1e5)]
Rotation = Annotated[FiniteFloat, Field(ge=-180, le=180)]
FrameNumber = Annotated[int, Field(ge=0, le=10**9)]
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

    @check
    def _check_eigenvalues(self) -> None:
        # F = I + a (A - I) becomes singular at some fraction a of the motion if A has a real eigenvalue <= 0.
        values = np.linalg.eigvals(self.gradient)
        smallest = min((value.real for value in values if abs(value.imag) < _IMAGINARY_TOLERANCE), default=1.0)
        remedy = f"has the eigenvalue {smallest:.3g} and would flatten the wall: all real ones must be positive"
        self.require(smallest > 0, "gradient", f"{remedy} (for a rotation by 180 degrees use rigid)")


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


class FileMotion(Section):
    """A series of tetrahedral meshes, or of positions of the nodes of one mesh, over one cycle."""

    path: str | None = None
    """The series: files in one pattern (`heart_*.vtk`, also .vtu, .pvtu, .msh), in the order of the numbers in their
    names; a .pvd file; or positions of the points of `geometry.file`, of shape (frame, point, 3), as .npy, or
    as .npz with the array `positions` and, optionally, `times`. The unit of all lengths is `geometry.unit` times
    `geometry.scale`."""
    displacement: str | None = None
    """Array over the points that is added to their positions (in .npz: to those of `geometry.file`). Default: the
    points themselves move."""
    times: Annotated[list[FiniteFloat], Field(min_length=2)] | None = None
    """Time of each frame of the series, in any unit, because one cycle takes 60 s / `loop.heart_rate_per_min`.
    Default: the times in the .pvd or .npz file, or equal steps."""
    frames: Annotated[list[FrameNumber], Field(min_length=2, max_length=2)] | None = None
    """First and last frame of the cycle, counted from 0 in the series. Default: all."""
    repeats_first: bool | None = None
    """Whether the last frame of the cycle is the first one again, one period later. Default: if it is as near to it as
    1 % of the motion."""
    ed_frame: FrameNumber | None = None
    """Frame of end-diastole, counted from 0 in the series. Default: that with the largest cavity, the first
    of them while the valves are closed."""

    @check
    def _check_frames(self) -> None:
        if self.frames is None:
            return
        first, last = self.frames
        self.require(first < last, "frames", "must be the first and, after it, the last frame of the cycle")
        is_one = self.ed_frame is None or first <= self.ed_frame <= last
        self.require(is_one, "ed_frame", f"must be one of the frames {first} to {last}")


class Motion(Section):
    """Motion of the heart: the beat of the finite-element heart, an exact formula, or meshes in files."""

    kind: Kind = "beat"
    """`beat`: solved from loop, fibres and mechanics. `rigid`, `affine`, `tube`: prescribed by the section of that
    name, without pressures; only the period and the frames of `loop` apply, and the bounds of `physiology` do not.
    `file`: the same, read from the files of the section of that name (docs/motion.md)."""
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
    file: FileMotion = FileMotion()
    """`file`: meshes of one cycle in files."""
