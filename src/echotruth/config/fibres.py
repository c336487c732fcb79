"""Fibre directions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.section import Angle, Positive, Section

Tilt = Annotated[FiniteFloat, Field(gt=-90, lt=90)]


class Fibres(Section):
    """Fibre and sheet directions by a Laplace-Dirichlet rule, or those that the mesh file carries."""

    source: Literal["rule", "file"] = "rule"
    """Angles below as functions of wall depth, or the directions in the cells of the mesh file."""
    endo_deg: Angle = 84.0
    """Helix angle at the endocardium: from circumferential, positive towards the base."""
    epi_deg: Angle = -42.0
    """Helix angle at the epicardium."""
    transverse_endo_deg: Tilt = 0.0
    """Transverse angle at the endocardium: of the fibre seen along the long axis, positive outwards."""
    transverse_epi_deg: Tilt = 0.0
    """Transverse angle at the epicardium."""
    sheet_endo_deg: Angle = 0.0
    """Sheet angle at the endocardium: turn about the fibre, 0 for sheets that lie in the wall, positive inwards."""
    sheet_epi_deg: Angle = 0.0
    """Sheet angle at the epicardium."""
    layers: Annotated[int, Field(ge=1, le=24)] = 6
    """Transmural layers for analysis (and for fibres when `stepwise`)."""
    stepwise: bool = False
    """One angle a layer, that of its middle, in place of a linear course."""
    disarray_deg: Annotated[FiniteFloat, Field(ge=0, le=90)] = 0.0
    """Standard deviation of a random turn of the fibres about the wall normal; 0 is none."""
    disarray_length_mm: Positive = 0.5
    """Distance over which that turn changes: at it the correlation has fallen to 0.61."""
