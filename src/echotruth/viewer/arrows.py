"""Lines over the wall: true and tracked paths since end-diastole, and the flow to the next frame as arrows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.viewer.clip import Clip
from echotruth.viewer.points import Points
from echotruth.viewer.tint import nice

ALONG_SIDE = 34
"""Paths or arrows along the side of an image that is all wall."""
FLOW_SHARE = 0.04
"""Length that the longest arrows of the flow are drawn with at least, as a share of the side."""
MILLIMETRES = 1e3


@dataclass(frozen=True)
class Arrows:
    """Arrows of a clip, or steps of paths, of which those to the frame of the picture are drawn together.

    Attributes
    ----------
    start, end : ndarray of shape (frame, n, 2), float32
        Lateral, axial, mm; NaN where there is none.
    scale : float
        How many times as long as the motion they are drawn.
    """

    start: NDArray[np.float32]
    end: NDArray[np.float32]
    scale: float = 1.0


def true_motion(points: Points) -> Arrows:
    """Paths of points of the tissue since end-diastole."""
    return _paths(points, points.true_displacement)


def tracked_motion(points: Points, tracker: str) -> Arrows:
    """Paths of the same points as a tracker finds them."""
    return _paths(points, points.tracked_displacement(tracker))


def _paths(points: Points, displacement: NDArray[np.float64]) -> Arrows:
    chosen = _thinned(points)
    end = points.position[chosen] + displacement[:, chosen]
    start = np.concatenate([points.position[None, chosen], end[:-1]])
    return Arrows(_in_mm(start), _in_mm(end))


def _thinned(points: Points) -> NDArray[np.bool_]:
    """Which of the points have a path."""
    step = max(1, round(points.clip.side / ALONG_SIDE / points.spacing))
    row, column = np.nonzero(points.inside)
    return (row % step == step // 2) & (column % step == step // 2)


def flow(clip: Clip) -> Arrows:
    """From pixels of the wall to where their tissue is in the next frame, drawn longer than it is."""
    step = max(1, clip.size // ALONG_SIDE)
    moved = clip.flow(step).astype(float)
    pixel = (np.arange(clip.size)[step // 2 :: step] + 0.5) * clip.side / clip.size
    start = np.stack(np.meshgrid(pixel - clip.side / 2, pixel), axis=-1)
    length = float(np.nanmax(np.linalg.norm(moved, axis=-1), initial=0.0))
    scale = max(1.0, nice(FLOW_SHARE * clip.side / length)) if length > 0 else 1.0
    ever = np.isfinite(moved).all(-1).any(0)
    known, starts = moved[:, ever], np.broadcast_to(start[ever], moved[:, ever].shape)
    starts = np.where(np.isfinite(known), starts, np.nan)
    return Arrows(_in_mm(starts), _in_mm(starts + scale * known), scale)


def _in_mm(position: NDArray[np.float64]) -> NDArray[np.float32]:
    return (MILLIMETRES * position).astype(np.float32)
