"""Dimensions of unloaded left ventricles by species, as truncated thick ellipsoids.

mouse
    Fitted to echocardiograms (Vinhas 2013): cavity 32.8 uL, wall 71 uL. The apical wall is 0.22 of that at the equator,
    as in the human heart below.
rat
    Cavity 132 uL: the volume at zero pressure V0 = EDV (0.6 - 0.006 EDP / mmHg) of Klotz et al., Am J Physiol
    Heart Circ Physiol 291 (2006) H403, who found it in several species, with 230 uL and 4 mmHg, which are
    within Pacher et al., Nat Protoc 3 (2008) 1422, table 1. Wall 414 uL: 435 mg of normotensive rats of nine weeks
    (Jones et al., Clin Exp Pharmacol Physiol 19 (1992) 361) at 1.05 g/mL. The proportions of the cavity are those of
    the mouse, that of the apical wall to the wall at the equator that of mouse and human.
human
    Cavity 84 mL: V0 as for the rat, with 150 mL (between men and women in Hudsmith et al., J Cardiovasc Magn Reson 7
    (2005) 775) and 7 mmHg. Wall 104 mL: 0.73 g of muscle per mL of end-diastolic volume, from 64.7 g/m^2 and
    82.3 mL/m^2 in men, 52.0 and 77.7 in women (Alfakih et al., J Magn Reson Imaging 17 (2003) 323), at 1.05 g/mL.
    The proportions of the cavity were measured on the first heart of the cohort of Rodero et al., PLoS Comput Biol 17
    (2021) e1008851: greatest radius 24.8 mm, 25 mm below the rim, and 88 mm from rim to apex. The apex is 0.22 of the
    wall at the equator: at its thinnest it has 2 mm or less in 97 % of hearts (Bradfield et al., Br Heart J 39 (1977)
    806), 1.2 +- 1.1 mm over some 4 mm in CT (Johnson et al., J Comput Assist Tomogr 33 (2009) 334).
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Literal

Lengths = dict[str, float]

HEART_PRESETS: dict[str, Lengths] = {
    "mouse": {"endo_radius_mm": 1.45, "endo_length_mm": 5.40, "wall_mm": 1.09, "apex_wall_mm": 0.24, "base_mm": 1.40},
    "rat": {"endo_radius_mm": 2.31, "endo_length_mm": 8.60, "wall_mm": 2.29, "apex_wall_mm": 0.50, "base_mm": 2.23},
    "human": {"endo_radius_mm": 21.6, "endo_length_mm": 54.8, "wall_mm": 10.3, "apex_wall_mm": 2.27, "base_mm": 21.8},
}
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
