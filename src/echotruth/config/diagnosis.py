"""Findings on a configured heart, from which its diagnosis and bounds follow; docs/physiology.md has the sources."""

from __future__ import annotations

import csv
from pathlib import Path
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

All at their ends change the ejection fraction of the mouse by -.11 to .03, of the human by -.10 to .05 (12 x 6 x 1
elements), where the standard deviation of healthy people is .05 (Petersen 2017, doi 10.1186/s12968-017-0327-9). Both
hearts stay within the healthy bounds, but for the strongest human, whose end-diastolic volume is .943 of the healthy.
"""
WEAK_SEGMENT, STIFF_SEGMENT = 0.75, 2.0
"""Factors on contractility and stiffness of a segment, below and above which it is diseased.

Healthy people shorten by 12.5 to 21.3 % (Venkatesh 2015, doi 10.1002/jmri.24749), down to 3/4 of the middle; an
infarct of a day is twice as stiff (`pathology.infarct.age`).
"""

Limits = dict[str, float | None]


def _bounds() -> dict[str, Limits]:
    """Table of bounds: a row for each key, a column for the findings that its name lists."""
    with Path(__file__).with_name("bounds.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {
        name: {row["key"]: None if row[column] == "null" else float(row[column]) for row in rows if row[column]}
        for column in list(rows[0])[1:]
        for name in column.split()
    }


BOUNDS_OF = _bounds()
"""Finding -> limits that differ from those of the healthy heart.

`unknown` has what any living heart obeys, of whatever species and disease. An `infarct` is of no stated age, and may be
minutes old; `late_activation` is a left bundle branch block or a pacemaker. In all others the muscle is activated at
once and waits for ejection at every level, however weak or loaded it is; every segment of a `weak` heart shortens.
"""
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
