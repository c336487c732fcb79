"""What is said if something cannot be exported."""

from importlib import import_module
from typing import Any

from echotruth.extras import installation


class ExportError(ValueError):
    """Raised if something cannot be exported; the message says why, and what to do."""


def optional(package: str) -> Any:
    """Import an optional package, or raise an :class:`ExportError` that says how to install it."""
    try:
        return import_module(package)
    except ImportError:
        extra = "export" if package == "h5py" else "clinical"
        raise ExportError(f"needs the package {package}: {installation(extra)}") from None
