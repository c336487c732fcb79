"""All arrays of a repository, which `arrays.csv` lists; `docs/schema.md` is generated from it."""

import csv
from pathlib import Path

from echotruth.config import Config
from echotruth.repository.array import Array

with Path(__file__).with_name("arrays.csv").open(encoding="utf-8", newline="") as _file:
    _ROWS = list(csv.DictReader(_file))


def _array(row: dict[str, str]) -> Array:
    step = row["step"]
    quantum = 2.0 ** int(step.removeprefix("2^")) if step.startswith("2^") else step or None
    about = row["type"], row["units"], row["meaning"], quantum, row["values"]
    return Array(row["array"], tuple(row["dimensions"].split()), *about)


KINDS = {
    kind: tuple(_array(row) for row in _ROWS if row["group"] == kind)
    for kind in dict.fromkeys(row["group"] for row in _ROWS)
}
"""Arrays by the kind of their group, such as `truth/SIZE`."""

OF_VOLUMES = " (volumes)"
"""End of the name of a kind of group that has other arrays where views are volumes."""

COORDINATES = {array.name: array for array in KINDS.pop("coordinates")}
"""Coordinates by their name; a group has those along the dimensions of its arrays."""

DERIVED = KINDS.pop("derived")
"""Arrays that follow from those of a heart; :func:`echotruth.kinematics` computes them."""

SCORES = {array.name: array for array in KINDS.pop("scores")}
"""Scores of a tracker on a clip by their names; the array `scores` has the numbers of all, one after another."""

HEART = ("geometry", "fibres", "pathology", "mechanics", "kinematics", "physiology")
"""Groups of a heart, which the stage mechanics writes."""

CHAINS, DRAWS = 1, 512
"""Of what is inferred; draws do not depend on each other, so that one chain has them all."""

LABELS = {row["array"]: tuple(row["labels"].split()) for row in _ROWS if row["labels"]}
"""Labels of the dimensions that are the same in every repository."""


def kind(group: str, has_volumes: bool = False) -> str:
    """Kind of a group: of `truth/512`, `truth/SIZE`; of `tracking/dis`, `tracking/TRACKER` or that of volumes."""
    stage, _, name = group.partition("/")
    found = f"{stage}/SIZE" if name.isdigit() else "tracking/TRACKER" if name and stage == "tracking" else group
    return f"{found}{OF_VOLUMES}" if has_volumes and f"{found}{OF_VOLUMES}" in KINDS else found


def arrays_of(group: str, has_volumes: bool = False) -> dict[str, Array]:
    """Arrays of a group, as "bmode/512", by their names."""
    return {array.name: array for array in KINDS[kind(group, has_volumes)]}


def names_of(group: str) -> list[str]:
    """Names of the arrays that a group may have, of slices or of volumes."""
    return list(arrays_of(group) | arrays_of(group, has_volumes=True))


def observations(config: Config) -> list[str]:
    """Labels of what may be seen at end-systole: strain along the wall of segments 1..16, and rotation in a short axis,
    as `mid 7` and `mid rotation`."""
    places = [*range(1, 17), "rotation"]
    return [
        f"{name} {place}"
        for name, view in config.views.items()
        for place in (places if view.plane == "short_axis" else places[:-1])
    ]
