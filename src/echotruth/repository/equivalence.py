"""Results of the same job on machines of two kinds: other bytes, but the same within rounding.

docs/determinism.md says where the differences come from, and how large they were where instructions were held back.
"""

from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from echotruth.repository import schema
from echotruth.repository.inventory import Inventory, JobRecord

TOLERANCE = {
    "mechanics": 1e-5,
    "phantom": 1e-6,
    "truth": 1e-6,
    "rf": 1e-4,
    "bmode": 1e-4,
    "tracking": 1e-3,
    "inference": 1e-2,
}
"""Stage -> largest difference over the largest number of an array, of a pack over the largest in the same unit; some
ten times and more what was measured."""

STEPPED = ("rf", "bmode")
"""Stages whose whole numbers are measured, in steps, and may be off by one; those of others are labels."""

EXCEPTIONS = {"truth": 1e-3, "bmode": 1e-3, "tracking": 1e-3}
"""Stage -> share of the numbers of an array that may differ by more: pixels at an edge, points that a tracker lost."""

SMALLEST_SCALE = {"m": 1e-4, "s": 1e-2, "rad": 0.1, "1": 1.0, "percent": 100.0}
"""Unit -> least of the numbers to which those of a pack in this unit are compared: errors may all be near 0."""

NOISE = ("mechanics/residual", "mechanics/newton_steps")
"""Arrays that hold how the solution was found."""


def first_difference(record: JobRecord, giving: Inventory, receiving: Inventory) -> str | None:
    """Path of the first array of a job that differs by more than rounding between two repositories.

    Parameters
    ----------
    record : JobRecord
        A job that both have made.
    giving, receiving : Inventory

    Returns
    -------
    str or None
        None if all arrays are the same within :data:`TOLERANCE`, but for :data:`EXCEPTIONS`.
    """
    for path, array in giving.shard_paths.items():
        group = path.rpartition("/")[0]
        if giving.writers[group] != (record.stage, record.size) or path in NOISE or path not in receiving.shard_paths:
            continue
        one, other = (np.asarray(kept.opened[path][kept.row(record) or ()]) for kept in (giving, receiving))
        if one.shape != other.shape:
            return path
        allowed = TOLERANCE[record.stage] * _scale(giving, path, one, other) + (array.quantum or 0)
        if one.dtype.kind in "iu":
            allowed = float(record.stage in STEPPED)
        if _count_beyond(one, other, allowed) > EXCEPTIONS.get(record.stage, 0) * one.size:
            return path
    return None


def _scale(repository: Inventory, path: str, *arrays: NDArray[Any]) -> Any:
    """Largest magnitude in two arrays; of a pack that of the numbers in the same unit, (n_numbers,)."""
    magnitude = np.max([np.nan_to_num(np.abs(values), posinf=0) for values in arrays], axis=0)
    group = path.rpartition("/")[0]
    for pack in schema.packs_of(group):
        if path == f"{group}/{pack.array.name}":
            largest = magnitude.reshape(-1, magnitude.shape[-1]).max(0)
            of_units = f"{group}/{pack.dimension}_units"
            units = np.asarray(zarr.open_array(repository.store, path=of_units, mode="r", zarr_format=3)[...])
            scale = {unit: max(largest[units == unit].max(), SMALLEST_SCALE.get(unit, 0)) for unit in units.tolist()}
            return np.array([scale[unit] for unit in units.tolist()])
    return magnitude.max(initial=0)


def _count_beyond(one: NDArray[Any], other: NDArray[Any], allowed: Any) -> int:
    """How many numbers differ by more than is allowed; what is not a number must be so in both."""
    if one.dtype.kind in "iu":
        one, other = one.astype(np.int64), other.astype(np.int64)
    with np.errstate(invalid="ignore"):
        same = (one == other) | (np.abs(one - other) <= allowed) | (np.isnan(one) & np.isnan(other))
    return int(same.size - np.count_nonzero(same))
