"""Presets of the unloaded left ventricle by species, and the volume of an ellipsoid."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Literal

from echotruth.config.presets import PRESETS

Lengths = dict[str, float]
HEART_PRESETS: dict[str, Lengths] = PRESETS["geometry"]
"""Species -> length, mm, of each key of the section `geometry`."""
if TYPE_CHECKING:
    Species = str
else:
    Species = Literal[tuple(HEART_PRESETS)]
"""What `geometry.preset` may be; a type checker cannot read names from a table."""


def ellipsoid_mm3(radius: float, length: float, base: float) -> float:
    """Volume, mm^3, of an ellipsoid of semi-axes across and along, cut at a height above its equator, mm.

    The integral of pi radius^2 (1 - z^2 / length^2) from the apex at -length to the base.
    """
    return pi * radius**2 * (length + base - (length**3 + base**3) / (3 * length**2))
