"""The Zarr hierarchy: laid out once, then written by jobs, one whole shard at a time.

Every array is rectangular over (case, view, ...). A shard holds all that one job writes of one array, so that parallel
jobs never touch the same file, and a clip is one file. Chunks carry a crc32c checksum: a flipped bit is an error, not a
wrong number.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import zarr
from numpy.typing import ArrayLike, NDArray
from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec

from echotruth.repository import schema
from echotruth.repository.schema import Array

Values = dict[str, ArrayLike]

# A shard that holds only fill values is a result too and must exist on disk.
zarr.config.set({"array.write_empty_chunks": True})


class NotWritten(ValueError):
    """Raised if a part of an array was not written by its job."""


class Store:
    """A repository on disk.

    Parameters
    ----------
    path : Path
        The folder, `NAME.zarr`.
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    def lay_out(
        self,
        arrays: dict[str, tuple[Array, ...]],
        sizes: dict[str, int],
        labels: Values,
        attributes: dict[str, dict[str, Any]] | None = None,
    ) -> None:
        """Create or extend all arrays; those that already match are left untouched.

        Parameters
        ----------
        arrays : dict
            Arrays of each group, by its path.
        sizes : dict
            Length of every dimension without coordinates.
        labels : dict
            Values of every coordinate; `group:name` takes precedence over `name`.
        attributes : dict, optional
            Attributes of each group, by its path.
        """
        root = zarr.open_group(self.path, mode="a", zarr_format=3, use_consolidated=False)
        for obsolete in set(_groups(root)) - set(arrays):
            del root[obsolete]
        for path, members in arrays.items():
            group = root.require_group(path)
            values = {name.removeprefix(f"{path}:"): np.asarray(value) for name, value in labels.items()}
            lengths = sizes | {name: len(value) for name, value in values.items() if value.ndim == 1}
            coordinates = schema.coordinates(members)
            columns = [array for array in members if f"{path}:{array.name}" in labels]
            for obsolete in set(group.array_keys()) - {array.name for array in (*members, *coordinates)}:
                del group[obsolete]
            group.attrs.put((attributes or {}).get(path, {}))
            for array in members:
                if array not in columns:
                    _require(group, array, lengths, coordinates)
            for array in (*coordinates, *columns):
                _write_all(group, array, values[array.name])

    def write(self, group: str, values: Values, *row: int) -> None:
        """Write the shards of one job.

        Parameters
        ----------
        group : str
            As "bmode/512".
        values : dict
            Values for this case (and view), by the name of the array.
        *row : int
            Row of the case, and index of the view.
        """
        arrays = self._open(group, "r+")
        for name, value in values.items():
            array = arrays[name]
            array[row] = np.asarray(value, dtype=array.dtype)

    def read(self, group: str, *row: int, names: tuple[str, ...] | None = None) -> dict[str, NDArray[Any]]:
        """Arrays of a group for one case (and view); a missing or damaged shard is an error."""
        opened = self._open(group, "r")
        by_name = {array.name: array for array in schema_of(group)}
        # Only a part of the RF may be stored.
        arrays = [by_name[name] for name in names or by_name if names or name in opened]
        for array in arrays:
            self._require_written(group, array, row[: array.leading])
        return {array.name: np.asarray(opened[array.name][row[: array.leading]]) for array in arrays}

    def _require_written(self, group: str, array: Array, row: tuple[int, ...]) -> None:
        """Raise an error for a missing shard, which Zarr reads as fill values."""
        if not self._shard(group, array, row).is_file():
            remedy = f"run the stage {group.partition('/')[0]} first"
            raise NotWritten(f"{self.path}: {group}/{array.name} has no data in row {row}: {remedy}")

    def _shard(self, group: str, array: Array, row: tuple[int, ...]) -> Path:
        """File that holds the part of an array written by one job."""
        indices = (*row, *[0] * (len(array.dims) - len(row)))
        return self.path.joinpath(group, array.name, "c", *map(str, indices))

    def files(self, group: str, *row: int) -> list[Path]:
        """Files that one job wrote in a group, sorted."""
        shards = (self._shard(group, array, row) for array in schema_of(group) if array.leading == len(row))
        return sorted(shard for shard in shards if shard.is_file())

    def write_column(self, name: str, values: ArrayLike) -> None:
        """Write a column of the table of cases, one value per row."""
        column = self._open("cases", "r+")[name]
        column[...] = np.asarray(values)

    def describe(self, attributes: dict[str, Any]) -> None:
        """Write the attributes of the repository and consolidate the metadata of all arrays in one file."""
        root = zarr.open_group(self.path, mode="r+", use_consolidated=False)
        root.attrs.put(json.loads(json.dumps(attributes)))
        for partial in self.path.rglob("*.partial"):  # a killed job leaves the file it was writing
            partial.unlink()
        with warnings.catch_warnings():
            # Readers that do not know consolidated metadata read those of each array.
            warnings.filterwarnings("ignore", "Consolidated metadata")
            zarr.consolidate_metadata(self.path)

    def _open(self, group: str, mode: Any) -> Mapping[str, zarr.Array[Any]]:
        return cast(Any, zarr.open_group(self.path, path=group, mode=mode, use_consolidated=False))


