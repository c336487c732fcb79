"""A group of a repository on disk: arrays with their coordinates, units and checksums.

It is made in a folder of its own and moved to its place when it is whole and on the disk, so that no reader sees a
part of it, whatever kills the job or the machine. Each array is one file, a shard; in it, a chunk is one component of
one frame or, of what was tracked, of one cycle, so that it can be read alone and its bytes compress together. Chunks
carry a crc32c checksum: a flipped bit is an error, not a wrong number, and so is a lost or emptied file. Where whole
arrays are read from a disk, so is a file that is not the one that the job wrote.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
import zarr
from numpy.typing import ArrayLike, NDArray
from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec
from zarr.storage import LocalStore

from echotruth import files
from echotruth.config import Config
from echotruth.repository import checksums, remote, rounding, schema
from echotruth.repository.array import Array
from echotruth.repository.checksums import METADATA
from echotruth.repository.places import group_of, job_of

Arrays = dict[str, NDArray[Any]]

COMPONENTS = ("vector", "strain_component", "plane", "wall_component", "label", "to", "size", "reference")
"""Dimensions along which a chunk holds one element; so it does along `frame`, but for what trackers found."""

SMALL = 4096
"""Elements up to which an array is one chunk."""

# What holds only fill values is a result too and must exist on disk.
zarr.config.set({"array.write_empty_chunks": True})


class NotWritten(ValueError):
    """Raised if a group, or an array of it, is not there."""


class ChecksumError(NotWritten):
    """Raised if what is there is not what was written."""


def write_groups(store: Path, groups: Mapping[str, Callable[[Path], None]]) -> None:
    """Make groups, and move each to its place when it is whole, in the place of an earlier one.

    Parameters
    ----------
    store : Path
        `NAME.zarr`.
    groups : dict
        Path of each group below the store -> function that writes it into a folder.
    """
    drafts = {path: store.parent / "drafts" / uuid4().hex for path in groups}
    try:
        for path, write in groups.items():
            write(drafts[path])
            checksums.seal(drafts[path])
            files.sync_all(drafts[path])
        for path, draft in drafts.items():
            (store / path / METADATA).unlink(missing_ok=True)  # first: what is half removed is no group
            shutil.rmtree(store / path, ignore_errors=True)
            (store / path).parent.mkdir(parents=True, exist_ok=True)
            draft.replace(store / path)
            files.sync((store / path).parent)
    finally:
        for draft in drafts.values():
            shutil.rmtree(draft, ignore_errors=True)


def write(
    folder: Path,
    group: str,
    values: Mapping[str, ArrayLike],
    coordinates: Mapping[str, ArrayLike],
    config: Config,
    attributes: Mapping[str, Any],
) -> None:
    """Write a group into a folder that is not there yet.

    Parameters
    ----------
    folder : Path
    group : str
        As `truth/512`.
    values : dict
        Arrays of :data:`echotruth.repository.schema.KINDS`, which are rounded to their quantum.
    coordinates : dict
        Values of coordinates by name; those that belong to no dimension of the arrays are left out.
    config : Config
        Of the case, for the quantum of lengths.
    attributes : dict
        Attributes of the group.
    """
    arrays = {name: array for name, array in schema.arrays_of(group, config.has_volumes).items() if name in values}
    dims = {dim for array in arrays.values() for dim in array.dims}
    opened = zarr.create_group(folder, zarr_format=3)
    is_of_cycle = group == "points" or group.startswith("tracking/")
    alone = COMPONENTS if is_of_cycle else (*COMPONENTS, "frame")
    for name, array in arrays.items():
        step = rounding.quantum(array, config)
        stored = rounding.rounded(np.asarray(values[name], dtype=array.dtype), step)
        about: dict[str, Any] = {"quantum": step} if step is not None else {}
        if "frame" in array.dims:
            about["coordinates"] = "time"
        _create(opened, array, stored, alone, about)
    for name, array in schema.COORDINATES.items():
        if name in coordinates and name not in arrays and dims >= set(array.dims):
            _create(opened, array, np.asarray(coordinates[name]), (), {})
    opened.attrs.update(dict(attributes))


def write_nothing(folder: Path, attributes: Mapping[str, Any]) -> None:
    """Write a group without arrays, whose attributes say why."""
    zarr.create_group(folder, zarr_format=3, attributes=dict(attributes))


def open_group(store: Any, path: str) -> zarr.Group:
    """A group that is there.

    Raises
    ------
    NotWritten
        If it is not, or its metadata are damaged.
    """
    try:
        return zarr.open_group(store, path=path, mode="r", zarr_format=3)
    except FileNotFoundError:
        raise NotWritten(f"{store}: has no group {path}: run its configuration, which makes it") from None
    except (ValueError, KeyError, TypeError) as error:
        remedy = "delete that folder, and run the configuration again"
        raise NotWritten(f"{store}: the metadata of {path} are damaged ({type(error).__name__}): {remedy}") from None


def read(store: Any, path: str, *names: str) -> Arrays:
    """Arrays of a group by name, all if none is named.

    Raises
    ------
    NotWritten
        If the group or an array is not there, or (ChecksumError) is not as it was written.
    """
    group = open_group(store, path)
    if isinstance(store, Path):  # first, since Zarr raises many kinds of what is damaged
        _verify(store, path, names or schema.names_of(group_of(path)))
    present: dict[str, Any] = {} if names else dict(group.arrays())
    for name in names:
        try:
            present[name] = group[name]
        except KeyError:
            why = group.attrs.get("reason")
            lacking = f"{store}: {path} has no {name}: {why or 'run its configuration with this version'}"
            raise NotWritten(lacking) from None
    wanted = names or [name for name in schema.names_of(group_of(path)) if name in present]
    return {name: part(present[name]) for name in wanted}


def _verify(store: Path, path: str, names: Iterable[str]) -> None:
    """Compare the files of arrays with the checksums of the job that wrote them, if there are any."""
    job = job_of(f"{path}/{METADATA}")
    try:
        _, written = checksums.read_sealed(store / job)
    except FileNotFoundError:
        return
    except ValueError as error:
        raise ChecksumError(_damaged(f"{store / job}", str(error))) from None
    for name in names if written else ():
        below = f"{path}/{name}/".removeprefix(f"{job}/")
        for file, hash in written.items():
            if file.startswith(below):
                there = store / job / file
                if not there.is_file() or checksums.checksum(there) != hash:
                    raise ChecksumError(_damaged(str(there), "is not what was written"))


def part(array: zarr.Array[Any], *index: Any) -> NDArray[Any]:
    """Part of an array, given its indices and slices; all of it without.

    Raises
    ------
    ChecksumError
        If its file is lost or empty, of which Zarr makes fill values, or damaged.
    """
    try:
        values = np.asarray(array[index or ...])
    except (ValueError, RuntimeError) as error:
        raise ChecksumError(_damaged(str(array.store_path), f"is damaged ({str(error)[:80]})")) from None
    is_fill = np.isnan(values) if values.dtype.kind == "f" else values == array.fill_value
    if values.size and np.all(is_fill) and not _has_file(array):
        raise ChecksumError(_damaged(str(array.store_path), "has lost its data"))
    return values


def _has_file(array: zarr.Array[Any]) -> bool:
    """Whether the only file of an array is there, and is not empty."""
    name = "/".join([array.path, "c", *["0"] * array.ndim])
    if isinstance(array.store, LocalStore):
        path = array.store.root / name
        return path.is_file() and path.stat().st_size > 0
    return remote.size(array.store, name) > 0


def _damaged(what: str, problem: str) -> str:
    remedy = "`echotruth check` of the repository names what is damaged, and what to delete before it is run again"
    return f"{what} {problem}: {remedy}"


def _create(
    group: zarr.Group, array: Array, values: NDArray[Any], alone: tuple[str, ...], attributes: dict[str, Any]
) -> None:
    """Create an array of one shard, with a chunk for each element along the dimensions `alone` if it has frames."""
    shape = tuple(max(size, 1) for size in values.shape)
    chunk = tuple(1 if dim in alone else size for dim, size in zip(array.dims, shape, strict=True))
    is_whole = "frame" not in array.dims or values.size < SMALL or chunk == shape
    created = group.create_array(
        array.name,
        shape=values.shape,
        dtype=str if array.dtype == "string" else array.dtype,
        chunks=shape if is_whole else chunk,
        shards=None if is_whole else shape,
        compressors=[_compressor(array), Crc32cCodec()],
        fill_value=_fill(array),
        dimension_names=array.dims,
        attributes={"units": array.units, "long_name": array.long_name} | attributes,
    )
    created[...] = values


def _fill(array: Array) -> float | int | str:
    fills: dict[str, float | int | str] = {"f": float("nan"), "s": ""}
    return fills.get(array.dtype[0], 0)


def _compressor(array: Array) -> BloscCodec | ZstdCodec:
    """Compressor that suits the content: bits of images side by side, bytes of numbers, text as it is."""
    if array.dtype == "uint8" and array.dims[-1:] == ("lateral",):
        return BloscCodec(cname="zstd", clevel=5, shuffle="bitshuffle")
    if array.dtype in ("string", "bool", "uint8"):
        return ZstdCodec(level=3)
    # In one block the bytes of a whole chunk are side by side, which takes 4 % less than blocks of Blosc's own choice.
    # Level 5 takes 7 % less than level 2, and five times as long.
    return BloscCodec(cname="zstd", clevel=2, shuffle="shuffle", blocksize=2**21)
