"""The Zarr hierarchy: laid out once, then written a whole shard at a time by the job that owns it.

Every array is rectangular over (case, view, ...). A shard holds all that one job
writes of one array, so parallel jobs never touch the same file, and a clip is one
file. Chunks carry a crc32c checksum: a flipped bit is an error, not a wrong number.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import ArrayLike, NDArray
from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec

from echotruth.repository import schema
from echotruth.repository.schema import Array

Values = dict[str, ArrayLike]


# A shard that holds nothing but fill values is a result too: it must stand on disk like any other.
zarr.config.set({"array.write_empty_chunks": True})


class NotWritten(ValueError):
    """An array of which the job that owns it has not written its part."""


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
        """Make or grow all arrays; those already as they should be are left untouched.

        Parameters
        ----------
        arrays : dict
            Path of a group to its arrays.
        sizes : dict
            Length of every dimension without labels.
        labels : dict
            Values of every coordinate; `group:name` goes before `name`.
        attributes : dict, optional
            Path of a group to its attributes.
        """
        root = zarr.open_group(self.path, mode="a", zarr_format=3, use_consolidated=False)
        for gone in set(_groups(root)) - set(arrays):
            del root[gone]
        for path, members in arrays.items():
            group = root.require_group(path)
            own = {name.removeprefix(f"{path}:"): np.asarray(values) for name, values in labels.items()}
            lengths = sizes | {name: len(values) for name, values in own.items() if values.ndim == 1}
            coordinates = schema.coordinates(members)
            columns = [array for array in members if f"{path}:{array.name}" in labels]
            for gone in set(group.array_keys()) - {array.name for array in (*members, *coordinates)}:
                del group[gone]
            group.attrs.put((attributes or {}).get(path, {}))
            for array in members:
                if array not in columns:
                    _require(group, array, lengths, coordinates)
            for array in (*coordinates, *columns):
                _whole(group, array, own[array.name])

    def write(self, group: str, values: Values, *row: int) -> None:
        """Write the shards of one job.

        Parameters
        ----------
        group : str
            As "bmode/512".
        values : dict
            Name of an array to its values for this case (and view).
        *row : int
            Row of the case, and index of the view.
        """
        arrays = self._open(group, "r+")
        for name, value in values.items():
            array = arrays[name]
            array[row] = np.asarray(value, dtype=array.dtype)

    def read(self, group: str, *row: int, names: tuple[str, ...] | None = None) -> dict[str, NDArray[Any]]:
        """Arrays of a group for one case (and view); a missing or damaged shard is an error."""
        arrays = self._open(group, "r")
        wanted = [array_of(group, name) for name in names] if names else _held(arrays, group)
        for array in wanted:
            self._require_written(group, array, row[: array.leading])
        return {array.name: np.asarray(arrays[array.name][row[: array.leading]]) for array in wanted}

    def _require_written(self, group: str, array: Array, row: tuple[int, ...]) -> None:
        """Zarr reads a missing shard as fill values; here it is an error."""
        if not self._shard(group, array, row).is_file():
            first = f"run the stage {group.partition('/')[0]} first"
            raise NotWritten(f"{self.path}: {group}/{array.name} holds nothing in row {row}: {first}")

    def _shard(self, group: str, array: Array, row: tuple[int, ...]) -> Path:
        """The one file in which a job's part of an array stands."""
        indices = (*row, *[0] * (len(array.dims) - len(row)))
        return self.path.joinpath(group, array.name, "c", *map(str, indices))

    def files(self, group: str, *row: int) -> list[Path]:
        """Files that hold what one job wrote in a group, in a fixed order."""
        shards = (self._shard(group, array, row) for array in schema_of(group) if array.leading == len(row))
        return sorted(shard for shard in shards if shard.is_file())

    def write_column(self, name: str, values: ArrayLike) -> None:
        """Write a column of the table of cases, one value a row."""
        column = self._open("cases", "r+")[name]
        column[...] = np.asarray(values)

    def describe(self, attributes: dict[str, Any]) -> None:
        """Write the attributes of the whole and gather the metadata of all arrays into one file."""
        root = zarr.open_group(self.path, mode="r+", use_consolidated=False)
        root.attrs.put(json.loads(json.dumps(attributes)))
        for stray in self.path.rglob("*.partial"):  # a killed job leaves the file it was writing
            stray.unlink()
        with warnings.catch_warnings():
            # Readers that do not know the consolidated copy read the metadata one by one.
            warnings.filterwarnings("ignore", "Consolidated metadata")
            zarr.consolidate_metadata(self.path)

    def _open(self, group: str, mode: Any) -> zarr.Group:
        return zarr.open_group(self.path, path=group, mode=mode, use_consolidated=False)


