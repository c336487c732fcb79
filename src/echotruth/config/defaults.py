"""Defaults that follow from other sections: loop and array from the heart, growth and load from the disease,
scan from the array, lengths of trackers from the field of view.
"""

from math import floor, isfinite, sin
from typing import Any, NamedTuple

from echotruth.config.cases import LEVELS, POSES, presets_of
from echotruth.config.imaging import VIEWS
from echotruth.config.merging import merged, nested
from echotruth.config.presets import PRESETS
from echotruth.config.realism import REALISM_PRESETS
from echotruth.config.tracking import METHODS, PhaseCorrelation, default_trackers, name_of
from echotruth.config.transducers import ARRAY_DEFAULTS, ARRAY_PRESETS
from echotruth.units import deg

HEART_DEFAULTS: dict[str, dict[str, Any]] = PRESETS["heart"]
"""`geometry.preset` -> default of dotted keys."""
DISEASE_DEFAULTS: dict[str, dict[str, Any]] = PRESETS["disease"]
"""`pathology.preset` -> default of dotted keys."""
DISEASE_OF_HEART: dict[str, dict[str, dict[str, Any]]] = PRESETS["disease_of_heart"]
"""`pathology.preset` -> `geometry.preset` -> what differs from that."""
REALISM_SMOOTHING = 1 / 260
"""Default of `bmode.smoothing_width_px` over the side of the image, with any `realism.preset`."""
REALISM_IMAGE: dict[str, Any] = PRESETS["realistic_image"]
"""Defaults of dotted keys with any `realism.preset`."""
REALISM_EDGE_LOSS_DB, REALISM_EDGE_DEG, REALISM_EDGE_DEPTH = 22.0, 85.0, 0.8
"""Default of `bmode.dropout.edge_loss_dB` of a sector, with any `realism.preset`, and the opening angle and the depth,
over the default field of view of the array, of that sector; others lose as much at the same angle and range."""


class Look(NamedTuple):
    """Defaults of realistic images of a species that differ from those of another, as presets.yaml explains them."""

    bandwidth: float
    image: dict[str, Any]
    time_gain_dB: dict[float, float]
    harmonic: float | None
    scan: dict[str, tuple[float, float]]


REALISM_LOOKS = {name: Look(**look) for name, look in PRESETS["looks"].items()}
"""By `realism.preset`."""

ARRAY_SUFFIXES = (".npy", ".npz")
"""Files of positions without a mesh."""

REFERENCE_FIELD_OF_VIEW_MM = 12.0
"""Field of view for which the sections of the trackers give their default lengths."""
TRACKER_LENGTHS = ("windows_mm", "knots_mm", "margin_um", "gain_mm", "speckle_pixel_um")
"""Keys of trackers that scale with `bmode.field_of_view_mm`, because larger hearts have thicker walls."""


def apply_presets(values: dict[str, Any]) -> dict[str, Any]:
    """Fill in the defaults that follow from the heart, its disease, the array and the field of view.

    Parameters
    ----------
    values : dict
        Name -> section, as a mapping or as a model; models are not changed.

    Returns
    -------
    dict
        A new mapping with the defaults added.
    """
    heart = str(_value(values, "geometry.preset"))
    values = _filled(values, HEART_DEFAULTS.get(heart, HEART_DEFAULTS["mouse"]))
    disease = str(_value(values, "pathology.preset"))
    if _value(values, "loop.kind") in (None, "circulation"):
        values = _filled(values, DISEASE_OF_HEART.get(disease, {}).get(heart, {}))
        values = _filled(values, DISEASE_DEFAULTS.get(disease, {}))
    array = str(_value(values, "probe.preset"))
    values = _filled(values, _scanner(values, array))
    values = _filled(values, ARRAY_DEFAULTS.get(array, {}))
    path = _value(values, "motion.file.path")
    if _value(values, "motion.kind") == "file" and isinstance(path, str) and not path.lower().endswith(ARRAY_SUFFIXES):
        values = _filled(values, {"geometry.file": path})
    return _with_acoustics(_with_lengths(values))


