"""What the machine allows: how fast one core loads, stores, and multiplies and adds, in single precision.

All loops run over arrays that stay in the first-level cache, as the blocks of scatterers are made to.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numba
import numpy as np

from echotruth.imaging.rf import full_matrix, spreading

VECTOR = 8
"""Numbers in 32 bytes."""
LENGTH = 2048
"""Numbers in each of two arrays: 8 KiB."""
CACHE_LINE = 16
"""Numbers in a line of the cache, at whose start the arrays begin."""
REPEATS = 20000
TURNS = 5
HORNER = 8
"""Multiply-adds on a number between its load and its store."""


@numba.njit(fastmath=True)
def load(one, other, repeats):
    """Product of two arrays, again and again: two vectors loaded for one multiply-add."""
    total = np.float32(0)
    for _ in range(repeats):
        for k in range(len(one)):
            total += one[k] * other[k]
    return total


@numba.njit(fastmath=True)
def store(one, other, repeats):
    """Fill two arrays, again and again."""
    for n in range(repeats):
        value = np.float32(n)
        for k in range(len(one)):
            one[k] = value
            other[k] = value
    return one[0]


@numba.njit(fastmath=True)
def multiply(one, other, repeats):
    """Polynomial of every number, again and again."""
    for _ in range(repeats):
        for k in range(len(one)):
            value = one[k]
            for _ in range(HORNER):
                value = value * one[k] + np.float32(0.5)
            other[k] = value
    return other[0]


SCHEMES = {"ours": full_matrix.PLANE}
"""Party to the scheme of its tables."""

LOOPS = {"load": (load, 2), "store": (store, 2), "multiply": (multiply, HORNER)}
"""Name to loop and how often it does that to every number."""


def traffic(scheme: int) -> dict[str, int]:
    """Bytes of spreading an echo, a vector of eight at a time.

    Loads of every row of its table, of the trace, and of time, weight and spectral exponent of the receiver; a store of
    the trace; as many multiply-adds as the table has rows.
    """
    rows = sum(spreading.COEFFICIENTS[scheme])
    return {"load": (rows + 1) * 32 + 3 * 4, "store": 32, "multiply": rows * 32}


def rates() -> dict[str, float]:
    """Nanoseconds of CPU for 32 bytes, by kind."""
    return {name: VECTOR * nanoseconds(loop) / LENGTH / each for name, (loop, each) in LOOPS.items()}


def nanoseconds(loop: Callable[..., Any]) -> float:
    """Median CPU time of one pass over the arrays, ns."""
    memory = np.full(2 * LENGTH + CACHE_LINE, 0.5, np.float32)
    start = -memory.ctypes.data % (4 * CACHE_LINE) // 4
    one, other = memory[start : start + 2 * LENGTH].reshape(2, LENGTH)
    loop(one, other, 1)
    spent = []
    for _ in range(TURNS):
        start = time.process_time()
        loop(one, other, REPEATS)
        spent.append(time.process_time() - start)
    return 1e9 * median(spent) / REPEATS
