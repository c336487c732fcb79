"""Factors to SI of the units in which the configuration gives values, each named as the suffix of the keys with it.

A value times the factor is in SI units, as in `probe.pitch_um * um`.
"""

import math
from typing import Final

um: Final = 1e-6
mm: Final = 1e-3
per_mm3: Final = 1e9
uL: Final = 1e-9
mL: Final = 1e-6
m3: Final = 1.0
ns: Final = 1e-9
ms: Final = 1e-3
s: Final = 1.0
per_min: Final = 1 / 60
MHz: Final = 1e6
m_per_s: Final = 1.0
mmHg: Final = 133.322387415
"""NIST SP 811, appendix B.8."""
kPa: Final = 1e3
Pa: Final = 1.0
kPa_per_mm: Final = 1e6
kPa_s_per_mm: Final = 1e6
Pa_s: Final = 1.0
g: Final = 1e-3
mL_per_g: Final = 1e-3
mL_per_min_per_g: Final = 1e-3 / 60
deg: Final = math.pi / 180
dB: Final = 1.0
dB_per_cm_MHz: Final = math.log(10) / 20 / 1e-2 / 1e6
"""To nepers per metre and hertz."""

UNITS: Final = {name: factor for name, factor in globals().items() if isinstance(factor, float)}
"""Unit suffix of a key -> factor to SI."""


def unit_of(key: str) -> str:
    """Unit suffix of a configuration key; empty if it has none."""
    return max((unit for unit in UNITS if key.endswith(f"_{unit}")), key=len, default="")
