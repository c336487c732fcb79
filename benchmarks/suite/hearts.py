"""Hearts of the suite and how each is imaged.

Kinds are mixed over the parts. A heart is drawn again, with its next attempt, until it is solved and within the bounds
of its diagnosis (docs/physiology.md). The ranges of shape and fibres are those of `cases.draw.preset: hearts`
(docs/cases.md); levels are drawn about those of the realism presets.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from hashlib import sha256
from math import ceil
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import echotruth as et
from echotruth.cases import Case
from echotruth.config.cases import HEARTS
from echotruth.config.diagnosis import bounds_of
from echotruth.config.merging import merged, nested
from echotruth.heart import Heart
from echotruth.mechanics.beat import simulate
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.physiology import measured_heart
from echotruth.repository.code import PACKAGE
from echotruth.repository.datasets import as_stored
from echotruth.repository.version import Versions, settings_hash
from echotruth.section import value_of

SEED, HEARTS_OF_PART, ATTEMPTS = 3, 8, 20
HUMAN_SCALE = 12.5
"""Length of a human heart over that of a mouse."""

PLAN: dict[tuple[str, str], dict[str, int]] = {
    ("develop", "mouse"): {"healthy": 3, "infarct": 3, "late_activation": 1, "hypertrophy": 1, "dilation": 2},
    ("develop", "human"): {"healthy": 2, "infarct": 2, "late_activation": 1, "dilation": 1},
    ("test", "mouse"): {"healthy": 12, "infarct": 16, "late_activation": 7, "hypertrophy": 6, "dilation": 7},
    ("test", "human"): {"healthy": 4, "infarct": 5, "late_activation": 3, "hypertrophy": 2, "dilation": 2},
}
"""Split and species -> number of hearts of each group."""
BLOCKS = ([("develop", "mouse"), ("develop", "human")], [("test", "mouse")], [("test", "human")])
"""What shares parts."""
CONDITIONS = ("none", "shadow", "ideal", "motion", "low_rate", "shadow", "motion", "ideal")
"""Conditions, which the hearts of each group take in turn, so that all diseases are seen in all of them. `ideal` is a
heart without a condition that is imaged with ideal acoustics too."""

SETTINGS: dict[str, Any] = {
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2},
    "loop": {"kind": "circulation"},
    "rf": {"focal_zones": 5, "lines": 192},
    "probe": {"elements": 64},
    "bmode": {"size_px": 256, "downsampling": (1, 2)},
    "views": {"mid": {"plane": "short_axis"}, "long_axis": {"plane": "long_axis"}},
}
"""Of every case."""
OF_SPECIES: dict[str, dict[str, Any]] = {
    "mouse": {"loop.frames": 20, "tracking.grid": 0.016},
    "human": {"loop.frames": 40, "tracking.grid": 0.008},
}
"""Frames of a beat, in people 40 to 58 a second, and distance of the points over the side of the image: the wall of
people is thinner in theirs."""

TRACKERS: dict[str, dict[str, Any]] = {
    "as_published": {"method": "phase_correlation"},
    "corrected": {
        "method": "phase_correlation",
        "window_px": None,
        "taper": "hann",
        "spectral_threshold": 0.01,
        "reference": "bidirectional",
    },
    "window_deformation": {"method": "window_deformation"},
    "affine_dic": {"method": "external", "track": "examples.affine_dic:track"},
    "farneback": {"method": "external", "track": "examples.farneback:track"},
    "block_matching": {"method": "external", "track": "examples.block_matching:track"},
    "dis": {"method": "dis"},
    "dis_fine": {"method": "dis", "preset": "fine"},
    "bspline_dic": {"method": "bspline_dic"},
    "bspline_cnn": {"method": "bspline_cnn"},
}
Keys = dict[str, Any]
"""Dotted key -> value, or a range (tuple) or choices (list) from which it is drawn."""

LENGTHS_MM: dict[str, Keys] = {
    "corrected": {"window_mm": 1.5},
    "affine_dic": {"options": {"subset_mm": 1.0}},
    "farneback": {"options": {"window_mm": 1.0}},
    "block_matching": {"options": {"block_mm": 1.0}},
}
"""Settings of trackers that are lengths in the wall of a mouse."""

FILES = (
    *(Path(__file__).parent / f"{name}.py" for name in ("hearts", "scores", "columns")),
    *(PACKAGE / f"config/{name}" for name in ("diagnosis.py", "bounds.csv")),
    *(Path(__file__).parents[2] / f"examples/{name}.py" for name in ("affine_dic", "farneback", "block_matching")),
)
"""Files on which the numbers depend, beside those that the version of a view counts."""

SHAPE: Keys = {
    key: tuple(given["uniform"]) for key, given in HEARTS.items() if "uniform" in given and not key.startswith("loop.")
}
HEART_RATE = {"mouse": (420, 560), "human": (58, 90)}


def _infarct(**keys: Any) -> Keys:
    return {f"pathology.infarct.{key}": value for key, value in keys.items()}


KINDS: dict[str, list[Keys]] = {
    "healthy": [{}],
    "infarct": [
        _infarct(radius_mm=(0.5, 0.8), position=(0.4, 0.6), azimuth_deg=(-180, 180), age="fresh"),
        _infarct(segments=[[7, 8, 12], [8, 9, 14], [10, 11, 15]], age="fresh", transmurality=(0.2, 0.5)),
        _infarct(segments=[[7, 8], [9, 10], [11, 12]], age="old"),
        _infarct(segments=[[7, 12, 13], [8, 9, 14], [10, 11, 15]], age="old", transmurality=(0.2, 0.5)),
        _infarct(segments=[[1, 7, 8, 13, 14], [5, 6, 11, 12, 16]], age="fresh", remote_tension_scale=(0.75, 1)),
        _infarct(
            segments=[[7, 8], [9, 10], [11, 12]], transmurality=(0.2, 0.5), tension_scale=(0, 0.5), border_mm=(0, 0.3)
        ),
        _infarct(segments=[[13, 14, 15, 16, 17], [8, 9, 14, 17]], age="old", border_mm=(0, 0.3)),
        _infarct(segments=[[7, 8, 13], [9, 10, 15], [11, 12, 16]], age="fresh", transmurality=(0.2, 0.5)),
    ],
    "late_activation": [
        {"pathology.activation.preset": "lbbb"},
        {"pathology.activation.preset": "rv_pacing"},
        {"pathology.activation.sites": [[{"position": 0.5, "azimuth_deg": 180, "depth": 1}]]},
    ],
    "hypertrophy": [
        {"pathology.preset": "hypertension"},
        {"geometry.hypertrophy": (1.1, 1.3), "loop.circulation.resistance": (1.1, 1.4)},
    ],
    "dilation": [
        {"pathology.preset": "dcm"},
        {"geometry.dilation": (1.03, 1.1), "loop.circulation.contractility": (0.6, 0.85)},
    ],
}
"""Group -> keys of its kinds, which take turns; lengths are those of a mouse."""

POSE: Keys = {
    "views.mid.position": (0.44, 0.56),
    "views.mid.angle_deg": (-15, 15),
    "views.long_axis.rotation_deg": (15, 45),
    "views.long_axis.angle_deg": (-10, 10),
}
LOOK: Keys = {
    "probe.attenuation_dB_per_cm_MHz": (-0.06, 0.06),
    "realism.backscatter.anisotropy_dB": (-3, 3),
    "realism.borders.endocardium_dB": (-3, 3),
    "realism.borders.epicardium_dB": (-3, 3),
    "realism.blood.level_dB": (-3, 4),
    "realism.surroundings.level_dB": (-3, 2),
    "realism.noise.snr_dB": (-8, 4),
    "realism.haze.level_dB": (-3, 3),
    "bmode.dynamic_range_dB": (-3, 5),
    "bmode.gain_dB": (-2, 3),
    "bmode.grey_gamma": (-0.4, 0.1),
}
"""What is added to the levels of the preset."""

MOTIONS: list[Keys] = [
    {"rocking_deg": (-4, 4)},
    {"drift.lateral_mm": (-0.25, 0.25), "drift.axial_mm": (-0.2, 0.2), "drift.elevation_mm": (-0.15, 0.15)},
    {"breathing.axial_mm": (0.3, 0.6), "breathing.elevation_mm": (0, 0.3), "breathing.phase_deg": (0, 360)},
]
SHADOW: dict[str, Keys] = {
    "mouse": {"side": ["left", "right"], "edge_deg": (12, 22), "edge_width_mm": 0.8, "level_dB": (-30, -10)},
    "human": {"edge_deg": (10, 16), "level_dB": (-20, -10)},
}
"""A rib; people have a faint one at the right by their preset."""


class SuiteCase(NamedTuple):
    """A case, and the columns of :data:`.columns.IDENTITY` that do not depend on the clip."""

    case: Case
    sorts: dict[str, Any]


def cases_of(row: Mapping[str, Any], attempt: int, trackers: dict[str, Any] | None = None) -> list[SuiteCase]:
    """The realistic case of a heart, and its ideal one if it has one.

    Parameters
    ----------
    row : mapping
        Of the plan.
    attempt : int
        That gives the heart.
    trackers : dict, optional
        By name, as in a configuration. Default: those of the suite.
    """
    names = ("realistic", "ideal") if row["condition"] == "ideal" else ("realistic",)
    motion = motion_keys(row, attempt)
    return [_case(row, acoustics, motion, trackers) for acoustics in names]


def _case(row: Mapping[str, Any], acoustics: str, motion: Keys, trackers: dict[str, Any] | None) -> SuiteCase:
    name, condition = f"{row['heart']}_{acoustics}", row["condition"].replace("ideal", "none")
    random = Random(f"{SEED} {row['heart']} images")
    keys = motion | {"name": name, "seed": random.randrange(1, 10**6)} | drawn(POSE, random)
    keys["realism.preset"] = row["species"] if acoustics == "realistic" else "none"
    config = configured(row["species"], keys, trackers)
    if acoustics == "realistic":
        keys |= {key: round(value_of(config, key) + more, 4) for key, more in drawn(LOOK, random).items()}
        config = configured(row["species"], keys | _condition(row["species"], condition, random), trackers)
    (case,) = et.expand(config)
    disease = "healthy" if row["group"] == "healthy" else "diseased"
    sorts = {key: row[key] for key in ("part", "split", "species", "heart", "group")}
    return SuiteCase(case, sorts | {"disease": disease, "acoustics": acoustics, "variation": condition, "case": name})


def _condition(species: str, condition: str, random: Random) -> Keys:
    """Keys of a condition of imaging."""
    if condition == "motion":
        motion = _scaled(species, drawn(random.choice(MOTIONS), random))
        return {f"views.{view}.motion.{key}": value for view in SETTINGS["views"] for key, value in motion.items()}
    if condition == "shadow":
        return {f"realism.shadow.{key}": value for key, value in drawn(SHADOW[species], random).items()}
    return {"tracking.frame_step": 2} if condition == "low_rate" else {}


def configured(species: str, keys: Keys, trackers: dict[str, Any] | None = None) -> et.Config:
    """Configuration of a clip: the settings of every case, and keys; trackers are those of the suite by default."""
    if trackers is None:
        lengths = {name: _scaled(species, given) for name, given in LENGTHS_MM.items()}
        trackers = {name: given | lengths.get(name, {}) for name, given in TRACKERS.items()}
    settings = SETTINGS | {"tracking": {"trackers": trackers}}
    own = {"geometry.preset": species} | OF_SPECIES[species]
    return et.configure(merged(settings, nested(own | keys), whole=()))


def drawn(keys: Keys, random: Random) -> Keys:
    """Values of keys: ranges and choices are drawn from, others stay."""
    return {key: _drawn(value, random) for key, value in keys.items()}


def _drawn(value: Any, random: Random) -> Any:
    if isinstance(value, tuple):
        return float(f"{random.uniform(*value):.4g}")
    return random.choice(value) if isinstance(value, list) else value


def _scaled(species: str, keys: Keys) -> Keys:
    """Lengths of a mouse as those of a species."""
    factor = HUMAN_SCALE if species == "human" else 1

    def scaled(key: str, value: Any) -> Any:
        if isinstance(value, dict):
            return _scaled(species, value)
        return round(factor * value, 4) if key.endswith("_mm") else value

    return {key: scaled(key, value) for key, value in keys.items()}


def plan(blocks: Iterable[list[tuple[str, str]]] = BLOCKS) -> list[dict[str, Any]]:
    """Hearts, a row each: part, split, species, heart, group, kind and condition."""
    rows: list[dict[str, Any]] = []
    for block in blocks:
        of_block = [row for key in block for row in _planned(*key)]
        of_block.sort(key=lambda row: row.pop("place"))
        parts, first = ceil(len(of_block) / HEARTS_OF_PART), rows[-1]["part"] + 1 if rows else 1
        rows += [{"part": first + k * parts // len(of_block)} | row for k, row in enumerate(of_block)]
    return rows


def _planned(split: str, species: str) -> Iterable[dict[str, Any]]:
    """Hearts of a split and species; `place` spreads those of each group evenly from 0 to 1."""
    groups = PLAN[split, species]
    before = list(PLAN)[: list(PLAN).index((split, species))]
    first = 1 + sum(sum(PLAN[key].values()) for key in before if key[1] == species)
    for turn, (group, count) in enumerate(groups.items()):
        for k in range(count):
            # Each round begins elsewhere, lest a kind always have the same condition.
            condition = CONDITIONS[(k + turn + 3 * (k // len(CONDITIONS))) % len(CONDITIONS)]
            row = {"split": split, "species": species, "heart": f"{species}{first:02d}", "group": group}
            yield row | {"kind": k % len(KINDS[group]), "condition": condition, "place": (k + 0.5) / count}
            first += 1


@cache
def suite_version() -> str:
    """Hash of the code that decides the numbers, and of the configurations of all hearts at their first attempt."""
    configs = [one.case.config for row in plan() for one in cases_of(row, 1)]
    versions = [
        of_case.of("tracking", view, tracker)
        for config, of_case in ((config, Versions(config)) for config in configs)
        for view in config.views
        for tracker in config.tracking.trackers
    ]
    return settings_hash(*(sha256(file.read_bytes()).hexdigest() for file in FILES), *versions)


def motion_keys(row: Mapping[str, Any], attempt: int) -> Keys:
    """Keys on which the motion of a heart depends, in one attempt to draw it."""
    keys = SHAPE | {"loop.heart_rate_per_min": HEART_RATE[row["species"]]} | KINDS[row["group"]][row["kind"]]
    return _scaled(row["species"], drawn(keys, Random(f"{SEED} {row['heart']} {attempt}")))


def usable_heart(row: Mapping[str, Any]) -> tuple[int, Heart]:
    """The first attempt that gives a heart within the bounds of its diagnosis, and the heart, as a repository has it.

    Raises
    ------
    ValueError
        If none of `ATTEMPTS` does.
    """
    reasons = []
    for attempt in range(1, ATTEMPTS + 1):
        config = configured(row["species"], motion_keys(row, attempt))
        try:
            arrays = simulate(config)
            arrays["physiology"], bounded = measured_heart(arrays, config)
            reasons.append(violation(bounded, bounds_of(config)))
        except ValueError as error:  # of which all refusals of a heart are kinds
            reasons.append(str(error))
        if not reasons[-1]:
            return attempt, Heart.of(as_stored(Case("heart", {}, config), arrays), config)
    raise ValueError(f"{row['heart']}: no attempt is usable ({'; '.join(reasons)}): narrow the ranges of its kind")
