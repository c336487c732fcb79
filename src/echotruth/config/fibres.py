"""Section `fibres`: fibre and sheet directions."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.section import Angle, Positive, Section

TransverseAngle = Annotated[FiniteFloat, Field(gt=-90, lt=90)]


class Fibres(Section):
    """Fibre and sheet directions, from a Laplace-Dirichlet rule or from the mesh file."""

    source: Literal["rule", "file"] = "rule"
    """`rule`: the angles below are functions of wall depth. `file`: directions of the cells of the mesh file."""
    endo_deg: Angle = 80.0
    """Helix angle at the endocardium: from the circumferential direction, positive towards the base. DT-MRI of mice has
    52 +- 5 deg, and -41 +- 3 at the epicardium (Angeli 2014, doi 10.1186/s12968-014-0077-x), averaged over depth;
    docs/physiology.md says why these defaults. `human`: 72 and -55; the paper: 84 and -42."""
    epi_deg: Angle = -38.0
    """Helix angle at the epicardium."""
    transverse_endo_deg: TransverseAngle = 0.0
    """Transverse angle at the endocardium: of the fibre seen along the long axis, positive outwards."""
    transverse_epi_deg: TransverseAngle = 0.0
    """Transverse angle at the epicardium."""
    sheet_endo_deg: Angle = 0.0
    """Sheet angle at the endocardium: rotation about the fibre, 0 if sheets are parallel to the wall, positive
    inwards."""
    sheet_epi_deg: Angle = 0.0
    """Sheet angle at the epicardium."""
    layers: Annotated[int, Field(ge=1, le=24)] = 6
    """Transmural layers for analysis (and for fibres if `stepwise`)."""
    stepwise: bool = False
    """Angles are constant in each layer (the value at its middle) instead of linear in wall depth."""
    disarray_deg: Annotated[FiniteFloat, Field(ge=0, le=90)] = 0.0
    """Standard deviation of a random rotation of the fibres about the wall normal; 0 for none."""
    disarray_length_mm: Positive = 0.5
    """Correlation length of that rotation: at this distance its correlation is 0.61."""
