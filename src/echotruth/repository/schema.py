"""All arrays of a repository, which `arrays.csv` lists; `docs/schema.md` is generated from it."""

import csv
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.repository import rounding
from echotruth.repository.array import Array
from echotruth.repository.packing import Pack
from echotruth.section import unit_of

with Path(__file__).with_name("arrays.csv").open(encoding="utf-8", newline="") as _file:
    _ROWS = list(csv.DictReader(_file))


def _listed() -> dict[tuple[str, str], tuple[Array, ...]]:
    """Arrays by the kind of their group and by the pack that holds them, "" for those that stand alone."""
    found: dict[tuple[str, str], tuple[Array, ...]] = {}
    for row in _ROWS:
        step = row["step"]
        quantum = 2.0 ** int(step.removeprefix("2^")) if step.startswith("2^") else step or None
        about = row["type"], row["units"], row["meaning"], quantum, row["values"]
        place = row["group"], row["pack"]
        found[place] = (*found.get(place, ()), Array(row["array"], tuple(row["dimensions"].split()), *about))
    return found


_LISTED = _listed()

KINDS = {group: arrays for (group, pack), arrays in _LISTED.items() if not pack}
"""Arrays by the kind of their group, such as `truth/SIZE`."""

CASES = KINDS.pop("cases")
"""Verdicts on the cases. The group `cases` also holds `seed` and one array for every key that differs among the cases,
in the unit of the key; its attribute `constants` holds the keys that do not."""

COORDINATES = KINDS.pop("coordinates")

DERIVED = KINDS.pop("derived")
"""Arrays that follow from those of a heart; :func:`echotruth.kinematics` computes them."""

SINGLE = {kind: arrays for kind, arrays in KINDS.items() if "/" not in kind and kind != "rf"}
"""Groups that exist once; `rf` exists only if RF is kept."""

SIZED = {kind.partition("/")[0]: arrays for kind, arrays in KINDS.items() if kind.endswith("/SIZE")}
"""Groups that exist once per image size, and are named after it: `truth/512`."""

TRACKED = {kind.partition("/")[0]: arrays for kind, arrays in KINDS.items() if kind.endswith("/TRACKER")}
"""Groups that exist once per image size and tracker: `tracking/512/dis`."""

INFERENCE = {kind: arrays for kind, arrays in KINDS.items() if kind.startswith("inference/")}
"""Groups that exist once if a tracker is named to infer from, those of ArviZ's InferenceData among them."""

CHAINS, DRAWS = 1, 512
"""Of what is inferred; draws do not depend on each other, so that one chain has them all."""

PACKS = {
    kind: tuple(Pack(array, _LISTED[kind, array.name]) for array in arrays if (kind, array.name) in _LISTED)
    for kind, arrays in KINDS.items()
}
"""Arrays that hold several others, by the kind of their group."""

LABELS = {row["array"]: tuple(row["labels"].split()) for row in _ROWS if row["labels"]}
"""Labels of the dimensions that are the same in every repository."""


def kind(group: str) -> str:
    """Kind of a group: of `tracking/512/dis`, `tracking/SIZE/TRACKER`."""
    if group in INFERENCE:
        return group
    stage, *rest = group.split("/")
    return "/".join([stage, *("SIZE", "TRACKER")[: len(rest)]])


def arrays_of(group: str) -> tuple[Array, ...]:
    """Arrays of a group, as "bmode/512"."""
    return KINDS[kind(group)]


def packs_of(group: str) -> tuple[Pack, ...]:
    """Packs of a group, as "evaluation/512/dis"."""
    return PACKS.get(kind(group), ())


def parameters(columns: dict[str, NDArray[Any]]) -> tuple[Array, ...]:
    """Arrays of the group `cases` for the columns of the table of cases."""
    types = {"f": "float64", "i": "int64", "b": "bool"}
    arrays = [
        Array(key, ("case",), types.get(values.dtype.kind, "string"), unit_in_store(key), key)
        for key, values in ((name.removeprefix("cases:"), values) for name, values in columns.items())
    ]
    return (*CASES, *arrays)


