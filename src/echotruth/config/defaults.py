"""Defaults that another section decides: the loop and the array for a heart, the scan for an array, and the lengths of
trackers for what is scanned.

The heart stands at the focus, all of it is in the field of view, and ten scatterers or more are in a volume of beam
width, pulse length and thickness of the slice. Focal zones are about half a depth of field apart, which is 7
wavelengths times the square of focus over aperture; their foci reach over most of the heart.
"""

from __future__ import annotations

from typing import Any

from echotruth.config.tracking import DEFAULT, METHODS, name_of, standard_trackers

HEARTS = {
    "mouse": {"loop.file": "mouse", "probe.preset": "mouse_25MHz"},
    "rat": {"loop.file": "rat", "probe.preset": "rat_15MHz"},
    "human": {"loop.file": "human", "probe.preset": "human_2_7MHz"},
}
"""`geometry.preset` to the keys that follow it."""

_KEYS = ("phantom.density_per_mm3", "rf.focus_mm", "rf.zones", "rf.zone_mm", "rf.sector_deg", "bmode.field_of_view_mm")
_SCANS = {
    "mouse_25MHz": (2800.0, 6.5, 5, 1.0, 64.0, 12.0),
    "mouse_30MHz": (5300.0, 6.5, 5, 1.0, 64.0, 12.0),
    "mouse_40MHz": (9500.0, 6.5, 5, 1.0, 64.0, 12.0),
    "rat_15MHz": (620.0, 10.8, 5, 1.7, 64.0, 20.0),
    "human_2_7MHz": (5.0, 70.0, 3, 25.0, 75.0, 150.0),
}
ARRAYS: dict[str, dict[str, float]] = {name: dict(zip(_KEYS, row, strict=True)) for name, row in _SCANS.items()}
"""`probe.preset` to the keys that follow it."""


SIDE_MM = 12.0
"""Side of the field of view for which the lengths of trackers are given in their sections."""
LENGTHS = ("windows_mm", "subset_mm", "knots_mm", "margin_um", "resolved_um")
"""Keys of trackers that follow `bmode.field_of_view_mm`: walls are the thicker the larger the heart."""


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
    values = _filled(values, ARRAYS.get(_preset(values, "probe"), {}))
    return _with_lengths(values, _scale(values))


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


def _scale(values: dict[str, Any]) -> float:
    """Side of the field of view over that of the trackers' sections; 1 where it is left to the models to refuse."""
    bmode = values.get("bmode", {})
    side = bmode.get("field_of_view_mm", SIDE_MM) if isinstance(bmode, dict) else bmode.field_of_view_mm
    return side / SIDE_MM if isinstance(side, int | float) and side > 0 else 1.0


def _with_lengths(values: dict[str, Any], scale: float) -> dict[str, Any]:
    tracking = values.get("tracking", {})
    if scale == 1 or not isinstance(tracking, dict):
        return values
    given = tracking.get("trackers")
    if given is None:
        standard = standard_trackers(scale).items()
        given = {name: {"method": each.method} | each.model_dump(exclude_unset=True) for name, each in standard}
    if not isinstance(given, dict):
        return values
    trackers = {name: _lengths(each, scale) | each if isinstance(each, dict) else each for name, each in given.items()}
    return values | {"tracking": tracking | {"trackers": trackers}}


def _lengths(tracker: dict[str, Any], scale: float) -> dict[str, Any]:
    """Lengths of a tracker's method at a scale."""
    named = tracker.get("method", DEFAULT)
    method = next((each for each in METHODS if name_of(each) == named), METHODS[0])
    found = {key: method.model_fields[key].get_default() for key in LENGTHS if key in method.model_fields}
    return {
        key: [each * scale for each in value] if isinstance(value, list) else value * scale
        for key, value in found.items()
    }
