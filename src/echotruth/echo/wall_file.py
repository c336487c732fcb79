"""The file of a wall without its borders: its name beside a clip, and what its first lines say."""

import os
import re
from dataclasses import dataclass
from pathlib import Path

from echotruth.echo.failure import EchoError


@dataclass(frozen=True)
class Excerpt:
    """Frames and pixels of a recording that a clip shows, as "cycle 31 59, crop 120 40 520 440".

    Attributes
    ----------
    cycle : tuple of int
        First frame, and the frame after the last.
    crop : tuple of int
        Left, top, right, bottom, px.
    """

    cycle: tuple[int, int]
    crop: tuple[int, int, int, int]

    def __str__(self) -> str:
        return f"cycle {' '.join(map(str, self.cycle))}, crop {' '.join(map(str, self.crop))}"

    @property
    def start(self) -> tuple[int, int, int]:
        """First frame, column and row."""
        return self.cycle[0], *self.crop[:2]


def part(text: str) -> Excerpt | None:
    """The part that a text names, or None of an empty one.

    Raises
    ------
    EchoError
        If it names none that can be read, as one of an earlier version.
    """
    if not text:
        return None
    match = re.fullmatch(r"cycle (\d+) (\d+), crop (\d+) (\d+) (\d+) (\d+)", text)
    if match is None:
        raise EchoError(
            f'the part "{text}" in which the wall was drawn cannot be read: write "cycle FIRST STOP, crop LEFT TOP '
            'RIGHT BOTTOM" in its place, which are what was given as --cycle and --crop'
        )
    first, stop, left, top, right, bottom = map(int, match.groups())
    return Excerpt((first, stop), (left, top, right, bottom))


def said(file: Path, what: str) -> str | None:
    """What the comments with which a .csv begins say of its `view` or of the `part` of the clip, or None."""
    if file.suffix.lower() != ".csv" or not file.is_file():
        return None
    with file.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            if not line.startswith("#"):
                break
            if match := re.fullmatch(rf"#\s*{what}\s*:\s*(\S.*?)\s*", line):
                return match[1]
    return None


def default_output(clip: Path) -> Path:
    """The .csv beside a clip: `patient.wall.csv` of patient.dcm, `FOLDER.wall.csv` of a folder of images."""
    whole = Path(os.path.abspath(clip))  # "." has a name too, and a link stays where it is
    ending = r"(\.zarr)?$" if whole.is_dir() else r"(\.nii\.gz|\.[^.]*)?$"
    return whole.with_name(re.sub(ending, ".wall.csv", whole.name, count=1, flags=re.IGNORECASE))
