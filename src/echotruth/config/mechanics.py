"""The wall and its support."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.section import Positive, Section


class Material(Section):
    """W = C/2 (exp Q - 1), Q = fibre E_ff^2 + transverse (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 shear (E_fs^2 + E_fn^2)."""

    stiffness_kPa: Positive | None = None
    """C. Default: solved, so that the heart has its end-diastolic volume at its end-diastolic pressure.
    When given, the loop's volumes are scaled to the volume the heart then has at end-diastolic pressure."""
    fibre: Positive = 9.2
    """b_f (Omens 1993)."""
    transverse: Positive = 2.0
    """b_t."""
    shear: Positive = 3.7
    """b_fs."""
    bulk_modulus_kPa: Annotated[FiniteFloat, Field(ge=100)] = 2000.0
    """Penalty on volume change; below 2000 kPa it shifts pressures by per cents."""
    length_dependence: Annotated[FiniteFloat, Field(ge=0, le=5)] = 1.4
    """beta in T_a = T_Ca [1 + beta (lambda - 1)]."""


class Mechanics(Section):
    """Finite-element heart driven through its loop."""

    material: Material = Material()
    """The wall."""
    base: Literal["radial_free", "fixed"] = "radial_free"
    """Support of the base: free to widen in its plane, or held."""
