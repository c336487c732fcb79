"""Whether a motion comes again within a clip, as over several beats."""

import numpy as np

REPEATS, APART, ALIKE = 0.6, 0.5, 0.2
"""Longest part of a clip after which its motion is sought again; and mean squared difference of displacements so much
later, over that of unrelated ones, which must first be larger and then smaller if it comes again. Of one beat the first
two fifths, in which the heart contracts, are compared with the last then, in which it rests."""


def rms_length(vectors: np.ndarray) -> np.ndarray:
    """RMS length (frame,) of vectors (frame, point, plane) over the points that are known; NaN without any."""
    square = (vectors**2).sum(-1)
    known = np.isfinite(square)
    total, count = np.where(known, square, 0).sum(1), known.sum(1)
    return np.sqrt(np.divide(total, count, out=np.full(len(vectors), np.nan), where=count > 0))


def repetition(moved: np.ndarray) -> int:
    """Frames after which a motion comes again, 0 if it does not.

    Parameters
    ----------
    moved : ndarray of shape (frame, point, 2)
        Displacement or place in any unit; points that are NaN in a frame do not count.
    """
    moved = moved[:, np.isfinite(moved).all(axis=(0, 2))]
    total = 2 * np.mean(rms_length(moved - moved.mean(axis=0)) ** 2)
    lags = range(1, int(REPEATS * len(moved)) + 1)
    apart = np.array([np.mean(rms_length(moved[lag:] - moved[:-lag]) ** 2) for lag in lags]) / (total or np.nan)
    if not (apart > APART).any():
        return 0
    far = int(np.argmax(apart > APART))
    period = far + int(np.argmin(apart[far:])) + 1
    if apart[period - 1] > ALIKE:
        return 0
    return far + int(np.argmax(apart[far:] <= 1.5 * apart[period - 1])) + 1
