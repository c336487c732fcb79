"""Findings on a configured heart, from which its diagnosis and bounds follow; docs/physiology.md has the sources."""

from __future__ import annotations

from typing import TYPE_CHECKING

from echotruth.config.defaults import HEART_DEFAULTS
from echotruth.config.physiology import Physiology

if TYPE_CHECKING:
    from echotruth.config.loop import Circulation
    from echotruth.config.sections import Config

DECISIVE = (
    *("diagnosis", "physiology.", "pathology.", "loop.kind", "loop.circulation.", "geometry.preset", "geometry.file"),
    *("geometry.hypertrophy", "geometry.dilation", "fibres.disarray_deg"),
)
"""Beginnings of the columns of the table of cases on which the bounds of a heart depend."""

NORMAL, NORMAL_VOLUME = (0.9, 1.1), 0.5
"""Factors on strength and load, and retained volume in stroke volumes either way, that healthy hearts have.

All at their ends change the ejection fraction of the mouse by -.04 to .01, of the human by -.06 to .01 (12 x 6 x 1
elements), where the standard deviation of healthy people is .05 (Petersen 2017, doi 10.1186/s12968-017-0327-9), and
both hearts stay within the healthy bounds.
"""
WEAK_SEGMENT, STIFF_SEGMENT = 0.75, 2.0
"""Factors on contractility and stiffness of a segment, below and above which it is diseased.

Healthy people shorten by 12.5 to 21.3 % (Venkatesh 2015, doi 10.1002/jmri.24749), down to 3/4 of the middle; an
infarct of a day is twice as stiff (`pathology.infarct.age`).
"""

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
_EVEN = _LIVING | {
    "level_circumferential_strain_ivc_max": 0.06,
    "level_fibre_strain_ivc_max": 0.07,
    "segment_circumferential_strain_ivc_max": 0.08,
}
"""Muscle that is activated at once waits for ejection at every level, however weak or loaded it is."""
_SHORTENS = {"segment_circumferential_strain_max": 0.0, "segment_longitudinal_strain_max": 0.0}
"""Every segment shortens."""
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
_PRESSED: Limits = {
    "edp_max_mmHg": 25.0,
    "edv_of_healthy_min": 0.8,
    "edv_per_mass_min_mL_per_g": 0.2,
    "output_per_mass_min_mL_per_min_per_g": 25.0,
    "tei_index_max": 1.0,
    "filling_ratio_min": 0.4,
}
BOUNDS_OF: dict[str, Limits] = {
    "infarct": _INFARCT,
    "fresh_infarct": _SCAR,
    "old_infarct": _SCAR,
    "late_activation": _LIVING
    | {
        "ejection_fraction_max": 0.65,
        "edv_of_healthy_min": 0.9,
        "twist_es_min_deg": -5.0,
        "segment_circumferential_strain_max": 0.1,
    },
    "dcm": _EVEN
    | _SHORTENS
    | {
        "ejection_fraction_max": 0.45,
        "edp_min_mmHg": 8.0,
        "edv_of_healthy_min": 1.2,
        "circumferential_strain_min": -0.16,
        "gls_min": -0.18,
    },
    "hypertension": _PRESSED,
    "weak": _EVEN | _SHORTENS | {"ejection_fraction_max": 0.7, "edv_of_healthy_min": 0.98, "twist_es_min_deg": 0.0},
    "hyperdynamic": _EVEN,
    "abnormal_load": _EVEN,
    "hypertrophy": _PRESSED,
    "dilation": _EVEN,
    "remodelling": _LIVING,
    "disarray": _LIVING,
    "hypokinesia": _LIVING,
    "fibrosis": _LIVING,
    "unknown": _LIVING,
}
"""Finding -> limits that differ from those of the healthy heart. An `infarct` is of no stated age, and may be minutes
old; `late_activation` is a left bundle branch block or a pacemaker."""
PARTS = {"dcm": ("weak", "abnormal_load", "dilation"), "hypertension": ("abnormal_load", "hypertrophy")}
"""`pathology.preset` -> findings that it includes."""


def findings(config: Config) -> tuple[str, ...]:
    """What is found in a heart by its configuration: keys of :data:`BOUNDS_OF`, none in a healthy heart.

    `weak`, `hyperdynamic` and `abnormal_load` are beyond :data:`NORMAL`; `hypertrophy` and `dilation` are factors above
    1 on the healthy heart, `remodelling` one below; healthy hearts differ by their lengths, `scale` and `elongation`.
    `hypokinesia` and `fibrosis` are segments beyond :data:`WEAK_SEGMENT` and :data:`STIFF_SEGMENT`. A shape from a file
    with none of them is `unknown`.
    """
    pathology, geometry, regional = config.pathology, config.geometry, config.mechanics.regional
    load, disease = config.loop.circulation, pathology.preset or ""
    applies = {
        f"{pathology.infarct.age or ''}_infarct".lstrip("_"): pathology.infarct.is_there,
        "late_activation": pathology.activation.is_late,
        disease: bool(disease),
        "weak": load.contractility < NORMAL[0],
        "hyperdynamic": load.contractility > NORMAL[1],
        "abnormal_load": _is_abnormal(load),
        "hypertrophy": geometry.hypertrophy > 1,
        "dilation": geometry.dilation > 1,
        "remodelling": min(geometry.hypertrophy, geometry.dilation) < 1,
        "disarray": config.fibres.disarray_deg > 0,
        "hypokinesia": min(regional.contractility.values(), default=1.0) < WEAK_SEGMENT,
        "fibrosis": max(regional.stiffness.values(), default=1.0) > STIFF_SEGMENT,
    }
    found = tuple(name for name, is_so in applies.items() if is_so and name not in PARTS.get(disease, ()))
    return found or (("unknown",) if geometry.file else ())


def _is_abnormal(load: Circulation) -> bool:
    low, high = NORMAL
    beyond = (not low <= factor <= high for factor in (load.resistance, load.compliance))
    return any(beyond) or abs(load.retained_volume_stroke_volumes) > NORMAL_VOLUME


def diagnosis(config: Config) -> str:
    """The findings joined by +, an infarct of any age as `infarct`; `healthy` if there are none."""
    return "+".join(findings(config)).removeprefix(f"{config.pathology.infarct.age}_") or "healthy"


def bounds_of(config: Config) -> Physiology:
    """The bounds on the heart of a configuration: those of its findings, but for keys of `physiology` that are given.

    Of several findings the loosest limit holds, since each allows the heart what it does; of none the healthy ones. A
    key counts as given where it differs from that of the healthy heart of the species.
    """
    given, species = config.physiology, HEART_DEFAULTS.get(config.geometry.preset, {})
    rows, limits = [BOUNDS_OF[name] for name in findings(config)], {}
    for key in {key for row in rows for key in row}:
        healthy = species.get(f"physiology.{key}", Physiology.model_fields[key].default)
        if getattr(given, key) == healthy:
            limits[key] = _loosest(key, [row.get(key, healthy) for row in rows])
    return given.model_copy(update=limits)


def _loosest(key: str, limits: list[float | None]) -> float | None:
    known = [limit for limit in limits if limit is not None]
    if len(known) < len(limits):
        return None
    return max(known) if "_max" in key else min(known)