def _filled(values: dict[str, Any], defaults: dict[str, Any]) -> dict[str, Any]:
    """Values with defaults of dotted keys for those that are not given."""
    return merged(nested(defaults), values)


def _value(values: dict[str, Any], dotted_key: str) -> Any:
    """Value of a dotted key, in mappings and models, also if it is not valid; None if there is none."""
    found: Any = values
    for key in dotted_key.split("."):
        found = found.get(key) if isinstance(found, dict) else getattr(found, key, None)
    return found


def _scanner(values: dict[str, Any], array: str) -> dict[str, Any]:
    """Defaults of dotted keys by which a scanner makes realistic images: its image, and a narrow band.

    The density of scatterers suits that band; a bandwidth that is given leaves both as they are.
    """
    name, size = str(_value(values, "realism.preset")), _value(values, "bmode.size_px") or 512
    look = REALISM_LOOKS.get(name)
    if look is None:
        return {}
    width = REALISM_SMOOTHING * size if isinstance(size, int | float) else 2.0
    found = REALISM_IMAGE | {"bmode.smoothing_width_px": round(max(width, 0.5), 3)} | _harmonic(values, array, look)
    found |= {f"bmode.{key}": value for key, value in look.image.items()} | _scan(values, array, look)
    if any(_value(values, f"bmode.time_gain.{key}") for key in ("range_mm", "gain_dB")):
        found = {key: value for key, value in found.items() if not key.startswith("bmode.time_gain")}
    if array not in ARRAY_PRESETS or _value(values, "probe.bandwidth") is not None:
        return found
    density, ratio = "phantom.density_per_mm3", 1.0
    if look.harmonic and "probe.frequency_MHz" in found and _value(values, "probe.frequency_MHz") is None:
        ratio = look.harmonic
    # A resolution cell is so many wavelengths long, wide and thick.
    number = round(look.bandwidth * ratio**3 * ARRAY_DEFAULTS[array][density], 3)
    return found | {"probe.bandwidth": round(look.bandwidth * ARRAY_PRESETS[array]["bandwidth"], 3), density: number}


def _scan(values: dict[str, Any], array: str, look: Look) -> dict[str, Any]:
    """Defaults of dotted keys of a scan that shows what a preset has, of its gain over range, and of its edges."""
    if array not in ARRAY_DEFAULTS:
        return {}
    default, gain = ARRAY_DEFAULTS[array], look.time_gain_dB
    scan = {key: round(value / usual * default[key], 3) for key, (value, usual) in look.scan.items()}
    given = {key: _value(values, key) for key in ("rf.scan", "rf.sector_deg", "bmode.field_of_view_mm")}
    used = default | scan | {key: value for key, value in given.items() if value is not None}
    sector, side = used["rf.sector_deg"], used["bmode.field_of_view_mm"]
    if used.get("rf.scan") != "linear" and _is_finite(sector) and 5 < sector <= 120 and _is_finite(side):
        # The arc just fits into the image.
        depth = floor(1e3 * side * min(1, 0.5 / sin(sector / 2 * deg))) / 1e3
        edge = sector / REALISM_EDGE_DEG * depth / (REALISM_EDGE_DEPTH * default["bmode.field_of_view_mm"])
        scan |= {"rf.depth_mm": depth, "bmode.dropout.edge_loss_dB": round(min(REALISM_EDGE_LOSS_DB * edge**2, 60), 1)}
    ranges = [round(share * default["bmode.field_of_view_mm"], 3) for share in gain]
    return scan | {
        "bmode.time_gain.range_mm": ranges,
        "bmode.time_gain.gain_dB": [float(each) for each in gain.values()],
    }


