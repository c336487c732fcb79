"""The arrays that a pack holds, by their names, with dimensions, coordinates and units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echotruth.repository import schema
from echotruth.repository.array import Array
from echotruth.repository.packing import Pack, sections

if TYPE_CHECKING:
    import xarray as xr


def unpack(data: xr.Dataset, *names: str) -> xr.Dataset:
    """Give the numbers in `scores`, `courses`, `limits` and `scalars` as the arrays that they belong to.

    Parameters
    ----------
    data : Dataset
        A group of a repository, as `physiology` or `evaluation/512/dis`, or a selection of it.
    *names : str
        Names of the arrays that are wanted, as `nrmse`; all and those that are not packed if there are none.

    Returns
    -------
    Dataset
        As `nrmse` (case, view, region, component); docs/schema.md lists all.

    Raises
    ------
    ValueError
        If there is no such array, or the selection has a part of its numbers only.

    Examples
    --------
    >>> import echotruth as et
    >>> measures = et.unpack(et.Repository("out/demo").tree["physiology"].to_dataset(), "ejection_fraction", "gls")
    >>> measures["gls"].dims, measures["gls"].units
    (('case',), '1')
    """
    import xarray as xr

    found: dict[str, xr.DataArray] = {}
    packs = _packs(data)
    for pack in packs:
        members = {member.name: member for member in pack.members}
        packed = data[pack.array.name]
        labels = [str(label) for label in packed[pack.dimension].values]
        for name, places, coordinates in sections(labels):
            if name in names or not names:
                chosen = packed.isel({pack.dimension: places})
                found[name] = _member(chosen, pack, members[name], coordinates)
    unpacked = [pack.array.name for pack in packs]
    plain = [str(name) for name in data.data_vars if name not in unpacked]
    found |= {name: data[name] for name in plain if name in names or not names}
    for name in names:
        if name not in found:
            raise ValueError(f"{name} is not an array of this group: see docs/schema.md")
    return xr.Dataset(found, attrs=data.attrs)


def _packs(data: xr.Dataset) -> list[Pack]:
    """The packs that a data set has; groups have packs of one name."""
    every = [pack for packs in schema.PACKS.values() for pack in packs if pack.array.name in data.data_vars]
    return [pack for pack in every if pack.dimension in data.dims and _names(data, pack) <= set(pack.names)]


def _names(data: xr.Dataset, pack: Pack) -> set[str]:
    """Names of the arrays of which a pack has numbers."""
    return {str(label).partition("[")[0] for label in data[pack.dimension].values}


def _member(packed: xr.DataArray, pack: Pack, member: Array, coordinates: list[list[str]]) -> xr.DataArray:
    """One array, from its numbers along the last dimension of a pack."""
    import xarray as xr

    own = pack.own(member)
    shared = [str(dim) for dim in packed.dims if dim != pack.dimension]
    if packed.sizes[pack.dimension] != np.prod([len(column) for column in coordinates], dtype=int):
        raise ValueError(f"{member.name}: the selection has a part of its numbers: select all, and then of the array")
    values = packed.transpose(*shared, pack.dimension).values
    shape = [packed.sizes[dim] for dim in shared] + [len(column) for column in coordinates]
    kept = {name: array for name, array in packed.coords.items() if pack.dimension not in array.dims}
    labels = {dim: _typed(dim, column) for dim, column in zip(own, coordinates, strict=True)}
    about = {"units": member.units, "long_name": member.long_name}
    found = xr.DataArray(values.reshape(shape), kept | labels, (*shared, *own), attrs=about)
    return found.transpose(*(dim for dim in member.dims if dim in found.dims), ...)


def _typed(dim: str, column: list[str]) -> np.ndarray:
    """Values of a coordinate, of which the label has the text."""
    kind = next(array.dtype for array in schema.COORDINATES if array.name == dim)
    return np.array(column if kind == "string" else [int(value) for value in column])
