"""Section of the configuration: the laws of the wall and its support."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.materials import DEFAULT, LAWS, AnyLaw
from echotruth.section import Section


class Active(Section):
    """Active tension along the fibres, T_a = T_Ca [1 + beta (lambda - 1)]."""

    length_dependence: Annotated[FiniteFloat, Field(ge=0, le=5)] = 1.4
    """beta."""
    stress: Literal["cauchy", "second_piola_kirchhoff"] = "cauchy"
    """Meaning of T_a: the paper's tension per deformed area (S_ff = T_a / lambda^2), or S_ff itself."""


class Mechanics(Section):
    """Finite-element heart driven through its cycle."""

    material: AnyLaw = LAWS[DEFAULT].Law()
    """Passive law of the wall."""
    active: Active = Active()
    """Active stress of the wall."""
    bulk_modulus_kPa: Annotated[FiniteFloat, Field(ge=100)] = 2000.0
    """Penalty on volume change; below 2000 kPa it shifts pressures by per cents."""
    pointwise_bulk_ratio: Annotated[FiniteFloat, Field(ge=0, le=1000)] = 20.0
    """Penalty on volume change at each point of an element, over C: keeps det F near 1 where elements are large."""
    viscosity_Pa_s: Annotated[FiniteFloat, Field(ge=0)] = 1.0
    """Viscous stress over the rate of Green-Lagrange strain. It lets a wall whose fibres weaken as they shorten pass to
    the next equilibrium where none is near; otherwise it is a fraction of a per cent of the stress."""
    base: Literal["radial_free", "fixed"] = "radial_free"
    """Support of the base: free to move radially in its plane, or fixed."""
    epicardial_spring_kPa_per_mm: Annotated[FiniteFloat, Field(ge=0)] = 0.0
    """Stiffness per area with which the surroundings resist the outward or inward motion of the epicardium."""