def _harmonic(values: dict[str, Any], array: str, look: Look) -> dict[str, Any]:
    """Defaults of dotted keys of harmonic imaging, unless it is not that of a preset, or is turned off."""
    unfocused = _value(values, "rf.transmit") not in (None, "focused")
    if look.harmonic is None or array not in ARRAY_PRESETS or unfocused:
        return {}
    if _value(values, "rf.harmonic") is False:
        return {}
    frequency = round(look.harmonic * ARRAY_PRESETS[array]["frequency_MHz"], 3)
    return {"rf.harmonic": True, "rf.transmit_apodization": "none", "probe.frequency_MHz": frequency}


def _with_lengths(values: dict[str, Any]) -> dict[str, Any]:
    """Values with the default lengths of trackers that suit the field of view, if that is valid."""
    side, tracking = _value(values, "bmode.field_of_view_mm"), values.get("tracking", {})
    if not isinstance(side, int | float) or not side > 0 or not isinstance(tracking, dict):
        return values
    scale, trackers = side / REFERENCE_FIELD_OF_VIEW_MM, tracking.get("trackers")
    if scale != 1 and trackers is None:
        standard = default_trackers(scale).items()
        trackers = {name: {"method": model.method} | model.model_dump(exclude_unset=True) for name, model in standard}
    if scale == 1 or not isinstance(trackers, dict):
        return values
    scaled = {name: _lengths(t, scale) | t if isinstance(t, dict) else t for name, t in trackers.items()}
    return values | {"tracking": tracking | {"trackers": scaled}}


def _with_acoustics(values: dict[str, Any]) -> dict[str, Any]:
    """Values with the distributions of levels and of the poses of all views, about their own values.

    They are added if a preset draws them, and views and focus are valid.
    """
    draw, given, focus = (_value(values, key) for key in ("cases.draw", "views", "rf.focus_mm"))
    views = VIEWS["paper"] if given is None else given
    if isinstance(views, dict) and isinstance(preset := views.get("preset"), str):
        views = VIEWS.get(preset, {}) | {name: view for name, view in views.items() if name != "preset"}
    valid = isinstance(draw, dict) and isinstance(draw.get("keys", {}), dict) and isinstance(views, dict)
    if not valid or "acoustics" not in presets_of(draw) or not _is_finite(focus):
        return values
    keys = _levels(values) | _poses(views, focus) | draw.get("keys", {})
    return values | {"cases": values["cases"] | {"draw": draw | {"keys": keys}}}


def _levels(values: dict[str, Any]) -> dict[str, Any]:
    """Distributions of levels, about those of the configuration or of its `realism.preset`."""
    preset, found = REALISM_PRESETS.get(str(_value(values, "realism.preset")), {}), {}
    for key, bounds in LEVELS.items():
        value = _value(values, key)
        value = _value({"realism": preset}, key) if value is None else value
        if _is_finite(value):
            found[key] = {"uniform": [value + bound for bound in bounds]}
    return found


def _poses(views: dict[str, Any], focus_mm: float) -> dict[str, Any]:
    """Distributions of the poses of views, about the pose that each has in the configuration."""
    found: dict[str, Any] = {}
    for name, view in views.items():
        for key, bounds in POSES.items():
            value, scale = _value(view, key), focus_mm if key.endswith("_mm") else 1.0
            middle = value if _is_finite(value) else 0
            found[f"views.{name}.{key}"] = {"uniform": [round(middle + scale * bound, 6) for bound in bounds]}
    return found


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and isfinite(value)


def _lengths(tracker: dict[str, Any], scale: float) -> dict[str, Any]:
    """Scaled default lengths of a tracker's method."""
    section = {name_of(section): section for section in METHODS}.get(str(tracker.get("method")), PhaseCorrelation)
    lengths = {key: field.default for key, field in section.model_fields.items() if key in TRACKER_LENGTHS}
    return {
        key: [length * scale for length in value] if isinstance(value, list) else value * scale
        for key, value in lengths.items()
    }
