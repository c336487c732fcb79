"""The Zarr hierarchy on disk: laid out once, then written by jobs, one whole shard at a time."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any, cast

import numpy as np
import zarr
from numpy.typing import ArrayLike, NDArray

from echotruth.repository import durable, hierarchy, ledger, packing, schema
from echotruth.repository.hierarchy import ROOT, Document, Files
from echotruth.repository.rounding import rounded
from echotruth.repository.schema import Array

Values = dict[str, ArrayLike]


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

    @property
    def record(self) -> Path:
        """Path of the record of the structure: the checksums of all files that no job wrote, by their path."""
        return self.path.parent / "ledger/structure.json"

    def lay_out(
        self,
        arrays: dict[str, tuple[Array, ...]],
        sizes: dict[str, int],
        labels: Values,
        attributes: dict[str, dict[str, Any]] | None = None,
    ) -> None:
        """Create or extend all arrays; files that are as they should be are left untouched, damaged ones are mended.

        No job may be running. Shards stay where they are, unless the arrays of one case and view have another shape or
        type than before.

        Parameters
        ----------
        arrays : dict
            Arrays of each group, by its path.
        sizes : dict
            Length of every dimension without coordinates.
        labels : dict
            Values of every coordinate and column of the table of cases; `group:name` takes precedence over `name`.
        attributes : dict, optional
            Attributes of each group, by its path.
        """
        rows = len(np.asarray(labels["case"]))
        verdicts = {f"cases:{array.name}": self._verdicts(array.name, rows) for array in schema.CASES}
        wanted = hierarchy.structure(arrays, sizes, labels | verdicts, attributes or {})
        old = self._documents()
        self._remove_obsolete({path.rpartition("/")[0] for path in wanted})
        for path in hierarchy.sharded(wanted) & set(old):
            wanted[path] = self._adapt(path, old[path], wanted[path])
        wanted[ROOT] = hierarchy.root(wanted, old.get(ROOT, {}).get("attributes", {}))
        self._put(wanted)
        self._commit(_checksums(wanted))

    def write(self, group: str, values: Values, *row: int) -> None:
        """Write the shards of one job, rounded to the quantum of each array; they are on disk when this returns.

        Parameters
        ----------
        group : str
            As "bmode/512".
        values : dict
            Values for this case (and view), by the name of the array; of a pack, all its members or the pack itself.
        *row : int
            Row of the case, and index of the view.
        """
        arrays = self._open(group, "r+")
        by_name = {array.name: array for array in schema.arrays_of(group)}
        written: dict[Path, None] = {}
        for name, value in packing.pack(schema.packs_of(group), values).items():
            array, shard = arrays[name], self._shard(group, by_name[name], row)
            _remove_drafts(shard)
            array[row] = rounded(np.asarray(value, dtype=array.dtype), cast("float | None", array.attrs.get("quantum")))
            # The name of a file is in its folder, and that of the folder in the one above.
            written |= dict.fromkeys([shard, *shard.parents[: len(array.shape) + 1]])
        durable.sync(*written)

    def read(self, group: str, *row: int, names: tuple[str, ...] | None = None) -> dict[str, NDArray[Any]]:
        """Arrays of a group for one case (and view); a missing, empty or damaged shard is an error.

        Parameters
        ----------
        group : str
            As "bmode/512".
        *row : int
            Row of the case, and index of the view.
        names : tuple of str, optional
            Names of arrays and of members of packs. Default: all.
        """
        opened = self._open(group, "r")
        by_name, packs = {array.name: array for array in schema.arrays_of(group)}, schema.packs_of(group)
        holder = schema.holders(group)
        # Only a part of the RF may be stored.
        stored = [name for name in by_name if name in opened] if names is None else names
        arrays = [by_name[name] for name in dict.fromkeys(holder.get(name, name) for name in stored)]
        for array in arrays:
            self._require_written(group, array, row[: array.leading])
        values = {array.name: np.asarray(opened[array.name][row[: array.leading]]) for array in arrays}
        found = packing.unpack(packs, values, cast(Any, opened).attrs["labels"]) if packs else values
        return found if names is None else {name: found[name] for name in names}

    def labels(self, dimension: str) -> list[str]:
        """Labels of `case` or `view` in the order of their rows, from the table of cases or the phantoms.

        Empty if there is no such array, or it cannot be read.
        """
        return self._strings({"case": "cases/case", "view": "phantom/view"}[dimension])

    def files(self, group: str, *row: int) -> list[Path]:
        """Files that one job wrote in a group, sorted."""
        shards = (self._shard(group, array, row) for array in schema.arrays_of(group) if array.leading == len(row))
        return sorted(shard for shard in shards if shard.is_file())

    def write_column(self, name: str, values: ArrayLike) -> None:
        """Write the status or the reason of all cases, one value per row of the table of cases."""
        self._replace(hierarchy.column(next(array for array in schema.CASES if array.name == name), values))

    def describe(self, attributes: dict[str, Any]) -> None:
        """Write the attributes of the repository."""
        document = json.loads((self.path / ROOT).read_bytes())
        self._replace({ROOT: hierarchy.as_bytes(document | {"attributes": attributes})})

    def _require_written(self, group: str, array: Array, row: tuple[int, ...]) -> None:
        """Raise an error for a missing or empty shard, which Zarr reads as fill values."""
        shard = self._shard(group, array, row)
        if not shard.is_file() or not shard.stat().st_size:
            what = "is empty" if shard.is_file() else "has no data"
            remedy = f"run the stage {group.partition('/')[0]} first"
            raise NotWritten(f"{self.path}: {group}/{array.name} {what} in row {row}: {remedy}")

    def _shard(self, group: str, array: Array, row: tuple[int, ...]) -> Path:
        """File that holds the part of an array written by one job."""
        return self.path / group / array.shard(row)

    def _verdicts(self, name: str, rows: int) -> list[str]:
        """Column of the table of cases that publication writes, with "" for new rows."""
        known = self._strings(f"cases/{name}")[:rows]
        return known + [""] * (rows - len(known))

    def _strings(self, path: str) -> list[str]:
        try:
            opened = zarr.open_array(self.path, path=path, mode="r", zarr_format=3)
            return [str(value) for value in np.asarray(opened[...])]
        except Exception:  # absent, or damaged in one of the many ways for which Zarr and its codecs have errors
            return []

    def _documents(self) -> dict[str, Document]:
        """Metadata on disk of all groups and arrays by path, except those that differ from the record: damaged ones."""
        recorded, documents = self._recorded(), {}
        for file in (node / ROOT for node in _nodes(self.path)):
            if not file.is_file():
                continue
            path, content = file.relative_to(self.path).as_posix(), file.read_bytes()
            if recorded is None or recorded.get(path) == sha256(content).hexdigest():
                with suppress(ValueError):
                    documents[path] = json.loads(content)
        return documents

    def _remove_obsolete(self, wanted: set[str]) -> None:
        """Remove groups and arrays that are not wanted any more, and drafts that a killed process left."""
        for node in _nodes(self.path):
            path = node.relative_to(self.path).as_posix()
            if node != self.path and path not in wanted:
                rmtree(node, ignore_errors=True)
            for draft in node.glob(".*.partial"):
                draft.unlink()

    def _adapt(self, path: str, old: Document, content: bytes) -> bytes:
        """Metadata of an array of the jobs that keep its shards readable; shards that cannot be kept are removed."""
        new = json.loads(content)
        if hierarchy.keeps_shards(old, new):
            return hierarchy.as_bytes(new | {key: old[key] for key in ("chunk_grid", "codecs", "fill_value")})
        rmtree(self.path / Path(path).parent / "c", ignore_errors=True)
        return content

    def _replace(self, files: Files) -> None:
        """Write some files of the structure, and their checksums in its record."""
        self._put(files)
        self._commit((self._recorded() or {}) | _checksums(files))

    def _put(self, files: Files) -> None:
        """Write the files that differ from those on disk."""
        durable.update_all({self.path / name: content for name, content in files.items()})

    def _recorded(self) -> dict[str, str] | None:
        """Checksums in the record of the structure; None if there is no record, empty if it is damaged."""
        if not self.record.is_file():
            return None
        try:
            return dict(ledger.read(self.record)["sha256"])
        except (ValueError, KeyError, TypeError):
            return {}

    def _commit(self, sha256: dict[str, str]) -> None:
        if sha256 != self._recorded():
            ledger.commit(self.record, {"sha256": sha256})

    def _open(self, group: str, mode: Any) -> Mapping[str, zarr.Array[Any]]:
        return cast(Any, zarr.open_group(self.path, path=group, mode=mode, zarr_format=3, use_consolidated=False))


def _nodes(folder: Path) -> list[Path]:
    """Folders of groups and arrays, without those of shards."""
    if not folder.is_dir():
        return []
    below = sorted(child for child in folder.iterdir() if child.is_dir() and child.name != "c")
    return [folder, *(node for child in below for node in _nodes(child))]


def _checksums(files: Files) -> dict[str, str]:
    return {path: sha256(content).hexdigest() for path, content in files.items()}


def _remove_drafts(shard: Path) -> None:
    """Remove what a killed job left of this shard; no other job writes it."""
    with suppress(FileNotFoundError), os.scandir(shard.parent) as entries:
        for entry in entries:
            if entry.name.startswith(f"{shard.name}.") and entry.name.endswith(".partial"):
                os.unlink(entry.path)
