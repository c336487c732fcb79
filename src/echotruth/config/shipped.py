"""What comes with the package: the workflow, the configurations of the folder config, and a repository as a sample; all
travel in the wheel.
"""

import re
import textwrap
from contextlib import suppress
from difflib import get_close_matches
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Any

import yaml

from echotruth import files

_PLACES = (Path(__file__).parents[1] / "shipped", Path(__file__).parents[3])
ROOT = next((place for place in _PLACES if (place / "Snakefile").is_file()), _PLACES[0])
"""Folder of what is shipped: `shipped` in an installed package (pyproject.toml), or the checkout."""

SAMPLE = "sample"
"""Name of the repository that is shipped, which the configuration of that name makes."""
NOT_WRITTEN = "comes with the package and is not written to: echotruth merge sample sample copies it to out/sample"
"""What an error says of the shipped repository, whose name or path stands before it."""


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


def citation() -> dict[str, Any]:
    """How to cite echotruth, and under `preferred-citation` the paper whose method is used, as CITATION.cff has it."""
    return dict(yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8")))


@cache
def sample() -> Path:
    """Folder of the shipped repository, which is unpacked into the user's cache, or else into a temporary folder."""
    from echotruth.archive import unpacked

    archive = _PLACES[0] / f"{SAMPLE}.zip"
    if home := files.user_cache():
        with suppress(OSError):
            return unpacked(archive, home)
    return unpacked(archive, files.temporary())


def repository(path: str | Path) -> str | Path:
    """The path itself, or the folder of the shipped repository if nothing has this path and it is its name."""
    return sample() if str(path) == SAMPLE and not Path(path).exists() else path


def is_sample(folder: Path) -> bool:
    """Whether a folder is that of the shipped repository, in which nothing is written."""
    folder = folder.resolve()
    return folder.name.startswith(f"{SAMPLE}-") and folder == sample().resolve()  # do not unpack it for this question


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
