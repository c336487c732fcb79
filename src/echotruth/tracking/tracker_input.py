"""What every tracker is given."""

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class TrackerInput:
    """Arguments of :func:`echotruth.tracking.tracker.track`, which documents them, and whether the cycle may be closed.

    Raises
    ------
    ValueError
        If there are fewer than two frames, or pixels, points, mask, spacing or times are invalid.
    """

    frames: np.ndarray
    points: np.ndarray
    mask: np.ndarray
    spacing: Any
    frame_time: np.ndarray
    seed: int
    is_closed: bool = True

    def __post_init__(self) -> None:
        frames, times, size = self.frames, self.frame_time, self.frames.ndim - 1
        if size not in (2, 3) or len(frames) < 2:
            raise ValueError(
                "A clip needs two or more frames, shape (frame, axial, lateral) or, of volumes, (frame, depth, "
                f"elevation, lateral), not {frames.shape}."
            )
        infinite = np.isinf(frames).any(axis=tuple(range(1, frames.ndim)))
        if infinite.any():
            frame = np.argmax(infinite)
            raise ValueError(
                f"Frame {frame} has pixels that are infinite: give numbers, or NaN where there is no image."
            )
        if self.points.ndim != 2 or self.points.shape[1] != size:
            raise ValueError(f"Points must have the shape (point, {size}), not {self.points.shape}.")
        if self.mask.shape != self.shape:
            raise ValueError(f"The mask must have the shape of a frame, {self.shape}, not {self.mask.shape}.")
        spacing = np.asarray(self.spacing)
        if spacing.shape != (() if size == 2 else (3,)) or not (np.isfinite(spacing) & (spacing > 0)).all():
            lengths = "a positive length" if size == 2 else "positive lengths (lateral, elevation, depth)"
            raise ValueError(f"The pixel spacing must be {lengths} in metres, not {self.spacing}.")
        if times.shape != frames.shape[:1] or not (np.diff(times) > 0).all():
            raise ValueError(f"The {len(frames)} frames need {len(frames)} increasing times, not {times}.")

    @property
    def shape(self) -> Any:
        """Axial and lateral size of a frame, px; of a volume depth, elevation and lateral size."""
        return self.frames.shape[1:]

    @property
    def is_volume(self) -> bool:
        """Whether the frames are volumes."""
        return self.frames.ndim == 4

    @property
    def ratio(self) -> np.ndarray:
        """Spacing along lateral, elevation, depth over the finest, (3,); 1 for flat images, whose pixels are square.

        Trackers measure lengths of volumes in the finest spacing: points and displacements in voxels times this.
        """
        return np.asarray(self.spacing) / np.min(self.spacing) if self.is_volume else np.array(1.0)

    @property
    def side(self) -> float:
        """The longer side of a frame, in the finest spacing, px."""
        return float(np.max(np.array(self.shape[::-1]) * self.ratio))
