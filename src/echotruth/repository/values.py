"""What the values of a job must be: finite where they mean something, in the range of their quantity, and physical.

A fault that is found here stands in bytes that are as their job wrote them: it is one of the code or of its settings.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.imaging.labels import TissueLabel, unpack
from echotruth.repository import rounding, schema, scores

Arrays = dict[str, NDArray[Any]]
"""Arrays of a group by name."""


@dataclass(frozen=True)
class Range:
    """What the values of an array may be, in its unit; never infinite."""

    low: float = -inf
    high: float = inf
    finite: bool = False
    """Whether every value must be a number."""


COMPLEMENT = 1e-6
"""Rounding of a fraction near 0 or 1, and of the length of a unit vector, in single precision."""

OVERSHOOT = 0.05
"""Largest excess over 0 to 1 of the wall depth, a Laplace solution, interpolated by quadratic functions."""

RANGES = {
    "": Range(finite=True),
    # A measure that a heart does not have, or a force of a prescribed motion, is not a number.
    "any": Range(),
    "not negative": Range(low=0, finite=True),
    "positive": Range(low=np.finfo(float).tiny, finite=True),
    # A prescribed motion may have no cavity.
    "volume": Range(low=np.finfo(float).tiny),
    # An RMS, or a ratio of two; not a number where there is nothing to average.
    "magnitude": Range(low=0),
    "fraction": Range(0, 1, finite=True),
    "correlation": Range(-1 - COMPLEMENT, 1 + COMPLEMENT),
    "quality": Range(-COMPLEMENT, 1 + COMPLEMENT),
    # To 2 in the free wall of a right ventricle.
    "depth": Range(-COMPLEMENT, 2 + COMPLEMENT, finite=True),
    "interpolated depth": Range(-OVERSHOOT, 1 + OVERSHOOT),
    "layer": Range(1),
    "segment": Range(0, 17),
    "region": Range(0, 3),
    "tissue": Range(0, max(TissueLabel)),
    "phase": Range(0, 3),
}
"""What the values of an array may be, by the column `values` of arrays.csv."""

LOWEST_STRAIN = -0.5 - rounding.STRAIN
"""E = (F^T F - I) / 2 along an axis is above -1/2, because F^T F is positive; with the rounding of the store."""

NORMAL_STRAINS = {"kinematics": {"strain": 3}, "truth": {"strain": 3}, "points": {"true_strain": 2}}
"""Number of leading components that are strains along an axis."""


def faults(group: str, arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    """What is wrong with the values of a group.

    Parameters
    ----------
    group : str
        As "truth/512".
    arrays : dict of ndarray
        All arrays of the group.
    config : Config
        Configuration of the case.

    Yields
    ------
    name, problem : str
        Name of the array, and what is wrong with it.
    """
    stage, kind = group.partition("/")[0], schema.kind(group, config.has_volumes)
    kinds = {name: array.values for name, array in schema.arrays_of(group, config.has_volumes).items()}
    for name, values in arrays.items():
        for problem in _in_range(values, RANGES[kinds[name]]):
            yield name, problem
    for name, count in NORMAL_STRAINS.get(stage, {}).items():
        if name in arrays and bool((arrays[name][..., :count] < LOWEST_STRAIN).any()):
            yield name, "has a strain below -1/2 along an axis"
    yield from _labels(arrays, config)
    if kind in RELATIONS:
        yield from RELATIONS[kind](arrays, config)


def _in_range(values: NDArray[Any], range: Range) -> Iterator[str]:
    if values.dtype.kind in "fc" and not np.isfinite(values).all():
        if np.isinf(values).any():
            yield "has infinite values"
        elif range.finite:
            yield "has values that are not numbers"
    if range.low > -inf and bool((values < range.low).any()):
        yield f"has a value of {np.nanmin(values):g}, below {range.low:g}"
    if range.high < inf and bool((values > range.high).any()):
        yield f"has a value of {np.nanmax(values):g}, above {range.high:g}"


def _labels(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    layers = config.fibres.layers
    if "layer" in arrays and int(arrays["layer"].max(initial=0)) > layers:
        yield "layer", f"has a layer of {arrays['layer'].max()}, but fibres.layers is {layers}"
    frames = config.loop.frames
    if "es_frame" in arrays and int(arrays["es_frame"]) >= frames:
        yield "es_frame", f"is {int(arrays['es_frame'])}, but loop.frames is {frames}"


def _geometry(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    nodes = len(arrays["node_position"])
    for name in sorted({"cell_node", "endo", "epi", "base", "right_endo"} & arrays.keys()):
        if int(arrays[name].max(initial=0)) >= nodes:
            yield name, f"names node {arrays[name].max()} of {nodes}"


def _fibres(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    if not config.geometry.has_right_ventricle and arrays["wall_depth"].max(initial=0) > 1 + COMPLEMENT:
        yield "wall_depth", "has a value above 1, although there is no right ventricle"
    for name in ("fibre", "sheet"):
        if not _is_one(np.linalg.norm(arrays[name], axis=-1)):
            yield name, "has vectors whose length is not 1"
    if not _is_one(1 + np.sum(arrays["fibre"] * arrays["sheet"], axis=-1)):
        yield "sheet", "has sheets that are not normal to the fibres"


def _mechanics(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    if config.motion.kind != "beat":
        return
    for name in ("pressure", "volume", "active_tension", "residual", "stiffness"):
        if not np.isfinite(arrays[name]).all():
            yield name, "has values that are not numbers, although the heart is solved"


def _kinematics(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    if np.abs(arrays["strain"][0]).max(initial=0) > COMPLEMENT:
        yield "strain", "is not 0 at end-diastole, from which it is taken"


def _phantom(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    axes = arrays["axes"]
    if not np.allclose(axes @ axes.T, np.eye(3), atol=COMPLEMENT):
        yield "axes", "are not unit vectors normal to each other"


def _truth(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    mask = unpack(arrays["labels"])["mask"]
    for name in ("displacement", "strain", "wall_depth"):
        known = np.isfinite(arrays[name])
        if bool(((known.all(-1) if known.ndim > mask.ndim else known) != mask).any()):
            yield name, "is not a number in a pixel of the wall, or is one outside"
    yield from _wall_labels(arrays, config)
    if "tissue" in arrays and bool(((arrays["tissue"] == TissueLabel.WALL) != mask).any()):
        yield "tissue", "is not the wall in a pixel of the wall, or is it outside"
    if bool((np.isfinite(arrays["flow"]).all(-1) != _has_flow(mask)).any()):
        yield "flow", "is not a number in a pixel of the wall from which there is a frame, or is one elsewhere"
    yield from _still_at_ed("displacement", arrays)


def _wall_labels(arrays: Arrays, config: Config, dims: int = 2) -> Iterator[tuple[str, str]]:
    label = unpack(arrays["labels"], dims)
    mask = label["mask"]
    if bool(((label["segment"] > 0) != mask).any()) or bool(label["region"][~mask].any()):
        yield "labels", "has a pixel of the wall without a segment, or a segment or region outside"
    for name, highest in {"layer": config.fibres.layers, "segment": 17, "region": 3}.items():
        if label[name].max(initial=0) > highest:
            yield "labels", f"has a {name} of {label[name].max()}, above {highest}"


def _has_flow(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where there is a flow to the previous and to the next frame, given the wall in all frames."""
    frame = np.arange(len(mask))
    exists = np.stack([frame > 0, frame < len(mask) - 1], axis=1)
    return mask[:, None] & exists[..., None, None]


