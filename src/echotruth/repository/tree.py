"""A repository as one xarray DataTree."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from echotruth.repository import schema

if TYPE_CHECKING:
    import xarray as xr
    from zarr.storage import ObjectStore

OF_GROUP = ("axial", "lateral", "course")
"""Coordinates that differ between groups."""


def open_tree(store: Path | ObjectStore) -> xr.DataTree:
    """Open a Zarr hierarchy: one group per stage (docs/schema.md), read when used.

    Parameters
    ----------
    store : Path or ObjectStore
        `NAME.zarr`.
    """
    import xarray as xr

    opened = {"engine": "zarr", "create_default_indexes": False, "zarr_format": 3}
    groups = xr.open_groups(store, **opened)  # type: ignore[arg-type]  # it may be a store
    groups["/cases"] = _with_constants(groups["/cases"])
    return xr.DataTree.from_dict(_indexed(groups))


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
