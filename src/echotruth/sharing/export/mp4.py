"""MP4 (H.264), which browsers and slides play."""

from collections.abc import Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import imageio_ffmpeg
import numpy as np

from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError
from echotruth.sharing.export.overlay import pictures

QUALITY = "12"
"""Constant rate factor of x264: grey levels of the default heart's wall err by 2.3 (RMS), 1 % by more than 7."""


def write(clip: ExportedClip, path: Path, overlay: Sequence[str], rate: float) -> None:
    """Write a video; its comment holds the scale and the frame time of the heart as JSON.

    A side of an odd number of pixels gets one more, black, at the right and the bottom, which H.264 needs.

    Parameters
    ----------
    clip : ExportedClip
    path : Path
    overlay : sequence of str
        As :func:`echotruth.sharing.export.overlay.pictures` takes them.
    rate : float
        Frames per second of the video.

    Raises
    ------
    ExportError
        If the disk is full.
    """
    frames = pictures(clip, overlay)
    odd = clip.size % 2
    frames = np.pad(frames, [(0, 0), (0, odd), (0, odd), *[(0, 0)] * (frames.ndim - 3)])
    video = imageio_ffmpeg.write_frames(
        str(path),
        (frames.shape[2], frames.shape[1]),
        pix_fmt_in="gray" if frames.ndim == 3 else "rgb24",
        fps=rate,
        # Once more, because older versions of the package round fps to two decimals.
        input_params=["-r", str(Fraction(rate).limit_denominator())],
        codec="libx264",
        macro_block_size=2,
        ffmpeg_log_level="quiet",
        # One thread and no version of the program: the same bytes twice.
        output_params=["-crf", QUALITY, "-threads", "1", "-fflags", "+bitexact", "-metadata", f"comment={clip.note}"],
    )
    video.send(None)
    with suppress(OSError):  # of a pipe to a process that has ended, in many lines
        for frame in frames:
            video.send(np.ascontiguousarray(frame))
    video.close()
    decoded = 0
    with suppress(RuntimeError, OSError):  # of a file that is no video
        decoded, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
    if decoded != len(frames):  # ffmpeg ends without a word if the disk is full
        raise ExportError(f"{path.parent}: the video could not be written: the folder must have space")
