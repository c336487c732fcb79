"""Packages that `pip install echotruth` leaves out, and the extra that installs them."""

import json
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import distributions
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

MAKE = (
    *("bokeh", "cv2", "imageio_ffmpeg", "matplotlib", "meshio", "numba", "pypardiso", "pyvista"),
    *("scipy", "skimage", "snakemake"),
)
"""Packages of the extra `make`, by the names by which they are imported."""


class MissingPackage(ModuleNotFoundError):
    """Raised if something needs a package of an extra that is not installed; the message names both."""


@contextmanager
def explained(what: str) -> Iterator[None]:
    """Say what needs a package of the extra `make`, and how it is installed, where the import of one fails.

    Parameters
    ----------
    what : str
        What is imported or done within, as the user calls it.

    Raises
    ------
    MissingPackage
        In place of the error of such an import; others pass.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        if isinstance(error, MissingPackage) or package not in MAKE:
            raise
        raise MissingPackage(f"{what} needs the package {package}: {installation('make')}", name=package) from None


def optional(package: str, extra: str, error: type[Exception], of: str = "") -> Any:
    """Import a package of an extra, or raise an error that says what needs it (`of`, as it begins) and how to get it.

    It is for what a call may or may not need; :func:`explained` for what a whole command needs.
    """
    try:
        return import_module(package)
    except ImportError:
        raise error(f"{of}needs the package {package}: {installation(extra)}") from None


def require(package: str) -> None:
    """Raise the error of an import of a package that is not installed, without importing it."""
    if find_spec(package) is None:
        raise ModuleNotFoundError(f"No module named {package!r}", name=package)


def installation(extra: str) -> str:
    """Command that installs an extra, from the folder or wheel echotruth was installed from if it is still there."""
    # PEP 610: pip and uv note where what they install comes from, unless it is an index.
    notes = (found.read_text("direct_url.json") for found in distributions(name="echotruth"))
    note = json.loads(next(notes, None) or "{}")
    source = unquote(urlsplit(note.get("url", "")).path)
    if not note.get("url", "").startswith("file:") or not Path(source).exists():
        return f"pip install 'echotruth[{extra}]'"
    editable = "-e " if note.get("dir_info", {}).get("editable") else ""
    return f"pip install {editable}{shlex.quote(f'{source}[{extra}]')}"
