"""Points near others, found by their distances from all of them; a wall has thousands of points at most."""

from collections.abc import Iterator

import numpy as np

_BLOCK = 1_000_000
"""Distances that are held at a time."""


def nearest(position: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Index of the point nearest to each target.

    Parameters
    ----------
    position : ndarray of shape (point, 2) or (point, 3), m
    target : ndarray of shape (target, 2) or (target, 3), m

    Returns
    -------
    ndarray of shape (target,)
    """
    blocks = [squared.argmin(axis=1) for squared in _squared_distances(position, target)]
    return np.concatenate([np.empty(0, int), *blocks])


def within(position: np.ndarray, target: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Points within a radius of each target.

    Parameters
    ----------
    position : ndarray of shape (point, 2) or (point, 3), m
    target : ndarray of shape (target, 2) or (target, 3), m
    radius : float, m

    Returns
    -------
    neighbour : ndarray of shape (target, most)
        Indices of the points in rising order, filled up with 0 to the most that a target has.
    distance : ndarray of shape (target, most), m
        Infinite where filled up.
    """
    pairs, first = [], 0
    for squared in _squared_distances(position, target):
        row, point = np.nonzero(squared <= radius**2)
        pairs.append((first + row, point, np.sqrt(squared[row, point])))
        first += len(squared)
    row, point, apart = (np.concatenate(one) for one in zip((np.empty(0, int),) * 3, *pairs, strict=True))
    count = np.bincount(row, minlength=len(target))
    slot = np.arange(len(row)) - np.repeat(count.cumsum() - count, count)
    shape = len(target), max(1, int(count.max(initial=0)))
    neighbour, distance = np.zeros(shape, int), np.full(shape, np.inf)
    neighbour[row, slot], distance[row, slot] = point, apart
    return neighbour, distance


def _squared_distances(position: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    """Squared distances of a block of targets from all points, (targets of the block, point), m^2, block by block."""
    step = max(1, _BLOCK // max(1, len(position)))
    for first in range(0, len(target), step):
        yield sum(apart * apart for apart in (target[first : first + step, None] - position).transpose(2, 0, 1))
