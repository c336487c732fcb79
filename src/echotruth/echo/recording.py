"""A recorded clip as a file holds it: pixels, and what the file says of their size and time."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.echo.failure import EchoError

LUMA = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in the brightness of a colour (ITU-R BT.601)."""
LARGEST_CLIP = 2**31
"""Pixels of the largest clip that is read, all frames together."""
LARGEST_LEVEL = 1e20
"""Largest absolute value that is taken for a level of grey."""
LEAST_GREY = 1e-3
"""Share of pixels of a clip that are neither black nor white, below which nothing can be seen in it."""


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


def grey(pixels: NDArray[np.generic], name: str) -> NDArray[np.uint8]:
    """Grey levels of pixels.

    Parameters
    ----------
    pixels : ndarray of shape (frame, axial, lateral) or (frame, axial, lateral, colour)
        Red, green, blue, and perhaps opacity, which does not count. Levels of 8 bits stay as they are. Those of any
        other type are scaled linearly, so that the least of the clip is 0 and the largest 255: of how many bits of
        its type a clip makes use differs.
    name : str
        What an error calls the clip.

    Returns
    -------
    ndarray of shape (frame, axial, lateral), uint8

    Raises
    ------
    EchoError
        If it is no clip of real numbers or has too many pixels, or its levels are not finite, or so far apart that
        almost all of it would be black or white.
    """
    shape = pixels.shape
    if len(shape) not in (3, 4) or not pixels.size or shape[3:] > (4,) or pixels.dtype.kind not in "uifb":
        wanted = "give numbers (frame, axial, lateral), or colours last"
        raise EchoError(f"{name}: has the shape {shape} of {pixels.dtype}: {wanted}")
    check_size(int(np.prod(shape[:3], dtype=object)), name)
    if pixels.dtype == np.uint8:
        return np.stack([np.round(_brightness(frame)).astype(np.uint8) for frame in pixels])
    extremes = np.array([(level.min(), level.max()) for level in map(_brightness, pixels)])
    least, largest = float(extremes[:, 0].min()), float(extremes[:, 1].max())
    if not max(-least, largest) <= LARGEST_LEVEL:
        worst = largest if not largest <= LARGEST_LEVEL else least
        raise EchoError(f"{name}: has the grey level {worst:g}: give finite ones, up to {LARGEST_LEVEL:g}")
    scale = 255 / (largest - least or 1)
    frames = np.stack([np.round((_brightness(frame) - least) * scale).astype(np.uint8) for frame in pixels])
    if np.mean((frames > 0) & (frames < 255)) < LEAST_GREY and len(np.unique(pixels)) > 2:
        raise EchoError(
            f"{name}: has grey levels from {least:g} to {largest:g}, and almost none between: cut them off, or take "
            "their logarithm"
        )
    return frames


def check_size(pixels: int, name: str) -> None:
    """Raise an :class:`EchoError` if a clip has more pixels, in all frames, than any echo."""
    if pixels > LARGEST_CLIP:
        raise EchoError(f"{name}: has {pixels:.2g} pixels: cut out or leave out some, {LARGEST_CLIP:.2g} are read")


def _brightness(frame: NDArray[Any]) -> NDArray[Any]:
    """Levels (axial, lateral) of a frame with or without colours."""
    levels: NDArray[Any] = np.asarray(frame, np.float32 if frame.dtype == np.uint8 else np.float64)
    return levels if levels.ndim == 2 else levels[..., 0] if levels.shape[-1] < 3 else levels[..., :3] @ LUMA
