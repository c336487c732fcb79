"""What is said of a clip or a wall that cannot be used."""

from importlib import import_module
from pathlib import Path
from typing import Any


class EchoError(ValueError):
    """Raised if a clip or a wall cannot be used; the message names the file, what is wrong and what would be right."""


def one_line(error: Exception) -> str:
    """What a library says of a file, on one line of 200 letters at most."""
    return " ".join(str(error).split())[:200]


def optional(package: str, path: Path) -> Any:
    """Import an optional package that reads a file, or raise an :class:`EchoError` that says how to install it."""
    try:
        return import_module(package)
    except ImportError:
        raise EchoError(f"{path}: needs the package {package}: pip install 'echotruth[clinical]'") from None
