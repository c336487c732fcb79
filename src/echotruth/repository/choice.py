"""Choosing among what a repository has: names and image sizes that are known."""

from collections.abc import Collection, Iterable
from typing import TypeVar

from echotruth.config import Config

Name = TypeVar("Name", str, int)
Names = Iterable[str] | None
"""Names to choose; a text is a single one, and None stands for all."""
Sizes = Iterable[int] | None
"""Image sizes to choose, px; None stands for all."""


def require_known(what: str, name: Name, known: Collection[Name]) -> Name:
    """A name that has to be known; ValueError says what else there is."""
    if name not in known:
        choices = ", ".join(map(str, list(known)[:20])) or "none: it has no such thing"
        raise ValueError(f"{what} = {name!r}: use one of {choices}.")
    return name


def chosen(what: str, names: Iterable[Name] | None, known: Collection[Name]) -> list[Name]:
    """Those of the known names that are asked for, in their order; all if none are.

    Parameters
    ----------
    what : str
        What the names are, for the message.
    names : iterable or None
        A text is a single name.
    known : collection

    Raises
    ------
    ValueError
        If one is not known.
    """
    asked = {require_known(what, name, known) for name in ([names] if isinstance(names, str) else names or ())}
    return [name for name in known if not asked or name in asked]


def image_size(config: Config, size: int | None) -> int:
    """Pixels along a side of a clip: the size asked for, or the largest.

    Raises
    ------
    ValueError
        If the configuration has no clips of that size.
    """
    return config.image_sizes[0] if size is None else require_known("size", size, config.image_sizes)


def require_slices(config: Config, what: str) -> None:
    """Refuse a repository of volumes where only slices will do; ValueError says what reads them."""
    if config.has_volumes:
        remedy = "read these by clip, heart and scores of echotruth.Repository (docs/volumes.md)"
        raise ValueError(f"{what}: needs slices, and {config.name} has volumes: {remedy}.")


def main_view(config: Config) -> str:
    """The view that is shown where only one can be: the mid one, or the first."""
    return "mid" if "mid" in config.views else next(iter(config.views))
