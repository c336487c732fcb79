"""Diagnosis of a configured heart, and the bounds that go with it; docs/physiology.md has their sources."""

from __future__ import annotations

from typing import TYPE_CHECKING

from echotruth.config.defaults import HEART_DEFAULTS
from echotruth.config.physiology import Physiology

if TYPE_CHECKING:
    from echotruth.config.sections import Config

DECISIVE = (
    *("physiology.", "pathology.", "loop.kind", "loop.circulation.", "geometry.preset"),
    *("geometry.hypertrophy", "geometry.dilation", "fibres.disarray_deg"),
)
"""Beginnings of the dotted keys on which the bounds of a heart depend."""

HEALTHY, UNKNOWN = "healthy", "unknown"

Limits = dict[str, float | None]


def _limits(ranges: dict[str, tuple[float, float]], **single: float | None) -> Limits:
    """Limits by their keys: of ranges, whose names stand for `min` and `max`, and single ones."""
    return {name.format(side): r[i] for name, r in ranges.items() for i, side in enumerate(("min", "max"))} | single


_LIVING = _limits(
    {
        "ejection_fraction_{}": (0.1, 0.9),
        "edp_{}_mmHg": (0.0, 40.0),
        "edv_per_mass_{}_mL_per_g": (0.1, 5.0),
        "output_per_mass_{}_mL_per_min_per_g": (15.0, 600.0),
        "twist_ivc_{}_deg": (-15.0, 15.0),
        "twist_es_{}_deg": (-10.0, 30.0),
        "circumferential_strain_{}": (-0.35, -0.01),
        "radial_strain_{}": (0.02, 1.2),
        "segment_circumferential_strain_{}": (-0.4, 0.2),
        "segment_longitudinal_strain_{}": (-0.4, 0.2),
        "gls_{}": (-0.35, -0.02),
        "torsional_shear_{}": (-0.06, 0.2),
        "tei_index_{}": (0.1, 2.0),
        "filling_ratio_{}": (0.2, 6.0),
    },
    edv_of_healthy_min=0.5,
    radial_strain_ivc_max=0.2,
    transmural_shear_ivc_max=0.2,
    level_circumferential_strain_ivc_max=0.15,
    segment_circumferential_strain_ivc_max=0.2,
    level_radial_strain_ivc_max=0.25,
    level_fibre_strain_ivc_max=0.15,
    fibre_shortening_rate_max_per_s=15.0,
    fibre_strain_spread_max=None,
)
"""What any living heart obeys, of whatever species and disease."""
_EVEN = {"level_circumferential_strain_ivc_max": 0.06, "level_fibre_strain_ivc_max": 0.07}
"""Muscle that is activated at once waits for ejection at every level, however weak it is."""
_INFARCT = _LIVING | {
    "ejection_fraction_max": 0.75,
    "edv_of_healthy_min": 0.9,
    "twist_es_min_deg": -5.0,
    "level_circumferential_strain_ivc_max": 0.08,
    "segment_circumferential_strain_ivc_max": 0.1,
    "segment_circumferential_strain_max": 0.1,
    "segment_longitudinal_strain_max": 0.1,
}
_SCAR = _INFARCT | {
    "edv_of_healthy_min": 0.95,
    "level_circumferential_strain_ivc_max": 0.06,
    "segment_circumferential_strain_ivc_max": 0.06,
    "segment_circumferential_strain_max": 0.06,
    "segment_longitudinal_strain_max": 0.06,
}
BOUNDS_OF: dict[str, Limits] = {
    HEALTHY: {},
    UNKNOWN: _LIVING,
    "infarct": _INFARCT,
    "fresh": _SCAR,
    "old": _SCAR,
    "late": _LIVING
    | {
        "ejection_fraction_max": 0.65,
        "edv_of_healthy_min": 0.9,
        "twist_es_min_deg": -5.0,
        "segment_circumferential_strain_max": 0.1,
    },
    "dcm": _LIVING
    | _EVEN
    | {
        "ejection_fraction_max": 0.45,
        "edp_min_mmHg": 8.0,
        "edv_of_healthy_min": 1.2,
        "circumferential_strain_min": -0.16,
        "segment_circumferential_strain_ivc_max": 0.08,
        "segment_circumferential_strain_max": 0.0,
        "segment_longitudinal_strain_max": 0.0,
        "gls_min": -0.18,
    },
    "weak": _LIVING
    | _EVEN
    | {
        "ejection_fraction_max": 0.7,
        "edv_of_healthy_min": 0.98,
        "twist_es_min_deg": 0.0,
        "segment_circumferential_strain_ivc_max": 0.08,
        "segment_circumferential_strain_max": 0.0,
        "segment_longitudinal_strain_max": 0.0,
    },
    "hypertension": {
        "edp_max_mmHg": 25.0,
        "edv_of_healthy_min": 0.8,
        "edv_per_mass_min_mL_per_g": 0.2,
        "output_per_mass_min_mL_per_min_per_g": 25.0,
        "tei_index_max": 1.0,
        "filling_ratio_min": 0.4,
    },
}
"""Diagnosis -> limits that differ from those of the healthy heart. `infarct` is one of no stated age, which may be
minutes old; `late` has a left bundle branch block or a pacemaker; `weak` muscle beats in a healthy circulation."""


def diagnosis(config: Config) -> str:
    """Diagnosis of a heart by its configuration: a key of :data:`BOUNDS_OF`.

    More than one disease, growth or load that belongs to none, and a disease with growth in a measured loop, which
    cannot show it, are unknown.
    """
    infarct, activation, load = config.pathology.infarct, config.pathology.activation, config.loop.circulation
    found: list[str] = []
    if infarct.is_there:
        found.append(infarct.age or "infarct")
    if activation.is_late:
        found.append("late")
    grown = config.geometry.hypertrophy, config.geometry.dilation, config.fibres.disarray_deg
    loaded = load.resistance, load.compliance, load.retained_volume_stroke_volumes
    if config.pathology.preset is not None:
        found.append(config.pathology.preset if config.loop.kind == "circulation" else UNKNOWN)
    elif grown != (1, 1, 0) or loaded != (1, 1, 0) or load.contractility > 1:
        found.append(UNKNOWN)
    elif load.contractility < 1:
        found.append("weak")
    return UNKNOWN if len(found) > 1 else (found or [HEALTHY])[0]


def bounds_of(config: Config) -> Physiology:
    """The bounds on the heart of a configuration: those of its diagnosis, but for keys of `physiology` that are given.

    A key counts as given where it differs from that of the healthy heart of the species.
    """
    given, species = config.physiology, HEART_DEFAULTS.get(config.geometry.preset, {})
    limits = {}
    for key, limit in BOUNDS_OF[diagnosis(config)].items():
        healthy = species.get(f"physiology.{key}", Physiology.model_fields[key].default)
        if getattr(given, key) == healthy:
            limits[key] = limit
    return given.model_copy(update=limits)
