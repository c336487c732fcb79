"""H.264 videos, which browsers and slides play."""

from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

QUALITY = 12
"""Constant rate factor of x264: grey levels of the default heart's wall err by 2.3 (RMS), 1 % by more than 7."""


def write(
    path: Path,
    frames: NDArray[np.uint8],
    rate: float,
    quality: int = QUALITY,
    comment: str = "",
    preset: str = "medium",
) -> None:
    """Write an MP4; the same frames give the same bytes.

    A side of an odd number of pixels gets one more, black, at the right and the bottom, which H.264 needs.

    Parameters
    ----------
    path : Path
    frames : ndarray of shape (frame, height, width) or (frame, height, width, 3), uint8
        Grey levels or RGB.
    rate : float
        Frames per second.
    quality : int
        Constant rate factor; the less, the better.
    comment : str
        Of the file.
    preset : str
        Of x264: how long it looks for what is alike in other frames.

    Raises
    ------
    OSError
        If the disk is full.
    """
    import imageio_ffmpeg

    _, height, width = frames.shape[:3]
    same_twice = ["-threads", "1", "-fflags", "+bitexact"]  # one thread, and no version of the program
    frames = np.pad(frames, [(0, 0), (0, height % 2), (0, width % 2), *[(0, 0)] * (frames.ndim - 3)])
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
        output_params=["-crf", str(quality), "-preset", preset, *same_twice, "-metadata", f"comment={comment}"],
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
        raise OSError(f"{path.parent}: the video could not be written: the folder must have space")
