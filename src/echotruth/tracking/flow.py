"""Trackers that compute a dense optical flow between two images."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.tracking.accumulation import Path, follow
from echotruth.tracking.grey import grey_levels, local_ncc
from echotruth.tracking.tracker_input import TrackerInput

FlowMethod = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Two images with grey values from 0 to 1 to the motion (axial, lateral, 2) of all pixels between them, px."""
NCC_SIDE = 0.75e-3
"""Side of the square in which the quality of a dense flow is measured, m: half the paper's window."""


def track_by_flow(flow: FlowMethod, clip: TrackerInput, reference: str) -> Path:
    """Path of the points of a clip; the correlation is that of the images in a square around each point."""
    side = max(9, 2 * round(NCC_SIDE / clip.spacing / 2) + 1)
    return follow(FlowTracker(flow, side), grey_levels(clip.frames), clip.points, reference)


@dataclass(frozen=True)
class FlowTracker:
    """Dense flow between two images, as :class:`echotruth.tracking.accumulation.PairTracker`.

    Attributes
    ----------
    flow : FlowMethod
    side : int
        Side of the square in which the quality is measured, px, odd.
    """

    flow: FlowMethod
    side: int

    def prepare(self, image: np.ndarray) -> np.ndarray:
        """The image itself."""
        return image

    def match(self, first: np.ndarray, second: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points, linear between the pixels."""
        flow = self.flow(*(np.nan_to_num(image) for image in (first, second)))
        box, corner = self._bounding_box(points, first.shape)
        flow, first = flow[box], first[box]
        row, column = np.indices(first.shape, np.float32) + corner[::-1, None, None].astype(np.float32)
        warped = ndimage.map_coordinates(second, [row + flow[..., 1], column + flow[..., 0]], order=1, mode="nearest")
        ncc = local_ncc(first, warped, self.side)
        field = np.concatenate([flow, ncc[..., None]], -1)
        field[np.isnan(ncc)] = np.nan
        values = interpolate_field(field, points - corner)
        return values[:, :2], np.maximum(values[:, 2], 0)

    def _bounding_box(self, points: np.ndarray, shape: tuple[int, int]) -> tuple[tuple[slice, slice], np.ndarray]:
        """Rows and columns that the squares around the points cover, and the first pixel of it: lateral, axial."""
        inside = ((points >= 0) & (points <= np.array(shape[::-1]) - 1)).all(1)
        valid = points[inside] if inside.any() else np.zeros((1, 2))
        low = np.maximum(np.floor(valid.min(0)).astype(int) - self.side, 0)
        high = np.ceil(valid.max(0)).astype(int) + self.side + 1
        return (slice(low[1], high[1]), slice(low[0], high[0])), low


def interpolate_field(field: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Bilinear interpolation of a field between pixels.

    Parameters
    ----------
    field : ndarray of shape (axial, lateral, k)
    points : ndarray of shape (n, 2)
        Lateral, axial, px.

    Returns
    -------
    ndarray of shape (n, k)
        NaN outside the image, and where a neighbouring pixel is NaN.
    """
    position = np.where(np.isfinite(points), points, -9)[:, ::-1].T
    values = [ndimage.map_coordinates(part, position, order=1, cval=np.nan) for part in np.moveaxis(field, -1, 0)]
    return np.stack(values, -1).astype(float)
