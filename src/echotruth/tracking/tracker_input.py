"""What every tracker is given."""

from dataclasses import dataclass

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
    spacing: float
    frame_time: np.ndarray
    seed: int
    is_closed: bool = True

    def __post_init__(self) -> None:
        frames, times = self.frames, self.frame_time
        if frames.ndim != 3 or len(frames) < 2:
            raise ValueError(f"A clip needs two or more frames, shape (frame, axial, lateral), not {frames.shape}.")
        infinite = np.isinf(frames).any(axis=(1, 2))
        if infinite.any():
            frame = np.argmax(infinite)
            raise ValueError(
                f"Frame {frame} has pixels that are infinite: give numbers, or NaN where there is no image."
            )
        if self.points.ndim != 2 or self.points.shape[1] != 2:
            raise ValueError(f"Points must have the shape (point, 2), not {self.points.shape}.")
        if self.mask.shape != self.shape:
            raise ValueError(f"The mask must have the shape of a frame, {self.shape}, not {self.mask.shape}.")
        if not (np.isfinite(self.spacing) and self.spacing > 0):
            raise ValueError(f"The pixel spacing must be a positive length in metres, not {self.spacing}.")
        if times.shape != frames.shape[:1] or not (np.diff(times) > 0).all():
            raise ValueError(f"The {len(frames)} frames need {len(frames)} increasing times, not {times}.")

    @property
    def shape(self) -> tuple[int, int]:
        """Axial and lateral size of a frame, px."""
        return self.frames.shape[1:]  # type: ignore[return-value]
