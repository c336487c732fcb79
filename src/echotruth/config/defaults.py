"""Defaults that follow from other sections: loop and array from the heart, growth and load from the disease,
scan from the array, lengths of trackers from the field of view.
"""

from math import isfinite
from typing import Any, NamedTuple

from echotruth.config.cases import POSES, poses, presets_of
from echotruth.config.imaging import VIEWS
from echotruth.config.merging import merged, nested
from echotruth.config.tracking import METHODS, PhaseCorrelation, default_trackers, name_of
from echotruth.config.transducers import ARRAY_DEFAULTS, ARRAY_PRESETS

HEART_DEFAULTS: dict[str, dict[str, Any]] = {
    "mouse": {"loop.file": "mouse", "probe.preset": "mouse_25MHz"},
    "rat": {
        "loop.file": "rat",
        "probe.preset": "rat_15MHz",
        "fibres.epi_deg": -41.0,
        "mechanics.active.shortening_velocity_max_per_s": 12.0,
        "mechanics.active.sheet_share": 0.38,
        "pathology.activation.fibre_speed_m_per_s": 0.65,
        "pathology.activation.cross_fibre_speed_m_per_s": 0.45,
        "pathology.activation.purkinje_speed_m_per_s": 1.2,
        "mechanics.pericardium.spring_kPa_per_mm": 0.5,
        "physiology.fibre_shortening_rate_max_per_s": 7.0,
        "physiology.wall_mass_min_g": 0.2,
        "physiology.wall_mass_max_g": 2.0,
    },
    "human": {
        "loop.file": "human",
        "probe.preset": "human_2_7MHz",
        "fibres.endo_deg": 72.0,
        "fibres.epi_deg": -52.0,
        "pathology.activation.fibre_speed_m_per_s": 0.65,
        "pathology.activation.cross_fibre_speed_m_per_s": 0.45,
        "pathology.activation.purkinje_speed_m_per_s": 2.0,
        "mechanics.active.shortening_velocity_max_per_s": 8.0,
        "mechanics.active.sheet_share": 0.3,
        "mechanics.active.length_sensitivity": 10.0,
        "mechanics.active.normal_share": 0.18,
        "mechanics.pericardium.spring_kPa_per_mm": 0.1,
        "physiology.fibre_shortening_rate_max_per_s": 3.0,
        "physiology.twist_es_max_deg": 25.0,
        "physiology.circumferential_strain_min": -0.26,
        "physiology.circumferential_strain_max": -0.1,
        "physiology.gls_max": -0.13,
        "physiology.ejection_fraction_min": 0.45,
        "physiology.ejection_fraction_max": 0.8,
        "physiology.edp_min_mmHg": 3.0,
        "physiology.edp_max_mmHg": 14.0,
        "physiology.edv_per_mass_min_mL_per_g": 0.9,
        "physiology.edv_per_mass_max_mL_per_g": 2.8,
        "physiology.output_per_mass_min_mL_per_min_per_g": 25.0,
        "physiology.output_per_mass_max_mL_per_min_per_g": 120.0,
        "physiology.wall_mass_min_g": 40.0,
        "physiology.wall_mass_max_g": 350.0,
        "physiology.radial_strain_min": 0.2,
        "physiology.radial_strain_max": 0.95,
        "physiology.segment_circumferential_strain_min": -0.32,
    },
}
"""`geometry.preset` -> default of dotted keys."""

DISEASE_DEFAULTS: dict[str, dict[str, Any]] = {
    "hypertension": {
        "geometry.hypertrophy": 1.2,
        "loop.kind": "circulation",
        "loop.circulation.resistance": 1.25,
        "loop.circulation.compliance": 0.67,
        "loop.circulation.retained_volume_stroke_volumes": 2.0,
        "loop.circulation.baroreflex": False,
    },
    "dcm": {
        "geometry.dilation": 1.1,
        "loop.kind": "circulation",
        "loop.circulation.contractility": 0.55,
        "loop.circulation.retained_volume_stroke_volumes": 5.0,
    },
}
"""`pathology.preset` -> default of dotted keys; docs/physiology.md says where each is from."""
DISEASE_OF_HEART: dict[tuple[str, str], dict[str, Any]] = {
    ("dcm", "rat"): {"loop.circulation.contractility": 0.68},
    ("dcm", "human"): {"loop.circulation.contractility": 0.7},
}
"""`pathology.preset` and `geometry.preset` -> what differs from that."""
REALISM_SMOOTHING = 1 / 260
"""Default of `bmode.smoothing_width_px` over the side of the image, with any `realism.preset`."""
REALISM_IMAGE: dict[str, Any] = {
    "probe.attenuation_dB_per_cm_MHz": 0.5,
    "bmode.dynamic_range_dB": 60.0,
    "bmode.grey_gamma": 1.6,
    "bmode.smoothing": 1.0,
}
"""Defaults of dotted keys with any `realism.preset`."""
REALISM_EDGE_LOSS_DB, REALISM_EDGE_DEG = 22.0, 85.0
"""Default of `bmode.dropout.edge_loss_dB` of a sector, with any `realism.preset`, and the opening angle of that sector;
of others it is that of lines at the same angle."""