def _points(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    wall = arrays["layer"] > 0
    for name, known in {
        "true_displacement": np.isfinite(arrays["true_displacement"]).all(-1),
        "wall_axes": np.isfinite(arrays["wall_axes"]).all((-2, -1)),
        "segment": arrays["segment"] > 0,
    }.items():
        if bool((known != wall).any()):
            yield name, "is not known at a point of the wall, or is outside"
    yield from _still_at_ed("true_displacement", arrays)
    if not _is_one(np.linalg.norm(arrays["wall_axes"][wall], axis=-1)):
        yield "wall_axes", "has axes whose length is not 1 in the wall"


def _quality(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    known, stated = np.isfinite(arrays["displacement"]).all(-1), np.isfinite(arrays["quality"])
    if stated.any() and bool((known != stated).any()):  # a tracker may state none at all
        yield "quality", "is given where there is no displacement, or the reverse"


def _tracking(arrays: Arrays, config: Config) -> Iterator[tuple[str, str]]:
    yield from _quality(arrays, config)
    for name, values in scores.unpacked(arrays["scores"], config).items():
        for problem in _in_range(values, RANGES[schema.SCORES[name].values]):
            yield name, problem


def _still_at_ed(name: str, arrays: Arrays) -> Iterator[tuple[str, str]]:
    """Displacement is taken from end-diastole, which is frame 0."""
    if bool(np.nan_to_num(arrays[name][0]).any()):
        yield name, "is not 0 at end-diastole, from which it is taken"


def _is_one(values: NDArray[Any]) -> bool:
    return bool((np.abs(values - 1) <= COMPLEMENT).all())


RELATIONS: dict[str, Callable[[Arrays, Config], Iterator[tuple[str, str]]]] = {
    "geometry": _geometry,
    "fibres": _fibres,
    "mechanics": _mechanics,
    "kinematics": _kinematics,
    "phantom": _phantom,
    "truth/SIZE": _truth,
    "truth/volume": partial(_wall_labels, dims=3),
    "points": _points,
    "points (volumes)": lambda arrays, _: _still_at_ed("true_displacement", arrays),
    "tracking/TRACKER": _tracking,
    "tracking/TRACKER (volumes)": _quality,
}
"""Kind of a group -> faults of its arrays in relation to each other."""
