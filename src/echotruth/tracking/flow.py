"""Trackers that compute a dense optical flow between two images."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from echotruth.tracking.accumulation import Path, follow
from echotruth.tracking.grey import grey_levels, local_ncc
from echotruth.tracking.tracker_input import TrackerInput

FlowMethod = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Two images with grey values from 0 to 1 to the motion (axial, lateral, 2) of all pixels between them, px; of volumes
(depth, elevation, lateral, 3)."""
NCC_SIDE = 0.75e-3
"""Side of the square in which the quality of a dense flow is measured, m: half the paper's window."""


def track_by_flow(flow: FlowMethod, clip: TrackerInput, reference: str) -> Path:
    """Path of the points of a clip; the correlation is that of the images in a square around each point."""
    sides = np.maximum(9, 2 * np.round(NCC_SIDE / np.atleast_1d(clip.spacing) / 2).astype(int) + 1)
    side = tuple(sides[::-1].tolist()) if clip.is_volume else int(sides[0])
    return follow(FlowTracker(flow, side, clip.ratio), grey_levels(clip.frames), clip.points * clip.ratio, reference)


@dataclass(frozen=True)
class FlowTracker:
    """Dense flow between two images, as :class:`echotruth.tracking.accumulation.PairTracker`.

    Attributes
    ----------
    flow : FlowMethod
    side : int or tuple of int
        Side of the square in which the quality is measured, px, odd; of volumes along each axis.
    ratio : ndarray of shape () or (3,)
        See :attr:`.tracker_input.TrackerInput.ratio`.
    """

    flow: FlowMethod
    side: int | tuple[int, ...]
    ratio: np.ndarray = field(default_factory=lambda: np.array(1.0))

    def prepare(self, image: np.ndarray) -> np.ndarray:
        """The image itself."""
        return image

    def match(self, first: np.ndarray, second: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points, linear between the pixels."""
        flow = self.flow(*(np.nan_to_num(image) for image in (first, second)))
        points = points / self.ratio
        box, corner = self._bounding_box(points, first.shape)
        flow, first = flow[box], first[box]
        origin = corner[::-1].astype(np.float32).reshape(-1, *[1] * first.ndim)
        place = np.indices(first.shape, np.float32) + origin + np.moveaxis(flow, -1, 0)[::-1]
        warped = ndimage.map_coordinates(second, place, order=1, mode="nearest")
        ncc = local_ncc(first, warped, self.side)
        values = np.concatenate([flow, ncc[..., None]], -1)
        values[np.isnan(ncc)] = np.nan
        result = interpolate_field(values, points - corner)
        return result[:, :-1] * self.ratio, np.maximum(result[:, -1], 0)

    def _bounding_box(self, points: np.ndarray, shape: tuple[int, ...]) -> tuple[tuple[slice, ...], np.ndarray]:
        """Pixels that the squares around the points cover, and the first of them: lateral, axial."""
        inside = ((points >= 0) & (points <= np.array(shape[::-1]) - 1)).all(1)
        valid = points[inside] if inside.any() else np.zeros((1, len(shape)))
        reach = np.broadcast_to(self.side, len(shape))[::-1]
        low = np.maximum(np.floor(valid.min(0)).astype(int) - reach, 0)
        high = np.ceil(valid.max(0)).astype(int) + reach + 1
        return tuple(map(slice, low[::-1], high[::-1])), low


def interpolate_field(field: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Linear interpolation of a field between pixels.

    Parameters
    ----------
    field : ndarray of shape (axial, lateral, k) or (depth, elevation, lateral, k)
    points : ndarray of shape (n, 2) or (n, 3)
        Lateral, axial or lateral, elevation, depth, px.

    Returns
    -------
    ndarray of shape (n, k)
        NaN outside the image, and where a neighbouring pixel is NaN.
    """
    position = np.where(np.isfinite(points), points, -9)[:, ::-1].T
    values = [ndimage.map_coordinates(part, position, order=1, cval=np.nan) for part in np.moveaxis(field, -1, 0)]
    return np.stack(values, -1).astype(float)