class Look(NamedTuple):
    """Defaults of realistic images of a species that differ from those of another.

    Attributes
    ----------
    bandwidth : float
        Bandwidth, and density of scatterers, of which a longer pulse needs fewer, over those of the array.
    gain_dB : float
        `bmode.gain_dB`.
    time_gain_dB : dict
        `bmode.time_gain` by the range over the field of view of the array: with it, an even medium is as bright at any
        range of the default array.
    harmonic : float or None
        Frequency at which harmonics are received, over that of the array, whose band must hold it and its half; none
        without harmonic imaging.
    scan : dict
        Dotted keys whose defaults are so many times those of the array, so that the roof of the atria is seen.
    """

    bandwidth: float
    gain_dB: float
    time_gain_dB: dict[float, float]
    harmonic: float | None
    scan: dict[str, float]


REALISM_LOOKS = {
    "mouse": Look(0.6, -5.0, {0.1: 7, 0.17: 4, 0.23: 2, 0.3: 0, 0.5: 1.5, 0.75: 4, 1.0: 7, 1.25: 9}, None, {}),
    "human": Look(
        0.15,
        -9.5,
        {0.1: 20, 0.17: 14, 0.23: 5.5, 0.3: 0, 0.5: 0, 0.63: 3, 0.77: 7, 0.9: 10.5, 1.03: 12, 1.27: 14.5},
        1.25,
        {"rf.focus_mm": 76 / 70, "rf.sector_deg": 85 / 75, "bmode.field_of_view_mm": 1.2},
    ),
}
"""By `realism.preset`; docs/realism.md says what they were fitted to."""

ARRAY_SUFFIXES = (".npy", ".npz")
"""Files of positions without a mesh."""

REFERENCE_FIELD_OF_VIEW_MM = 12.0
"""Field of view for which the sections of the trackers give their default lengths."""
TRACKER_LENGTHS = ("windows_mm", "subset_mm", "knots_mm", "margin_um", "gain_mm", "speckle_pixel_um")
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
        values = _filled(_filled(values, DISEASE_OF_HEART.get((disease, heart), {})), DISEASE_DEFAULTS.get(disease, {}))
    array = str(_value(values, "probe.preset"))
    values = _filled(values, _scanner(values, array))
    values = _filled(values, ARRAY_DEFAULTS.get(array, {}))
    path = _value(values, "motion.file.path")
    if _value(values, "motion.kind") == "file" and isinstance(path, str) and not path.lower().endswith(ARRAY_SUFFIXES):
        values = _filled(values, {"geometry.file": path})
    return _with_poses(_with_lengths(values))


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
    found |= {"bmode.gain_dB": look.gain_dB} | _scan(array, look)
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


def _scan(array: str, look: Look) -> dict[str, Any]:
    """Defaults of dotted keys of a scan that shows what a preset has, and of its gain over range."""
    if array not in ARRAY_DEFAULTS:
        return {}
    default, gain = ARRAY_DEFAULTS[array], look.time_gain_dB
    scan = {key: round(share * default[key], 3) for key, share in look.scan.items()}
    if default.get("rf.scan") != "linear":
        sector = scan.get("rf.sector_deg", default["rf.sector_deg"])
        scan["bmode.dropout.edge_loss_dB"] = round(REALISM_EDGE_LOSS_DB * (sector / REALISM_EDGE_DEG) ** 2, 1)
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


def _with_poses(values: dict[str, Any]) -> dict[str, Any]:
    """Values with the distributions of the poses of all views, if a preset draws them and views and focus are valid."""
    draw, given, focus = (_value(values, key) for key in ("cases.draw", "views", "rf.focus_mm"))
    views = VIEWS["paper"] if given is None else given
    if isinstance(views, dict) and isinstance(preset := views.get("preset"), str):
        views = VIEWS.get(preset, {}) | {name: view for name, view in views.items() if name != "preset"}
    valid = isinstance(draw, dict) and isinstance(draw.get("keys", {}), dict) and isinstance(views, dict)
    if not valid or "acoustics" not in presets_of(draw) or not _is_finite(focus):
        return values
    known = {name: {key: _value({"view": view}, f"view.{key}") for key in POSES} for name, view in views.items()}
    known = {name: {key: v for key, v in keys.items() if _is_finite(v)} for name, keys in known.items()}
    keys = poses(known, focus) | draw.get("keys", {})
    return values | {"cases": values["cases"] | {"draw": draw | {"keys": keys}}}


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
