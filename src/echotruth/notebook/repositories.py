"""Reading a repository at a notebook: the whole tree, one heart, or one clip."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.heart import Heart
from echotruth.imaging.view import Plane
from echotruth.notebook.datasets import clip_dataset, image_size
from echotruth.repository.ledger import rows
from echotruth.workflow.job import Job

if TYPE_CHECKING:
    import xarray as xr


def open(repository: str | Path) -> xr.DataTree:
    """Open a repository.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Returns
    -------
    DataTree
        One group per stage (docs/schema.md), read when used; `tree["cases"].to_dataset().to_dataframe()` is the table
        of cases.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    """
    import xarray as xr

    folder = _folder(repository)
    return xr.open_datatree(folder / f"{folder.resolve().name}.zarr", engine="zarr")


def load_heart(repository: str | Path, case: str = "heart") -> Heart:
    """Read a heart of a repository; :func:`echotruth.image` images it anew, with any probe and view.

    Parameters
    ----------
    repository : str or Path
    case : str
        Case id, as in `cases.csv`.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository or case.
    """
    return _job(repository, case).heart


def load_clip(repository: str | Path, case: str = "heart", view: str = "mid", size: int | None = None) -> xr.Dataset:
    """Read a clip of a repository with its truth, as :func:`echotruth.image` returns it.

    Parameters
    ----------
    repository : str or Path
    case : str
        Case id, as in `cases.csv`.
    view : str
    size : int, optional
        Pixels along a side. Default: the largest.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view or size.
    """
    job = _job(repository, case, view)
    config = job.case.config
    if view not in config.views:
        raise ValueError(f"view = {view!r}: use one of {', '.join(config.views)}.")
    size = image_size(config, size)
    values = {group: job.read(group) for group in (f"bmode/{size}", f"truth/{size}")}
    return clip_dataset(job.heart, job.case, view, Plane(**job.read("phantom", "origin", "axes")), values)


def _folder(repository: str | Path) -> Path:
    folder = Path(repository)
    folder = folder.parent if folder.suffix == ".zarr" else folder
    if not (folder / "registry.txt").is_file():
        raise FileNotFoundError(f"{repository}: is not a repository: give the folder that a run made, as out/demo")
    return folder


def _job(repository: str | Path, case: str, view: str | None = None) -> Job:
    folder = _folder(repository)
    known = rows(folder / "registry.txt")
    if case not in known:
        raise ValueError(f"case = {case!r}: use one of {', '.join(list(known)[:20])}.")
    return Job(folder, "tracking", case, view)
