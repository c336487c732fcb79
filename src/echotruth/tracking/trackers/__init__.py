"""The trackers: one module per method, each with a function `track`."""

from collections.abc import Callable
from importlib import import_module
from typing import Any


def function(name: str) -> Callable[..., Any]:
    """Function `track` of a method; its module is imported only here, because some take long to import."""
    return import_module(f"{__name__}.{name}").track
