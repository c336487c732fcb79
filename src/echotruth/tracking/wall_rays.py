"""Points of the wall along rays from the middle of the cavity: a grid through and around the wall of any view."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

RAYS, DEPTHS = 64, 5
"""Rays around the cavity, and points of each through the wall."""
ANGLES = 2 * np.pi * np.arange(RAYS) / RAYS
"""Angle of each ray, from the lateral towards the axial direction."""
DIRECTIONS = np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1)
ACROSS = np.stack([-np.sin(ANGLES), np.cos(ANGLES)], -1)
"""Unit vectors (RAYS, 2) of the image, lateral and axial, along and across the rays."""
STEP = 0.25
"""Distance at which a ray looks for the wall, px."""
LEAST_CAVITY = 0.1
"""Area of what may be the cavity, over the largest part of the hull that is no wall."""
LEAST_CROSSING = 0.6
"""Share of the rays that cross a wall around a cavity; from beside a solid one it is a half."""


@dataclass(frozen=True)
class WallRays:
    """Where rays from the middle of the cavity cross the wall.

    A ray of a long axis that leaves through the base crosses no wall.

    Attributes
    ----------
    centre : ndarray of shape (2,)
        Middle of the cavity: lateral, axial, px.
    inner, outer : ndarray of shape (RAYS,)
        Distance from the centre at which each ray enters and leaves the wall, px; of one that crosses none,
        interpolated between its neighbours.
    crosses : ndarray of shape (RAYS,), bool
        Whether a ray crosses the wall.
    """

    centre: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    crosses: np.ndarray

    @cached_property
    def thickness(self) -> float:
        """Mean thickness of the wall along the rays that cross it, px."""
        return float((self.outer - self.inner)[self.crosses].mean())

    @property
    def points(self) -> np.ndarray:
        """Points (DEPTHS, RAYS, 2), px, in the middle of equal parts of each ray."""
        share = (np.arange(DEPTHS)[:, None] + 0.5) / DEPTHS
        distance = self.inner + share * (self.outer - self.inner)
        return self.centre + distance[..., None] * DIRECTIONS

    @cached_property
    def _nearest(self) -> np.ndarray:
        """Number of the nearest ray that crosses the wall, of each (RAYS,)."""
        known = np.nonzero(self.crosses)[0]
        apart = np.abs(np.arange(RAYS)[:, None] - known)
        return known[np.minimum(apart, RAYS - apart).argmin(1)]

    def along_and_across(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (..., RAYS, 2) of the image, lateral and axial, as components along and across the rays."""
        along = (vectors * DIRECTIONS).sum(-1)
        return np.stack([along, (vectors * ACROSS).sum(-1)], -1)

    def in_image(self, components: np.ndarray) -> np.ndarray:
        """Components (..., RAYS, 2) along and across the rays as vectors of the image, lateral and axial."""
        return components[..., :1] * DIRECTIONS + components[..., 1:] * ACROSS

    def interpolate(self, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Values at points, linear along and between rays and constant beyond the outermost.

        In place of a ray that crosses no wall the nearest that does counts.

        Parameters
        ----------
        values : ndarray of shape (DEPTHS, RAYS, ...)
        points : ndarray of shape (n, 2)
            px.

        Returns
        -------
        ndarray of shape (n, ...)
            Of points that are NaN, of the middle of the cavity.
        """
        values = values[:, self._nearest]
        offset = np.nan_to_num(points - self.centre)
        ray = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) * RAYS % RAYS
        first = ray.astype(int) % RAYS
        second, between = (first + 1) % RAYS, ray - np.floor(ray)
        inner, outer = ((1 - between) * edge[first] + between * edge[second] for edge in (self.inner, self.outer))
        depth = (np.hypot(*offset.T) - inner) / np.maximum(outer - inner, 1e-6) * DEPTHS - 0.5
        depth = np.clip(depth, 0, DEPTHS - 1)
        low = np.minimum(depth.astype(int), DEPTHS - 2)
        into = depth - low
        found = 0.0
        for row, across in ((low, 1 - into), (low + 1, into)):
            for column, along in ((first, 1 - between), (second, between)):
                weight = (across * along).reshape(-1, *(1,) * (values.ndim - 2))
                found = found + weight * values[row, column]
        return np.asarray(found)


def wall_rays(mask: np.ndarray) -> WallRays:
    """Rays of a wall.

    The cavity is that part of the convex hull of the wall that is no wall from whose middle most rays cross the wall:
    a dent outside, which is one too, lies beside it. The wall of a ray is its longest stretch, so that a papillary
    muscle or a speck elsewhere in the mask makes it no thicker.

    Parameters
    ----------
    mask : ndarray of shape (axial, lateral), bool
        The wall.

    Raises
    ------
    ValueError
        If the wall is empty or surrounds nothing.
    """
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        raise ValueError("The wall is empty.")
    hull = cv2.fillConvexPoly(np.zeros(mask.shape, np.uint8), cv2.convexHull(np.vstack(contours)), 1)
    _, _, stats, centroids = cv2.connectedComponentsWithStats(hull * ~mask)
    area = stats[1:, cv2.CC_STAT_AREA]
    large = centroids[1:][area >= LEAST_CAVITY * area.max(initial=0)]
    around = [(centre, _edges(centre, mask)) for centre in large]
    centre, edges = max(around, key=lambda each: _crosses(each[1]).sum(), default=(None, np.zeros((RAYS, 2))))
    crosses = _crosses(edges)
    if centre is None or crosses.mean() < LEAST_CROSSING:
        raise ValueError("The wall surrounds no cavity: give that of a heart, or take another tracker.")
    known = np.nonzero(crosses)[0]
    inner, outer = (np.interp(np.arange(RAYS), known, edge[known], period=RAYS) for edge in edges.T)
    return WallRays(centre, inner, outer, crosses)


def _crosses(edges: np.ndarray) -> np.ndarray:
    """Whether each ray crosses the wall."""
    return edges[:, 1] > edges[:, 0]


def _edges(centre: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Distance (RAYS, 2) at which each ray from a point enters and leaves the wall, px; both 0 if it crosses none."""
    distance = np.arange(0, np.hypot(*mask.shape), STEP)
    pixel = np.round(centre + distance[:, None, None] * DIRECTIONS).astype(int)
    inside = (pixel >= 0).all(-1) & (pixel < mask.shape[::-1]).all(-1)
    row, column = np.clip(pixel[..., 1], 0, mask.shape[0] - 1), np.clip(pixel[..., 0], 0, mask.shape[1] - 1)
    return STEP * np.array([_longest(hit) for hit in (mask[row, column] & inside).T])


def _longest(hit: np.ndarray) -> tuple[int, int]:
    """First index of the longest stretch of True, and that after its last; both 0 without any."""
    change = np.diff(np.concatenate([[False], hit, [False]]).astype(int))
    starts, ends = np.nonzero(change == 1)[0], np.nonzero(change == -1)[0]
    if not len(starts):
        return 0, 0
    longest = np.argmax(ends - starts)
    return starts[longest], ends[longest]