def schema_of(group: str) -> tuple[Array, ...]:
    """Arrays of a group, as "bmode/512"."""
    stage = group.partition("/")[0]
    return schema.ALL[stage]


def _groups(root: zarr.Group) -> list[str]:
    """Paths of the groups that hold arrays."""
    arrays = [name for name, item in root.members(max_depth=None) if isinstance(item, zarr.Array)]
    return sorted({name.rpartition("/")[0] for name in arrays})


def _require(group: zarr.Group, array: Array, sizes: dict[str, int], coordinates: tuple[Array, ...]) -> zarr.Array[Any]:
    """The array of the schema: the existing one, extended if need be, or a new one."""
    shape = tuple(sizes[dim] for dim in array.dims)
    old = group.get(array.name)
    if not isinstance(old, zarr.Array) or not _matches(old, array, shape):
        return _create(group, array, shape, coordinates)
    if old.shape != shape and array.dtype == "string":
        return _create(group, array, shape, coordinates)  # one chunk, which is rewritten at publication
    if old.shape != shape:
        old.resize(shape)
    return old


def _write_all(group: zarr.Group, array: Array, values: NDArray[Any]) -> None:
    """Write an array that belongs to no job, in one chunk: a coordinate or a column of the table of cases."""
    old = group.get(array.name)
    if not isinstance(old, zarr.Array) or old.shape != values.shape or not _matches(old, array, values.shape):
        old = _create(group, array, values.shape, ())
    old[...] = values


def _matches(old: zarr.Array[Any], array: Array, shape: tuple[int, ...]) -> bool:
    """Whether an array on disk is that of the schema except for the number of cases and views."""
    same_type = array.dtype == "string" or old.dtype == np.dtype(array.dtype)
    same_dims = getattr(old.metadata, "dimension_names", None) == array.dims
    return same_type and same_dims and old.shape[array.leading :] == shape[array.leading :]


def _create(group: zarr.Group, array: Array, shape: tuple[int, ...], coordinates: tuple[Array, ...]) -> zarr.Array[Any]:
    attributes: dict[str, Any] = {"units": array.units, "long_name": array.long_name}
    dims = set(array.dims)
    auxiliary = [other.name for other in coordinates if other.dims != (other.name,) and set(other.dims) <= dims]
    if auxiliary:
        attributes["coordinates"] = " ".join(auxiliary)
    image = array.dtype == "uint8" and array.dims[-2:] == ("axial", "lateral")
    compressor = BloscCodec(cname="zstd", clevel=5, shuffle="bitshuffle") if image else ZstdCodec(level=3)
    shard, chunk = _shard_and_chunk(array, shape)
    return group.create_array(
        array.name,
        shape=shape,
        dtype=str if array.dtype == "string" else array.dtype,
        shards=shard,
        chunks=chunk,
        compressors=[compressor, Crc32cCodec()],
        fill_value=array.fill,
        dimension_names=array.dims,
        attributes=attributes,
        overwrite=True,
    )


def _shard_and_chunk(array: Array, shape: tuple[int, ...]) -> tuple[tuple[int, ...] | None, tuple[int, ...]]:
    """Shapes of a shard, which one job writes, and of a chunk, one frame of it."""
    if array.dtype == "string" or not array.leading or array in schema.COORDINATES:
        return None, tuple(max(size, 1) for size in shape)
    shard = tuple(1 if dim in ("case", "view") else size for dim, size in zip(array.dims, shape, strict=True))
    chunk = tuple(1 if dim == "frame" else size for dim, size in zip(array.dims, shard, strict=True))
    return (None, shard) if chunk == shard or np.prod(shard) < 4096 else (shard, chunk)
