"""What comes with the package: the workflow, and the configurations of the folder config; both travel in the wheel."""

import re
import textwrap
from difflib import get_close_matches
from itertools import takewhile
from pathlib import Path

_PLACES = (Path(__file__).parents[1] / "shipped", Path(__file__).parents[3])
ROOT = next((place for place in _PLACES if (place / "Snakefile").is_file()), _PLACES[0])
"""Folder of what is shipped: `shipped` in an installed package (pyproject.toml), or the checkout."""


def folder() -> Path:
    """Folder of the shipped configurations."""
    return ROOT / "config"


def names() -> list[str]:
    """Names of the shipped configurations, such as `demo`."""
    return sorted(path.stem for path in folder().glob("*.yaml"))


def path_of(name: str) -> Path:
    """File of a shipped configuration."""
    return folder() / f"{name}.yaml"


def found(path: str) -> str:
    """The path itself, or the file of a shipped configuration if nothing has this path and it is the name of one."""
    return str(path_of(path)) if path in names() and not Path(path).exists() else path


def meant(path: Path) -> str:
    """Question for the configuration that may be meant by a path that does not exist; "" if none is like it."""
    beside = [file.name for file in sorted(path.parent.glob("*.yaml"))]
    if close := get_close_matches(f"{path.stem}.yaml", beside, n=1, cutoff=0.8):
        return f"did you mean {path.with_name(close[0])}?"
    is_name = path.suffix in (".yaml", ".yml") or str(path) == path.name
    close = get_close_matches(path.stem, names(), n=1, cutoff=0.75) if is_name else []
    return f"did you mean {close[0]}?" if close else ""


def summary(name: str) -> str:
    """First sentence of the comment at the head of a shipped configuration."""
    lines = path_of(name).read_text(encoding="utf-8").splitlines()
    head = " ".join(line.removeprefix("#").strip() for line in takewhile(lambda line: line.startswith("#"), lines))
    return textwrap.shorten(re.split(r"(?<=\.)\s", head, maxsplit=1)[0].rstrip("."), 110, placeholder=" ...")
