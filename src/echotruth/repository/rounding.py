"""Rounding of stored numbers to a multiple of a power of two, their quantum.

The bits below the quantum are zero, and so take next to no place once they are compressed. The numbers are ordinary
floating-point numbers, which every reader reads; rounding moves each by half its quantum at most.
"""

from math import floor, log2
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.config import Config
from echotruth.repository.array import Array
from echotruth.units import mm

LENGTH = "pixel/256"
"""Quantum of lengths in the image: the largest power of two, in metres, not above 1/256 pixel of the largest image."""

STRAIN = 2.0**-12
CURVE = 2.0**-16
"""Quantum of means of strain and of angles (rad) over time."""


def quantum(array: Array, config: Config) -> float | None:
    """Quantum of an array, in its unit; None if it is stored as it is computed.

    Parameters
    ----------
    array : Array
    config : Config
        Configuration of the repository.
    """
    return length_quantum(config) if array.quantum == LENGTH else cast("float | None", array.quantum)


def length_quantum(config: Config) -> float:
    """Largest power of two that is not above 1/256 of the pixel of the largest image, or of a voxel's side, m."""
    sides = config.volume.voxel_mm if config.has_volumes else (config.bmode.field_of_view_mm / max(config.bmode.sizes),)
    pixel = min(sides) * mm
    return float(2.0 ** floor(log2(pixel / 256)))


def as_stored(values: ArrayLike, array: Array, config: Config) -> NDArray[Any]:
    """Values of an array as the store has them: of its type, and rounded."""
    return rounded(np.asarray(values, dtype=array.dtype), quantum(array, config))


def rounded(values: ArrayLike, quantum: float | None) -> NDArray[Any]:
    """Round values to the nearest multiple of a quantum, halves to the even one.

    Parameters
    ----------
    values : array_like of floating-point numbers
    quantum : float or None
        A power of two, in the unit of the values; None leaves them as they are.

    Returns
    -------
    ndarray of the same shape and type
        Without negative zeros; what is not finite stays so.
    """
    values = np.asarray(values)
    if quantum is None:
        return values
    step, result = values.dtype.type(quantum), np.empty_like(values)
    # Part by part and in place, because memory is what this takes.
    for given, part in zip(np.atleast_2d(values), np.atleast_2d(result), strict=True):
        # Division and multiplication by a power of two are exact, so that only `rint` rounds. Adding 0 makes -0 to 0.
        np.rint(np.divide(given, step, out=part), out=part)
        np.add(np.multiply(part, step, out=part), 0, out=part)
    return result
