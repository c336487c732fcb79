"""Reading a repository at a notebook: the whole tree, one heart, or one clip."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from echotruth.evaluation.choice import image_size, job_of
from echotruth.heart import Heart
from echotruth.imaging.view import Plane
from echotruth.notebook.datasets import clip_dataset
from echotruth.notebook.derived import MEANING, stored
from echotruth.repository import schema
from echotruth.repository.ledger import repository_folder
from echotruth.repository.remote import hierarchy, is_url

if TYPE_CHECKING:
    import xarray as xr
    from zarr.storage import ObjectStore


def open(repository: str | Path) -> xr.DataTree:
    """Open a repository.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`, or the address `s3://BUCKET/FOLDER` to which one was uploaded.

    Returns
    -------
    DataTree
        One group per stage (docs/schema.md), read when used; `tree["cases"].to_dataset().to_dataframe()` is the table
        of cases, with all keys that can be swept. Cases and views that have left the configuration stay: the status
        of such a case is `retired`, and `tree.attrs["config"]["views"]` are the present views.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    RemoteError
        If the address cannot be reached.

    Examples
    --------
    >>> import echotruth as et
    >>> tree = et.open("out/demo")
    >>> list(tree["cases"]["status"].values)
    ['complete']
    >>> tree["bmode/128"].sel(view="mid").isel(case=0)["image"].dims
    ('frame', 'axial', 'lateral')
    """
    import xarray as xr

    if is_url(repository):
        store: Path | ObjectStore = hierarchy(str(repository))
    else:
        folder = repository_folder(repository)
        store = folder / f"{folder.resolve().name}.zarr"
    groups = xr.open_groups(store, engine="zarr", create_default_indexes=False)  # type: ignore[arg-type]  # it may be a store
    groups["/cases"] = _with_constants(groups["/cases"])
    return xr.DataTree.from_dict(_indexed(groups))


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

    Examples
    --------
    >>> import echotruth as et
    >>> heart = et.load_heart("out/demo", "heart")
    >>> heart.displacement.shape == (heart.config.loop.frames, len(heart.nodes), 3)
    True
    """
    return job_of(repository, case).heart


def load_clip(
    repository: str | Path,
    case: str = "heart",
    view: str = "mid",
    size: int | None = None,
    variables: Iterable[str] | None = None,
) -> xr.Dataset:
    """Read a clip of a repository with its truth, as :func:`echotruth.image` returns it.

    Parameters
    ----------
    repository : str or Path
    case : str
        Case id, as in `cases.csv`.
    view : str
    size : int, optional
        Pixels along a side. Default: the largest.
    variables : iterable of str, optional
        Those to read, as `("image", "flow")`, and what follows from them. Default: all.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view, size or variable.

    Examples
    --------
    >>> import echotruth as et
    >>> clip = et.load_clip("out/demo", "heart", "long_axis", size=128, variables=("image", "flow"))
    >>> clip["flow"].dims, clip["flow"].units
    (('frame', 'to', 'axial', 'lateral', 'vector'), 'm')
    """
    job = job_of(repository, case, view)
    config = job.case.config
    size = image_size(config, size)
    arrays = {f"bmode/{size}": schema.BMODE, f"truth/{size}": schema.TRUTH}
    wanted = _arrays(variables, {array.name for group in arrays.values() for array in group})
    names = {group: [array.name for array in members if array.name in wanted] for group, members in arrays.items()}
    values = {group: job.read(group, *members) for group, members in names.items() if members}
    return clip_dataset(job.heart, job.case, view, Plane(**job.read("phantom", "origin", "axes")), values)


def _arrays(variables: Iterable[str] | None, known: set[str]) -> set[str]:
    """Names of the stored arrays that variables are made from: all, if none are given."""
    if variables is None:
        return known
    asked = stored([variables] if isinstance(variables, str) else variables)
    if not asked or not asked <= known:
        unknown = ", ".join(map(repr, sorted(asked - known))) or "none"
        raise ValueError(f"variables: {unknown}: use any of {', '.join(sorted({*known, *MEANING} - {'label'}))}.")
    return asked


OF_GROUP = ("axial", "lateral", "course")
"""Coordinates that differ between groups."""


def _with_constants(cases: xr.Dataset) -> xr.Dataset:
    """Table of cases with a column for every key: those that do not differ have no array.

    A retired case has no values.
    """
    retired = cases["status"].values == "retired"
    columns = {f"cases:{key}": _column(value, retired) for key, value in cases.attrs["constants"].items()}
    arrays = [array for array in schema.parameters(columns) if array not in schema.CASES]
    about = [{"units": array.units, "long_name": array.long_name} for array in arrays]
    values = zip(arrays, columns.values(), about, strict=True)
    return cases.assign({array.name: ("case", column, attributes) for array, column, attributes in values})


def _column(value: str | float | None, retired: NDArray[np.bool_]) -> NDArray[np.generic]:
    if isinstance(value, str):
        return np.where(retired, "", value) if retired.any() else np.full(len(retired), value)
    return np.where(retired, np.nan, np.nan if value is None else float(value))


def _indexed(groups: dict[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """The groups with indexes of their labels; groups share those that are the same, which are read once.

    The attribute `labels` is left out: it is for readers without coordinates.
    """
    import xarray as xr

    shared: dict[str, xr.Coordinates] = {}
    indexed = {}
    for path, group in groups.items():
        own = {}
        for name in (name for name, array in group.coords.items() if array.dims == (name,)):
            key = f"{path}/{name}" if name in OF_GROUP else str(name)
            if key not in shared:
                shared[key] = xr.Coordinates({name: group.variables[name].load()})
            own[key] = shared[key]
        variables = {name: array for coords in own.values() for name, array in coords.items()}
        indexes = {name: index for coords in own.values() for name, index in coords.xindexes.items()}
        indexed[path] = group.assign_coords(xr.Coordinates(variables, indexes))
        indexed[path].attrs.pop("labels", None)
    return indexed
