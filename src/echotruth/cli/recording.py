"""Arguments of commands that read a recorded clip."""

import argparse
import re
from pathlib import Path
from typing import Any

OPTIONS = {"spacing_mm": "--spacing-mm", "frame_time_ms": "--frame-time-ms"}
"""Names in messages of the library, and those of the command line."""


def add(parser: argparse.ArgumentParser, several: bool = False) -> None:
    """Add the clip, or several, and what their files may not say."""
    text = "DICOM, video, .gif, NIfTI or .npy of one's own echo, or a folder of images"
    parser.add_argument("clip", type=Path, nargs="+" if several else None, help=text)
    parser.add_argument("--spacing-mm", type=float, help="side of a pixel, mm (default: what the file says)")
    parser.add_argument(
        "--frame-time-ms", type=float, help="time from frame to frame, ms (default: what the file says)"
    )
    text = "first frame, at end-diastole, and the frame after the last (default: from R wave to R wave, else all)"
    parser.add_argument("--cycle", type=int, nargs=2, metavar=("FIRST", "STOP"), help=text)
    sides = ("LEFT", "TOP", "RIGHT", "BOTTOM")
    parser.add_argument("--crop", type=int, nargs=4, metavar=sides, help="part of the image, px (default: all)")


def read(clip: Path, arguments: argparse.Namespace) -> Any:
    """Read a clip, with the options of the arguments.

    Raises
    ------
    EchoError
        If it is no clip, or an option is missing or wrong.
    """
    from echotruth.echo.clip import read_clip
    from echotruth.echo.failure import EchoError

    try:
        return read_clip(
            clip,
            spacing_mm=arguments.spacing_mm,
            frame_time_ms=arguments.frame_time_ms,
            cycle=arguments.cycle,
            crop=arguments.crop,
        )
    except EchoError as error:
        said = re.sub(r"\b(spacing_mm|frame_time_ms)\b(?=$| =)", lambda name: OPTIONS[name[0]], str(error))
        raise EchoError(said) from None
