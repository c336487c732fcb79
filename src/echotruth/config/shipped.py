"""The configurations that come with the package: those of the folder config, which travel in the wheel too."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

FOLDERS = (Path(__file__).parents[1] / "examples", Path(__file__).parents[3] / "config")
"""Where they are in an installed package (pyproject.toml puts them there), and in a checkout."""


def folder() -> Path:
    """Folder of the shipped configurations."""
    return next((place for place in FOLDERS if (place / "mouse.yaml").is_file()), FOLDERS[0])


def names() -> list[str]:
    """Names of the shipped configurations, such as `demo`."""
    return sorted(path.stem for path in folder().glob("*.yaml"))


def path_of(name: str) -> Path:
    """File of a shipped configuration."""
    return folder() / f"{name}.yaml"


def found(path: str) -> str:
    """The path itself, or the file of a shipped configuration if nothing has this path and it is the name of one."""
    return str(path_of(path)) if path in names() and not Path(path).exists() else path


def summary(name: str) -> str:
    """First sentence of the comment at the head of a shipped configuration."""
    lines = path_of(name).read_text(encoding="utf-8").splitlines()
    head = " ".join(line.removeprefix("#").strip() for line in lines[: _height(lines)])
    return textwrap.shorten(re.split(r"(?<=\.)\s", head, maxsplit=1)[0].rstrip("."), 110, placeholder=" ...")


def _height(lines: list[str]) -> int:
    """Number of lines of the comment at the head."""
    return next((number for number, line in enumerate(lines) if not line.startswith("#")), len(lines))
