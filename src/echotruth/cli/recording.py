"""Arguments of commands that read a recorded clip."""

import argparse
import re
from pathlib import Path
from typing import Any

from echotruth.echo.failure import FACTS, EchoError, unsaid

TELLING = (".dcm", ".dicom", ".nii", ".nii.gz", ".zarr")
"""Endings of files that may say the side of pixels and the time from frame to frame; so may a file without one."""


def add(parser: argparse.ArgumentParser, crop: str, several: bool = False) -> None:
    """Add the clip, or several, and what their files may not say; `crop` is what is shown by default, in words."""
    text = "DICOM, video, .gif, NIfTI, .npy or EchoXFlow's .zarr of one's own echo, or a folder of images"
    parser.add_argument("clip", type=Path, nargs="+" if several else None, help=text)
    parser.add_argument("--spacing-mm", type=float, help="side of a pixel, mm (default: what the file says)")
    parser.add_argument(
        "--frame-time-ms", type=float, help="time from frame to frame, ms (default: what the file says)"
    )
    text = "first frame, at end-diastole, and the frame after the last (default: the wall's; else R wave to R wave)"
    parser.add_argument("--cycle", type=int, nargs=2, metavar=("FIRST", "STOP"), help=text)
    sides = ("LEFT", "TOP", "RIGHT", "BOTTOM")
    text = f"part of the image, px (default: that of the wall; else {crop})"
    parser.add_argument("--crop", type=int, nargs=4, metavar=sides, help=text)


def missing(clip: Path, arguments: argparse.Namespace) -> list[str]:
    """Options without which a clip cannot be read, since a file of its kind never says them."""
    is_untold = clip.is_dir() or (clip.is_file() and clip.suffix)
    is_silent = is_untold and not clip.name.lower().endswith(TELLING)
    return [name for name in ("spacing_mm", "frame_time_ms") if is_silent and getattr(arguments, name) is None]


def asked(clip: Path, names: list[str]) -> str:
    """Sentence that asks for options which the file of a clip does not say."""
    return _as_options(unsaid(clip, names))


def _as_options(said: str) -> str:
    """A sentence of the library, with the names that its arguments have on the command line."""
    names = "|".join(FACTS)
    return re.sub(rf"\b({names})\b(?=$|,| =| and )", lambda name: f"--{name[0].replace('_', '-')}", said)


def read(clip: Path, arguments: argparse.Namespace, part: str = "") -> Any:
    """Read a clip, with the options of the arguments, and the part of it where these do not say it.

    Raises
    ------
    EchoError
        If it is no clip, or an option is missing or wrong.
    """
    from echotruth.echo.clip import read_clip

    try:
        return read_clip(
            clip,
            spacing_mm=arguments.spacing_mm,
            frame_time_ms=arguments.frame_time_ms,
            cycle=arguments.cycle,
            crop=arguments.crop,
            part=part,
        )
    except EchoError as error:
        raise EchoError(_as_options(str(error))) from None
