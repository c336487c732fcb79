"""The trackers: one module per method, each with a function `track`."""

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

NAMES = frozenset(module.name for module in iter_modules(__path__))
"""Names of the methods and of their modules."""


def function(name: str) -> Callable[..., Any]:
    """Function `track` of a method; its module is imported only here, because some take long to import."""
    if name not in NAMES:
        raise ValueError(f"{name} is not a method of ours.")
    return import_module(f"{__name__}.{name}").track
