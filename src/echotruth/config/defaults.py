"""Defaults that another section decides: the loop and the array for a heart, the scan for an array.

The heart stands at the focus, all of it is in the field of view, and ten scatterers or more are in a volume of beam
width, pulse length and thickness of the slice.
"""

from __future__ import annotations

from typing import Any

HEARTS = {
    "mouse": {"loop.file": "mouse", "probe.preset": "mouse_25MHz"},
    "rat": {"loop.file": "rat", "probe.preset": "rat_15MHz"},
    "human": {"loop.file": "human", "probe.preset": "human_2_7MHz"},
}
"""`geometry.preset` to the keys that follow it."""

_KEYS = ("phantom.density_per_mm3", "rf.focus_mm", "rf.sector_deg", "bmode.field_of_view_mm")
_SCANS = {
    "mouse_25MHz": (5000.0, 6.5, 64.0, 12.0),
    "mouse_30MHz": (9000.0, 6.5, 64.0, 12.0),
    "mouse_40MHz": (17000.0, 6.5, 64.0, 12.0),
    "rat_15MHz": (1100.0, 10.8, 64.0, 20.0),
    "human_2_7MHz": (8.0, 70.0, 75.0, 150.0),
}
ARRAYS: dict[str, dict[str, float]] = {name: dict(zip(_KEYS, row, strict=True)) for name, row in _SCANS.items()}
"""`probe.preset` to the keys that follow it."""


def suited(values: dict[str, Any]) -> dict[str, Any]:
    """A configuration with what follows its heart and its array, where that is not given.

    Parameters
    ----------
    values : dict
        Sections by name, as mappings or as models; those that are models are left as they are.

    Returns
    -------
    dict
        The same, filled in.
    """
    values = _filled(values, HEARTS.get(_preset(values, "geometry"), HEARTS["mouse"]))
    return _filled(values, ARRAYS.get(_preset(values, "probe"), {}))


def _preset(values: dict[str, Any], section: str) -> str:
    """The preset of a section; the text of whatever else stands there, for the models to refuse."""
    found = values.get(section, {})
    return str(found.get("preset") if isinstance(found, dict) else getattr(found, "preset", None))


def _filled(values: dict[str, Any], following: dict[str, Any]) -> dict[str, Any]:
    for dotted, value in following.items():
        section, key = dotted.split(".")
        given = values.get(section, {})
        if isinstance(given, dict):
            values = values | {section: {key: value} | given}
    return values