def schema_of(group: str) -> tuple[Array, ...]:
    """Arrays of a group, as "bmode/512"."""
    stage = group.partition("/")[0]
    return schema.ALL[stage]


def array_of(group: str, name: str) -> Array:
    """One array of a group."""
    return next(array for array in schema_of(group) if array.name == name)


def _held(group: zarr.Group, path: str) -> tuple[Array, ...]:
    """Arrays of a group that are in it: of RF only what is asked for is kept."""
    return tuple(array for array in schema_of(path) if array.name in group)


def _groups(root: zarr.Group) -> list[str]:
    """Paths of the groups that hold arrays."""
    arrays = [name for name, item in root.members(max_depth=None) if isinstance(item, zarr.Array)]
    return sorted({name.rpartition("/")[0] for name in arrays})


def _require(group: zarr.Group, array: Array, sizes: dict[str, int], coordinates: tuple[Array, ...]) -> zarr.Array[Any]:
    """The array as the schema has it: as it is, grown by cases, or made anew."""
    shape = tuple(sizes[dim] for dim in array.dims)
    old = group.get(array.name)
    if not isinstance(old, zarr.Array) or not _grows(old, array, shape):
        return _create(group, array, shape, coordinates)
    if old.shape != shape and array.dtype == "string":
        return _create(group, array, shape, coordinates)  # in one chunk, and written as a whole when published
    if old.shape != shape:
        old.resize(shape)
    return old


def _whole(group: zarr.Group, array: Array, values: NDArray[Any]) -> None:
    """An array that no job owns, in one chunk: a coordinate or a column of the table of cases."""
    old = group.get(array.name)
    if not isinstance(old, zarr.Array) or old.shape != values.shape or not _grows(old, array, values.shape):
        old = _create(group, array, values.shape, ())
    old[...] = values


def _grows(old: zarr.Array[Any], array: Array, shape: tuple[int, ...]) -> bool:
    """Whether an array on disk is the one of the schema, but for the number of cases and views."""
    same_kind = array.dtype == "string" or old.dtype == np.dtype(array.dtype)
    same_dims = old.metadata.dimension_names == array.dims
    return same_kind and same_dims and old.shape[array.leading :] == shape[array.leading :]


def _create(group: zarr.Group, array: Array, shape: tuple[int, ...], coordinates: tuple[Array, ...]) -> zarr.Array[Any]:
    attributes = {"units": array.units, "long_name": array.long_name}
    beside = [other.name for other in coordinates if other.dims != (other.name,) and set(other.dims) <= set(array.dims)]
    if beside:
        attributes["coordinates"] = " ".join(beside)
    image = array.dtype == "uint8" and array.dims[-2:] == ("axial", "lateral")
    compressor = BloscCodec(cname="zstd", clevel=5, shuffle="bitshuffle") if image else ZstdCodec(level=3)
    shard, chunk = _shard(array, shape)
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


def _shard(array: Array, shape: tuple[int, ...]) -> tuple[tuple[int, ...] | None, tuple[int, ...]]:
    """Shard and chunk: a shard is what one job owns, a chunk one frame of it."""
    if array.dtype == "string" or not array.leading or array in schema.COORDINATES:
        return None, tuple(max(size, 1) for size in shape)
    shard = tuple(1 if dim in ("case", "view") else size for dim, size in zip(array.dims, shape, strict=True))
    chunk = tuple(1 if dim == "frame" else size for dim, size in zip(array.dims, shard, strict=True))
    return (None, shard) if chunk == shard or np.prod(shard) < 4096 else (shard, chunk)
