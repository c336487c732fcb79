"""Hearts drawn at random: points of a sequence in the unit cube, and the quantiles of each key there.

Every number is made by arithmetic that does not depend on versions of libraries, and rounded, so that a heart keeps its
id. The points of Sobol's sequence (Sobol' 1967; direction numbers of Joe & Kuo 2008, doi:10.1137/070709359, as in
scipy) are shifted by a random number whose bits are added without carry, which keeps their evenness (L'Ecuyer & Lemieux
2002, doi:10.1007/0-306-48102-2_20).
"""

import json
from hashlib import sha256
from math import ceil, log2
from typing import Any

import numpy as np

from echotruth.arrays import Floats
from echotruth.config.cases import Distribution, Draw

BITS = 30
"""Bits of a point of Sobol's sequence."""
DIGITS = 6
"""Significant digits of drawn values; the last bits of a quantile differ between machines."""


def draws(draw: Draw) -> list[dict[str, Any]]:
    """Value of every drawn key, in each draw.

    Parameters
    ----------
    draw : Draw

    Returns
    -------
    list of dict
        Dotted key -> value, of length `draw.number`, on which its beginning does not depend.
    """
    points = unit_points(draw)
    columns = {key: quantiles(distribution, points[key]) for key, distribution in draw.keys.items()}
    return [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]


def unit_points(draw: Draw) -> dict[str, Floats]:
    """Points in the unit cube.

    Parameters
    ----------
    draw : Draw

    Returns
    -------
    dict of ndarray of shape (number,)
        Dotted key -> coordinate between 0 and 1. They do not depend on the order in which the keys are given.
    """
    keys = sorted(draw.keys)
    points = sobol(draw.number, len(keys)).T
    return {key: ((axis ^ _shift(draw, key)) + 0.5) / 2**BITS for key, axis in zip(keys, points, strict=True)}


def sobol(number: int, dimensions: int) -> np.ndarray:
    """Points of Sobol's sequence, not randomised.

    Returns
    -------
    ndarray of shape (number, dimensions), int64
        Times 2^`BITS`.
    """
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimensions, scramble=False, bits=BITS)
    return (sequence.random_base2(ceil(log2(number)))[:number] * 2**BITS).astype(np.int64)


def quantiles(distribution: Distribution, probability: Floats) -> list[Any]:
    """Values of a distribution at some probabilities.

    Parameters
    ----------
    distribution : Distribution
    probability : ndarray of shape (n,)

    Returns
    -------
    list of length n
    """
    bounds = getattr(distribution, distribution.kind)
    match distribution.kind:
        case "integers":
            first, last = bounds
            return [first + min(int(p * (last - first + 1)), last - first) for p in probability.tolist()]
        case "choice":
            weights = np.cumsum(distribution.weights or [1.0] * len(bounds))
            index = np.searchsorted(weights / weights[-1], probability, side="right")
            return [bounds[min(i, len(bounds) - 1)] for i in index]
        case "normal":
            return _rounded(_normal(bounds, distribution.limits, probability), distribution.limits)
        case "log_uniform":
            low, high = np.log(bounds)
            return _rounded(np.exp(low + (high - low) * probability), bounds)
        case _:
            return _rounded(bounds[0] + (bounds[1] - bounds[0]) * probability, bounds)


def _normal(moments: list[float], limits: list[float] | None, probability: Floats) -> Floats:
    from scipy.stats import norm, truncnorm

    mean, deviation = moments
    if limits is None:
        return norm.ppf(np.clip(probability, 1e-12, 1 - 1e-12), mean, deviation)
    low, high = ((limit - mean) / deviation for limit in limits)
    return truncnorm.ppf(probability, low, high, mean, deviation)


def _rounded(values: Floats, bounds: list[float] | None) -> list[float]:
    """Values with a few significant digits, within bounds."""
    low, high = bounds or (-np.inf, np.inf)
    return [min(max(float(f"{value:.{DIGITS}g}"), low), high) for value in values.tolist()]


def _shift(draw: Draw, key: str) -> int:
    """Random number of `BITS` bits by which a key is shifted."""
    digest = sha256(json.dumps([draw.seed, "sobol", key]).encode()).digest()
    return int.from_bytes(digest[:4], "big") >> (32 - BITS)
