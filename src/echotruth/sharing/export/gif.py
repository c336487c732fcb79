"""GIF: grey levels as they are, or 256 colours with an overlay."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError
from echotruth.sharing.export.overlay import pictures

MAX_RATE = 50
"""Frames per second that browsers show: they take shorter times for a mistake."""


def write(clip: ExportedClip, path: Path, overlay: Sequence[str], rate: float) -> None:
    """Write a looping animation; its comment holds the scale and the frame time of the heart as JSON.

    Parameters
    ----------
    clip : ExportedClip
    path : Path
    overlay : sequence of str
        As :func:`echotruth.sharing.export.overlay.pictures` takes them.
    rate : float
        Frames per second; a GIF counts in hundredths of a second.

    Raises
    ------
    ExportError
        If the rate is one that a GIF does not have.
    """
    if rate > MAX_RATE:
        raise ExportError(f"--rate {rate:g}: a GIF shows {MAX_RATE} frames per second at most: use less, or mp4")
    first, *others = _indexed(pictures(clip, overlay))
    duration = 10 * round(100 / rate)
    first.save(
        path, save_all=True, append_images=others, duration=duration, loop=0, optimize=False, comment=clip.note.encode()
    )


def _indexed(frames: NDArray[np.uint8]) -> list[Image.Image]:
    """Grey images, or images with one palette for all, so that colours do not flicker."""
    images = [Image.fromarray(frame) for frame in frames]
    if frames.ndim == 3:
        return images
    some = frames[:: max(1, len(frames) // 8)]
    palette = Image.fromarray(some.reshape(-1, *frames.shape[2:])).quantize(256)
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
