"""Trackers that find the motion of every pixel from one image to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.tracking.accumulation import accumulate
from echotruth.tracking.grey import levels, similarity

SQUARE = 0.75e-3
"""Side of the square over which the quality of a dense motion is judged, m: the paper's window halved."""


def follow(
    flow: Callable[[np.ndarray, np.ndarray], np.ndarray],
    frames: np.ndarray,
    points: np.ndarray,
    spacing: float,
    reference: str,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame.

    Parameters
    ----------
    flow : callable
        Motion (axial, lateral, 2) of all pixels from one image to another, px; both have grey values from 0 to 1.
    frames : ndarray of shape (frame, axial, lateral)
        Any real type.
    points : ndarray of shape (n, 2)
        Lateral, axial, px.
    spacing : float
        Distance of pixel centres, m.
    reference : {"ED", "previous", "cycle"}
        As :func:`echotruth.tracking.accumulation.accumulate` takes it.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        px.
    quality : ndarray of shape (frame, n)
        Correlation of the first image with the second carried back, none below 0.
    """
    side = max(9, 2 * round(SQUARE / spacing / 2) + 1)
    return accumulate(FlowPairs(flow, side), levels(frames), points, reference)


@dataclass(frozen=True)
class FlowPairs:
    """Dense motion of two images, as :class:`echotruth.tracking.accumulation.Pairs`.

    Attributes
    ----------
    flow : callable
        As :func:`follow` takes it.
    side : int
        Side of the square over which the quality is judged, px, odd.
    """

    flow: Callable[[np.ndarray, np.ndarray], np.ndarray]
    side: int

    def prepare(self, image: np.ndarray) -> np.ndarray:
        """The image as it is, grey values from 0 to 1."""
        return image

    def match(self, first: np.ndarray, second: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points, linear between the pixels."""
        moved = self.flow(*(np.nan_to_num(image) for image in (first, second)))
        box, corner = self._box(points, first.shape)
        moved, first = moved[box], first[box]
        row, column = np.indices(first.shape, np.float32) + np.float32(corner[::-1])[:, None, None]
        back = ndimage.map_coordinates(second, [row + moved[..., 1], column + moved[..., 0]], order=1, mode="nearest")
        alike = similarity(first, back, self.side)
        told = np.concatenate([moved, alike[..., None]], -1)
        told[np.isnan(alike)] = np.nan
        step = sample(told, points - corner)
        return step[:, :2], np.maximum(step[:, 2], 0)

    def _box(self, points: np.ndarray, shape: tuple[int, int]) -> tuple[tuple[slice, slice], np.ndarray]:
        """Rows and columns of what can be seen from the points, and the first pixel of it: lateral, axial."""
        inside = ((points >= 0) & (points <= np.array(shape[::-1]) - 1)).all(1)
        near = points[inside] if inside.any() else np.zeros((1, 2))
        low = np.maximum(np.floor(near.min(0)).astype(int) - self.side, 0)
        high = np.ceil(near.max(0)).astype(int) + self.side + 1
        return (slice(low[1], high[1]), slice(low[0], high[0])), low


def sample(field: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Values of a field between pixels.

    Parameters
    ----------
    field : ndarray of shape (axial, lateral, k)
    points : ndarray of shape (n, 2)
        Lateral, axial, px.

    Returns
    -------
    ndarray of shape (n, k)
        NaN outside the image, and where a pixel around has no value.
    """
    place = np.where(np.isfinite(points), points, -9)[:, ::-1].T
    values = [ndimage.map_coordinates(each, place, order=1, cval=np.nan) for each in np.moveaxis(field, -1, 0)]
    return np.stack(values, -1).astype(float)
