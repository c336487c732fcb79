"""Configuration and cases that a command is given."""

from __future__ import annotations

import sys
from difflib import get_close_matches
from pathlib import Path

from echotruth.cases import Case, expand
from echotruth.cli.command import named
from echotruth.config import Config, shipped
from echotruth.config.loading import ConfigError, load

LISTED = "a name that echotruth new --list shows"


def load_cases(path: str, expected: str = f"a YAML file, or {LISTED}") -> tuple[Config, list[Case]]:
    """Configuration in a file and its cases; if they are not valid, end the command with a line for each error.

    Parameters
    ----------
    path : str
    expected : str
        What the path should be, for the error of one that does not exist.
    """
    if not Path(path).exists():
        sys.exit(named(f"{path}: does not exist: {_meant(Path(path)) or f'give {expected}'}"))
    try:
        config = load(path)
        return config, expand(config, path)
    except ConfigError as error:
        message = str(error)
        if Path(path).parent == shipped.folder() and "cases.file" in message:
            message += f"\n{path}: echotruth new {Path(path).stem} writes it here, with the table that it reads"
        sys.exit(named(message))


def _meant(path: Path) -> str:
    """Question for the configuration that may be meant by a path that does not exist; "" if none is like it."""
    beside = [file.name for file in sorted(path.parent.glob("*.yaml"))]
    if close := get_close_matches(f"{path.stem}.yaml", beside, n=1, cutoff=0.8):
        return f"did you mean {path.with_name(close[0])}?"
    is_name = path.suffix in (".yaml", ".yml") or str(path) == path.name
    close = get_close_matches(path.stem, shipped.names(), n=1, cutoff=0.75) if is_name else []
    return f"did you mean {close[0]}?" if close else ""
