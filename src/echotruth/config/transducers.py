"""Presets of arrays, and of the scan, the density of scatterers and the image that suit each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from echotruth.config.presets import PRESETS

ARRAY_PRESETS: dict[str, dict[str, Any]] = {name: array["probe"] for name, array in PRESETS["arrays"].items()}
"""Name of an array -> values of the section `probe`."""
ARRAY_DEFAULTS: dict[str, dict[str, Any]] = {name: array["scan"] for name, array in PRESETS["arrays"].items()}
"""Name of an array -> default of dotted keys."""
if TYPE_CHECKING:
    ArrayName = str
else:
    ArrayName = Literal[tuple(ARRAY_PRESETS)]
"""What `probe.preset` may be; a type checker cannot read names from a table."""

PRESET_KEYS = (*ARRAY_PRESETS["mouse_25MHz"], "sampling_MHz")
"""Keys of the section `probe` whose defaults follow from the preset."""


def sampling_frequency(frequency: float, bandwidth: float) -> float:
    """Default sampling frequency, in the unit of the centre frequency f: max(4 f, 2.2 f (1 + 1.29 B)).

    The bandwidth B is relative to f. A Gaussian spectrum that falls to 1/2 at B / 2 falls to 1 % at
    sqrt(ln 100 / ln 2) / 2 B = 1.29 B.
    """
    return round(frequency * max(4, 2.2 * (1 + 1.29 * bandwidth)), 3)
