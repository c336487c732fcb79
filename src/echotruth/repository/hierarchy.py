"""Structure of the Zarr hierarchy: metadata of groups and arrays, coordinates, and the table of cases.

It is what belongs to no job. It is made in memory as a whole, so that the same configuration gives the same files
whatever was on disk before, and a file is written only if it differs.

Every array of the jobs is rectangular over (case, view, ...). A shard holds all that one job writes of one array, so
that parallel jobs never touch the same file, and a clip is one file. In it, a chunk is one component of one frame or,
of what was tracked, of one cycle, so that it can be read alone and its bytes compress together. Coordinates and columns
of the table are one chunk each. Chunks carry a crc32c checksum: a flipped bit is an error, not a wrong number.
"""

import json
from typing import Any

import numpy as np
import zarr
from numpy.typing import ArrayLike, NDArray
from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec
from zarr.core.buffer import Buffer
from zarr.storage import MemoryStore

from echotruth.repository import schema
from echotruth.repository.schema import Array

Files = dict[str, bytes]
"""Path below the store -> content."""

Document = dict[str, Any]
"""Content of a `zarr.json`."""

ROOT = "zarr.json"
"""Path of the metadata of the root, which hold those of all groups and arrays once more."""

COMPONENTS = ("vector", "strain_component", "plane", "wall_component", "label", "to")
"""Dimensions along which a chunk of an array of the jobs holds one element; so it does along `frame`, but for what
trackers found."""

# A shard that holds only fill values is a result too and must exist on disk.
zarr.config.set({"array.write_empty_chunks": True})


def structure(
    arrays: dict[str, tuple[Array, ...]],
    sizes: dict[str, int],
    labels: dict[str, ArrayLike],
    attributes: dict[str, Document],
) -> Files:
    """All files of the structure except the metadata of the root (see :func:`root`).

    Parameters
    ----------
    arrays : dict
        Arrays of each group, by its path.
    sizes : dict
        Length of every dimension without coordinates.
    labels : dict
        Values of every coordinate, and of every array that belongs to no job; `group:name` takes precedence over
        `name`.
    attributes : dict
        Attributes of each group, by its path, besides `labels`: those of its dimensions whose coordinates are strings,
        for readers that cannot read arrays of strings. Only the group `cases` has the labels of `case`.
    """
    values = {name: np.asarray(value) for name, value in labels.items()}
    memory: dict[str, Buffer] = {}
    top = zarr.create_group(MemoryStore(memory), zarr_format=3)
    for path, members in arrays.items():
        of_group = {name: value for name, value in values.items() if ":" not in name}
        of_group |= {name.removeprefix(f"{path}:"): values[name] for name in values if name.startswith(f"{path}:")}
        coordinates = schema.coordinates(members)
        group = top.require_group(path)
        group.attrs.update({"labels": _labels(path, coordinates, of_group)} | attributes.get(path, {}))
        lengths = sizes | {name: len(value) for name, value in of_group.items() if value.ndim == 1}
        for array in members:
            if f"{path}:{array.name}" in values:
                _create(group, array, of_group[array.name].shape)[...] = of_group[array.name]
            else:
                alone = COMPONENTS if path.count("/") == 2 else (*COMPONENTS, "frame")
                _create_sharded(group, array, tuple(lengths[dim] for dim in array.dims), coordinates, alone)
        for array in coordinates:
            _create(group, array, of_group[array.name].shape)[...] = of_group[array.name]
    return {path: buffer.to_bytes() for path, buffer in memory.items() if path != ROOT}


def root(files: Files, attributes: Document) -> bytes:
    """Metadata of the root: its attributes, and once more the metadata of all groups and arrays.

    Parameters
    ----------
    files : dict
        As :func:`structure` returns them.
    attributes : dict
    """
    documents = {
        path.rpartition("/")[0]: json.loads(files[path]) for path in sorted(files) if path.endswith("/" + ROOT)
    }
    inline = {"kind": "inline", "must_understand": False, "metadata": documents}
    return as_bytes({"attributes": attributes, "zarr_format": 3, "consolidated_metadata": inline, "node_type": "group"})


def as_bytes(document: Document) -> bytes:
    """Content of a `zarr.json`."""
    return json.dumps(document, indent=2).encode()


