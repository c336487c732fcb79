"""Defaults that follow from other sections: loop and array from the heart, scan from the array, lengths of trackers
from the field of view.
"""

from typing import Any

from echotruth.config.merging import merged, nested
from echotruth.config.tracking import DEFAULT, METHODS, default_trackers, name_of
from echotruth.config.transducers import ARRAY_DEFAULTS, ARRAY_PRESETS

HEART_DEFAULTS: dict[str, dict[str, Any]] = {
    "mouse": {"loop.file": "mouse", "probe.preset": "mouse_25MHz"},
    "rat": {
        "loop.file": "rat",
        "probe.preset": "rat_15MHz",
        "fibres.epi_deg": -41.0,
        "mechanics.active.shortening_velocity_max_per_s": 12.0,
        "mechanics.active.sheet_share": 0.33,
        "mechanics.pericardium.spring_kPa_per_mm": 0.5,
        "physiology.fibre_shortening_rate_max_per_s": 7.0,
    },
    "human": {
        "loop.file": "human",
        "probe.preset": "human_2_7MHz",
        "fibres.endo_deg": 72.0,
        "fibres.epi_deg": -52.0,
        "mechanics.active.shortening_velocity_max_per_s": 8.0,
        "mechanics.active.sheet_share": 0.3,
        "mechanics.active.normal_share": 0.18,
        "mechanics.pericardium.spring_kPa_per_mm": 0.1,
        "physiology.fibre_shortening_rate_max_per_s": 3.0,
        "physiology.twist_es_max_deg": 25.0,
        "physiology.circumferential_strain_min": -0.26,
        "physiology.circumferential_strain_max": -0.1,
        "physiology.gls_max": -0.13,
    },
}
"""`geometry.preset` -> default of dotted keys."""

REALISM_BANDWIDTHS = {"mouse": 0.6, "human": 0.2}
"""`realism.preset` -> default of the bandwidth, and of the density of scatterers, of which a longer pulse needs fewer,
over those of the array."""
REALISM_SMOOTHING = {"mouse": 1 / 215, "human": 1 / 250}
"""`realism.preset` -> default of `bmode.smoothing_width_px` over the side of the image."""
REALISM_IMAGE: dict[str, float] = {
    "bmode.dynamic_range_dB": 50.0,
    "bmode.gain_dB": -13.0,
    "bmode.grey_gamma": 1.3,
    "bmode.smoothing": 0.65,
}
"""Defaults of dotted keys with any `realism.preset`."""

ARRAY_SUFFIXES = (".npy", ".npz")
"""Files of positions without a mesh."""

REFERENCE_FIELD_OF_VIEW_MM = 12.0
"""Field of view for which the sections of the trackers give their default lengths."""
TRACKER_LENGTHS = ("windows_mm", "subset_mm", "knots_mm", "margin_um", "gain_mm", "speckle_pixel_um")
"""Keys of trackers that scale with `bmode.field_of_view_mm`, because larger hearts have thicker walls."""


def apply_presets(values: dict[str, Any]) -> dict[str, Any]:
    """Fill in the defaults that follow from the heart, the array and the field of view.

    Parameters
    ----------
    values : dict
        Name -> section, as a mapping or as a model; models are not changed.

    Returns
    -------
    dict
        A new mapping with the defaults added.
    """
    values = _fill(values, HEART_DEFAULTS.get(_preset(values, "geometry"), HEART_DEFAULTS["mouse"]))
    values = _fill(values, _scanner(values))
    values = _fill(values, ARRAY_DEFAULTS.get(_preset(values, "probe"), {}))
    values = _fill(values, _mesh_of_motion(values.get("motion")))
    return _scale_trackers(values, _length_scale(values))


def _scanner(values: dict[str, Any]) -> dict[str, Any]:
    """Defaults of dotted keys by which a scanner makes realistic images: its image, and a narrow band.

    The density of scatterers suits that band; a bandwidth that is given leaves both as they are.
    """
    name, array = _preset(values, "realism"), _preset(values, "probe")
    if name not in REALISM_BANDWIDTHS:
        return {}
    size = _value(values.get("bmode", {}), "size_px") or 512
    width = REALISM_SMOOTHING[name] * size if isinstance(size, int | float) else 2.0
    found = REALISM_IMAGE | {"bmode.smoothing_width_px": round(max(width, 0.5), 3)}
    if array not in ARRAY_PRESETS or _value(values.get("probe", {}), "bandwidth") is not None:
        return found
    share, density = REALISM_BANDWIDTHS[name], "phantom.density_per_mm3"
    bandwidth = round(share * ARRAY_PRESETS[array]["bandwidth"], 3)
    return found | {"probe.bandwidth": bandwidth, density: round(share * ARRAY_DEFAULTS[array][density], 3)}


def _mesh_of_motion(motion: Any) -> dict[str, Any]:
    """`geometry.file` of a motion from files that hold meshes too."""
    path = _value(_value(motion, "file"), "path")
    holds_mesh = (
        _value(motion, "kind") == "file" and isinstance(path, str) and not path.lower().endswith(ARRAY_SUFFIXES)
    )
    return {"geometry.file": path} if holds_mesh else {}


def _preset(values: dict[str, Any], name: str) -> str:
    """Preset of a section as text, even if invalid: the models refuse it later."""
    return str(_value(values.get(name, {}), "preset"))


def _value(section: Any, key: str) -> Any:
    """Value of a key of a mapping or a model; None if it has none."""
    return section.get(key) if isinstance(section, dict) else getattr(section, key, None)


def _fill(values: dict[str, Any], defaults: dict[str, Any]) -> dict[str, Any]:
    """Values with defaults of dotted keys for those that are not given."""
    for dotted_key, default in defaults.items():
        values = merged(nested(dotted_key, default), values)
    return values


def _length_scale(values: dict[str, Any]) -> float:
    """Field of view over the reference one; 1 if it is invalid, because the models refuse it later."""
    side = _value(values.get("bmode", {}), "field_of_view_mm")
    return side / REFERENCE_FIELD_OF_VIEW_MM if isinstance(side, int | float) and side > 0 else 1.0


def _scale_trackers(values: dict[str, Any], scale: float) -> dict[str, Any]:
    tracking = values.get("tracking", {})
    if scale == 1 or not isinstance(tracking, dict):
        return values
    trackers = tracking.get("trackers")
    if trackers is None:
        standard = default_trackers(scale).items()
        trackers = {name: {"method": model.method} | model.model_dump(exclude_unset=True) for name, model in standard}
    if not isinstance(trackers, dict):
        return values
    scaled = {name: _scaled_lengths(t, scale) | t if isinstance(t, dict) else t for name, t in trackers.items()}
    return values | {"tracking": tracking | {"trackers": scaled}}


def _scaled_lengths(tracker: dict[str, Any], scale: float) -> dict[str, Any]:
    """Scaled default lengths of a tracker's method."""
    name = tracker.get("method", DEFAULT)
    method = next((section for section in METHODS if name_of(section) == name), METHODS[0])
    defaults = {key: method.model_fields[key].get_default() for key in TRACKER_LENGTHS if key in method.model_fields}
    return {
        key: [length * scale for length in value] if isinstance(value, list) else value * scale
        for key, value in defaults.items()
    }
