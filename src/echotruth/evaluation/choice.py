"""What is asked for of a repository: cases, views, image sizes and trackers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from echotruth.config import Config

Item = TypeVar("Item", str, int)


def chosen(
    what: str,
    names: Sequence[Item] | None,
    known: Sequence[Item],
    folder: Path | None = None,
    error: type[ValueError] = ValueError,
) -> list[Item]:
    """Those of the known names that are asked for, in their order; all if none are.

    Parameters
    ----------
    what : str
        What the names are, for the message.
    names : sequence or None
        A text is a single name.
    known : sequence
    folder : Path, optional
        Folder of the repository, for the message to a user of the command line.
    error : type of ValueError, optional
        What is raised.

    Raises
    ------
    ValueError
        If one is not known.
    """
    if isinstance(names, str):
        names = [names]
    for name in names or ():
        if name not in known:
            choices = ", ".join(map(str, known[:20])) or "none: it has no such thing"
            asked = f"{what} = {name!r}: use one of {choices}."
            raise error(asked if folder is None else f"{name} is not a {what} of {folder}: use {choices}")
    return [name for name in known if not names or name in names]


def image_size(config: Config, size: int | None) -> int:
    """Pixels along a side of a clip: the size asked for, or the largest.

    Raises
    ------
    ValueError
        If the configuration has no clips of that size.
    """
    sizes = config.bmode.sizes
    if size is not None and size not in sizes:
        known = ", ".join(map(str, sizes))
        raise ValueError(f"size = {size}: use one of {known}, which bmode.size_px and bmode.downsampling set.")
    return sizes[0] if size is None else size
