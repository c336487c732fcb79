"""Fibre directions."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from echotruth.section import Angle, Section


class Fibres(Section):
    """Fibre directions by a Laplace-Dirichlet rule."""

    endo_deg: Angle = 84.0
    """Helix angle at the endocardium."""
    epi_deg: Angle = -42.0
    """Helix angle at the epicardium."""
    layers: Annotated[int, Field(ge=1, le=24)] = 6
    """Transmural layers for analysis (and for fibres when `stepwise`)."""
    stepwise: bool = False
    """One angle a layer, that of its middle, in place of a linear course."""
