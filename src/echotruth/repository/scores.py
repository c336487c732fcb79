"""The scores of a tracker on a clip as one table: the array `scores` of its group, a number for each label."""

from collections.abc import Mapping
from functools import lru_cache
from itertools import product
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.repository.schema import LABELS, SCORES


def labels(frames: int, layers: int) -> list[str]:
    """Labels of all scores: the name, and the labels of what it is of, as `nrmse 0 total`."""
    values = _values(frames, layers)
    return [
        " ".join([name, *map(str, of)])
        for name, score in SCORES.items()
        for of in product(*(values[dim] for dim in score.dims))
    ]


def units(frames: int, layers: int) -> list[str]:
    """Unit of each score."""
    return [unit for name, shape in _shapes(frames, layers).items() for unit in [SCORES[name].units] * prod(shape)]


def packed(found: Mapping[str, Any]) -> NDArray[np.float64]:
    """The table of the scores of clips, (..., score), given each score by its name, (..., its dimensions)."""
    arrays = [np.asarray(found[name], float) for name in SCORES]
    kept = [array.ndim - len(score.dims) for array, score in zip(arrays, SCORES.values(), strict=True)]
    return np.concatenate(
        [array.reshape((*array.shape[:k], -1)) for array, k in zip(arrays, kept, strict=True)], axis=-1
    )


def unpacked(table: NDArray[np.float64], config: Config) -> dict[str, NDArray[np.float64]]:
    """Each score by its name, (..., its dimensions), given the table (..., score) of a case."""
    shapes = _shapes(config.loop.frames, config.fibres.layers)
    ends = np.cumsum([prod(shape) for shape in shapes.values()])
    parts = zip(shapes.items(), np.split(table, ends[:-1], axis=-1), strict=True)
    return {name: part.reshape((*table.shape[:-1], *shape)) for (name, shape), part in parts}


@lru_cache(maxsize=16)
def _shapes(frames: int, layers: int) -> dict[str, tuple[int, ...]]:
    values = _values(frames, layers)
    return {name: tuple(len(values[dim]) for dim in score.dims) for name, score in SCORES.items()}


def _values(frames: int, layers: int) -> dict[str, Any]:
    """Labels along each dimension of the scores."""
    return LABELS | {"frame": range(frames), "region": range(layers + 1), "aha": range(1, 18)}
