"""Packages that `pip install echotruth` leaves out, and the extra that installs them."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

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
        raise MissingPackage(
            f"{what} needs the package {package}: pip install 'echotruth[make]'", name=package
        ) from None


def require(package: str) -> None:
    """Raise the error of an import of a package that is not installed, without importing it."""
    if find_spec(package) is None:
        raise ModuleNotFoundError(f"No module named {package!r}", name=package)