def unit_in_store(key: str) -> str:
    """Unit of a key, as UDUNITS writes it."""
    return _UNITS.get(unit_of(key), "1")


_UNITS = {unit: unit for unit in ("um", "mm", "uL", "ms", "mmHg", "kPa", "MHz", "dB")}
_UNITS |= {"per_mm3": "mm-3", "per_min": "min-1", "m_per_s": "m s-1", "deg": "degree"}


def groups(config: Config) -> dict[str, tuple[Array, ...]]:
    """Arrays of every group, without coordinates, by the path of the group; each quantum is a number."""
    sizes, trackers = config.bmode.sizes, config.tracking.trackers
    every = {"cases": CASES} | SINGLE
    every |= {f"{name}/{size}": arrays for name, arrays in SIZED.items() for size in sizes}
    every |= {f"{name}/{size}/{one}": arrays for name, arrays in TRACKED.items() for size in sizes for one in trackers}
    every |= {"rf": rf_arrays(config)} if config.rf.keep else {}
    every |= INFERENCE if config.inference.tracker else {}
    return {path: rounding.of(arrays, config) for path, arrays in every.items()}


def observations(config: Config) -> list[str]:
    """Labels of what may be seen at end-systole: strain along the wall of segments 1..16, and rotation in a short axis,
    as `mid 7` and `mid rotation`."""
    places = [*range(1, 17), "rotation"]
    return [
        f"{name} {place}"
        for name, view in config.views.items()
        for place in (places if view.plane == "short_axis" else places[:-1])
    ]


def units_of_observations(config: Config) -> list[str]:
    """Units of what may be seen, in the order of its labels."""
    return ["rad" if label.endswith("rotation") else "1" for label in observations(config)]


def rf_arrays(config: Config) -> tuple[Array, ...]:
    """Arrays of the group `rf`: the RF that is kept, and the transmitted waves from which the lines are made."""
    return tuple(array for array in KINDS["rf"] if array.name.startswith((*config.rf.keep, "transmit_")))


def written_by(stage: str, config: Config, size: int | None = None) -> list[str]:
    """Groups that a job of a stage writes.

    Parameters
    ----------
    stage : str
    config : Config
    size : int, optional
        Image size of the job, px; without it, the groups of all sizes.
    """
    sizes = config.bmode.sizes if size is None else [size]
    if stage == "mechanics":
        return [group for group, arrays in SINGLE.items() if arrays[0].leading == 1]
    if stage == "tracking":
        of_trackers = [f"{name}/{px}/{one}" for name in TRACKED for px in sizes for one in config.tracking.trackers]
        return [f"evaluation/{px}" for px in sizes] + of_trackers
    if stage == "inference":
        return [*INFERENCE] if config.inference.tracker else []
    if stage in SIZED:
        return [f"{stage}/{px}" for px in sizes]
    return [stage] if stage in SINGLE or (stage == "rf" and config.rf.keep) else []


def holders(group: str) -> dict[str, str]:
    """Name of each member of the packs of a group -> array that holds it."""
    return {member: pack.array.name for pack in packs_of(group) for member in pack.names}


def named(group: str) -> tuple[Array, ...]:
    """Arrays of a group by the names that jobs and readers use: the members of a pack in place of the pack."""
    members = {pack.array.name: pack.members for pack in packs_of(group)}
    return tuple(one for array in arrays_of(group) for one in members.get(array.name, (array,)))


def coordinates(arrays: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coordinates of a group: those along the dimensions of its arrays."""
    dims = {dim for array in arrays for dim in array.dims}
    names = {array.name for array in arrays}
    return tuple(array for array in COORDINATES if dims >= set(array.dims) and array.name not in names)