def column(array: Array, values: ArrayLike) -> Files:
    """Files of a column of the table of cases, by their path below the store."""
    memory: dict[str, Buffer] = {}
    group = zarr.create_group(MemoryStore(memory), path="cases", zarr_format=3)
    content = np.asarray(values)
    _create(group, array, content.shape)[...] = content
    return {path: buffer.to_bytes() for path, buffer in memory.items() if f"/{array.name}/" in path}


def sharded(files: Files) -> set[str]:
    """Paths of the metadata of the arrays that jobs write.

    Parameters
    ----------
    files : dict
        As :func:`structure` returns them: of other arrays they hold the values too.
    """
    whole = {path.partition("/c/")[0] for path in files if "/c/" in path}
    arrays = [
        path for path, content in files.items() if path.endswith(ROOT) and json.loads(content)["node_type"] == "array"
    ]
    return {path for path in arrays if path.rpartition("/")[0] not in whole}


def keeps_shards(old: Document, new: Document) -> bool:
    """Whether an array differs from what it was at most in the number of cases and views, compression and attributes.

    Parameters
    ----------
    old, new : dict
        Metadata of the array.
    """
    leading = sum(dim in ("case", "view") for dim in new["dimension_names"])
    same = all(old.get(key) == new[key] for key in ("node_type", "data_type", "dimension_names"))
    return same and old["shape"][leading:] == new["shape"][leading:]


def _labels(path: str, coordinates: tuple[Array, ...], values: dict[str, NDArray[Any]]) -> dict[str, list[str]]:
    strings = [
        array.name for array in coordinates if array.dtype == "string" and (path == "cases" or array.name != "case")
    ]
    return {name: [str(label) for label in values[name]] for name in strings}


def _create_sharded(
    group: zarr.Group,
    array: Array,
    shape: tuple[int, ...],
    coordinates: tuple[Array, ...],
    alone: tuple[str, ...],
) -> None:
    """Create an array of the jobs: one shard a job, in it chunks of one element along `alone` if it has frames."""
    dims = set(array.dims)
    auxiliary = [other.name for other in coordinates if other.dims != (other.name,) and set(other.dims) <= dims]
    attributes = {"coordinates": " ".join(auxiliary)} if auxiliary else {}
    shard = tuple(1 if dim in ("case", "view") else size for dim, size in zip(array.dims, shape, strict=True))
    chunk = tuple(1 if dim in alone else size for dim, size in zip(array.dims, shard, strict=True))
    if "frame" not in dims or chunk == shard or np.prod(shard) < 4096:
        _create(group, array, shape, shard, None, attributes)
    else:
        _create(group, array, shape, chunk, shard, attributes)


def _create(
    group: zarr.Group,
    array: Array,
    shape: tuple[int, ...],
    chunk: tuple[int, ...] | None = None,
    shard: tuple[int, ...] | None = None,
    attributes: Document | None = None,
) -> zarr.Array[Any]:
    """Create an array; without shapes of chunk and shard, in one chunk."""
    about: Document = {"units": array.units, "long_name": array.long_name} | (attributes or {})
    if array.quantum is not None:
        about["quantum"] = array.quantum
    return group.create_array(
        array.name,
        shape=shape,
        dtype=str if array.dtype == "string" else array.dtype,
        shards=shard,
        chunks=chunk or tuple(max(size, 1) for size in shape),
        compressors=[_compressor(array), Crc32cCodec()],
        fill_value=array.fill,
        dimension_names=array.dims,
        attributes=about,
    )


def _compressor(array: Array) -> BloscCodec | ZstdCodec:
    """Compressor that suits the content: bits of images side by side, bytes of numbers, text as it is."""
    if array.dtype == "uint8" and array.dims[-2:] == ("axial", "lateral"):
        return BloscCodec(cname="zstd", clevel=5, shuffle="bitshuffle")
    if array.dtype in ("string", "bool", "uint8"):
        return ZstdCodec(level=3)
    # In one block the bytes of a whole chunk are side by side, which takes 4 % less than blocks of Blosc's own choice.
    # Level 5 takes 7 % less than level 2, and five times as long.
    return BloscCodec(cname="zstd", clevel=2, shuffle="shuffle", blocksize=2**21)
