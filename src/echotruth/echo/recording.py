"""A recorded clip as a file holds it: pixels, and what the file says of their size and time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

LUMA = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in the brightness of a colour (ITU-R BT.601)."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Pixels of a file.

    Attributes
    ----------
    frames : ndarray of shape (frame, axial, lateral), uint8
    spacing : tuple of float, m
        Axial and lateral distance of pixel centres; () where the file does not say.
    time : ndarray of shape (frame,), s
        Since the first frame; empty where the file does not say.
    r_waves : ndarray of shape (n,), s
        Times of R waves of the ECG since the first frame; empty where the file has none.
    """

    frames: NDArray[np.uint8]
    spacing: tuple[float, ...] = ()
    time: Floats = field(default_factory=lambda: np.empty(0))
    r_waves: Floats = field(default_factory=lambda: np.empty(0))


def grey(pixels: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Grey levels of pixels.

    Parameters
    ----------
    pixels : ndarray of shape (frame, axial, lateral) or (frame, axial, lateral, colour)
        Red, green, blue, and perhaps opacity, which does not count. Levels of other types than uint8 are scaled
        linearly, so that the least of the clip is 0 and the largest 255.

    Returns
    -------
    ndarray of shape (frame, axial, lateral), uint8
    """
    given = np.asarray(pixels, np.float32)
    levels = given if given.ndim == 3 else given[..., 0] if given.shape[-1] < 3 else given[..., :3] @ LUMA
    if pixels.dtype != np.uint8:
        least, largest = float(np.min(levels)), float(np.max(levels))
        levels = (levels - least) * (255 / (largest - least or 1))
    return np.round(levels).astype(np.uint8)
