"""Configuration and cases that a command is given."""

import sys
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
        sys.exit(named(f"{path}: does not exist: {shipped.meant(Path(path)) or f'give {expected}'}"))
    try:
        config = load(path)
        return config, expand(config, path)
    except ConfigError as error:
        sys.exit(named(str(error)))
