"""What a check needs to know of a repository: its configuration, records, rows and arrays."""

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from echotruth.cases import all_cases
from echotruth.config import Config
from echotruth.config.loading import ConfigError, load
from echotruth.loop.recording import LoopError
from echotruth.repository import layout, ledger, schema, settings
from echotruth.repository.array import Array
from echotruth.repository.ledger import NOT_A_REPOSITORY, STAGES, record_paths


class CheckError(ValueError):
    """Raised if a folder is not a repository that can be checked."""


@dataclass(frozen=True)
class Fault:
    """Something that is not as it should be."""

    path: str
    """Of the file, below the folder of the repository."""
    problem: str
    """What is wrong with it."""
    remedy: str
    """What heals it."""
    records: tuple[Path, ...] = ()
    """Records to drop, so that their jobs run again."""
    files: tuple[Path, ...] = ()
    """Files to delete."""

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}: {self.remedy}"


@dataclass(frozen=True)
class JobRecord:
    """A record of the ledger.

    Attributes
    ----------
    path : Path
    stage, case : str
    view : str or None
    size : int or None
        Image size, px.
    """

    path: Path
    stage: str
    case: str
    view: str | None = None
    size: int | None = None

    @property
    def job(self) -> str:
        """The job in words."""
        size = f"{self.size} px" if self.size else None
        return f"{self.stage} of " + ", ".join(filter(None, [self.case, self.view, size]))


class Inventory:
    """Folder of a repository, with what a check needs to know of it.

    Parameters
    ----------
    folder : Path
        `out/NAME`.

    Raises
    ------
    CheckError
        If it has no configuration that can be read.
    """

    def __init__(self, folder: Path) -> None:
        if not (folder / "config.yaml").is_file():
            raise CheckError(f"{folder}: {NOT_A_REPOSITORY}")
        try:
            self.config: Config = load(folder / "config.yaml")
            self.cases = all_cases(self.config)
        except ConfigError as error:
            raise CheckError(f"{error}; or run the configuration again, which writes the file") from None
        self.folder = folder
        self.store = folder / f"{self.config.name}.zarr"
        self.structure_record = folder / "ledger/structure.json"
        self.publication_record = folder / "ledger/repository.json"
        self.records_beside = [folder / "ledger/configuration.json", folder / "ledger/report.json"]
        self.groups = schema.groups(self.config)
        self.rows, self.views = ledger.rows(folder / "registry.txt"), ledger.rows(folder / "views.txt")

    @cached_property
    def writers(self) -> dict[str, tuple[str, int | None]]:
        """Group -> stage whose jobs write it, and their image size, px, if they have one."""
        sizes = self.config.bmode.sizes
        jobs = [(stage, size) for stage, names in STAGES.items() for size in (sizes if "size" in names else [None])]
        return {group: job for job in jobs for group in schema.written_by(job[0], self.config, job[1])}

    @cached_property
    def shard_paths(self) -> dict[str, Array]:
        """Path of every array of the jobs below the store -> its description."""
        return {
            f"{group}/{array.name}": array for group in self.writers for array in self.groups[group] if array.leading
        }

    @cached_property
    def opened(self) -> dict[str, zarr.Array[Any]]:
        """Arrays of the jobs that can be opened, by path."""
        arrays = {}
        # A pipe or a device could be read for ever.
        for path in (path for path in self.shard_paths if (self.store / path / "zarr.json").is_file()):
            with suppress(Exception):  # damaged metadata, which is a fault of its own, fail in many ways
                array = zarr.open_array(self.store, path=path, mode="r", zarr_format=3)
                if isinstance(array.metadata.attributes, dict):
                    arrays[path] = array
        return arrays

    @cached_property
    def is_of_this_version(self) -> bool:
        """Whether this version would write the same configuration: others have other keys, and other hashes of them."""
        return (self.folder / "config.yaml").read_text(encoding="utf-8") == layout.as_yaml(self.config)

    def has_other_settings(self, record: JobRecord, recorded: str | None) -> bool:
        """Whether a job was run with other settings than the configuration has, given their hash in its record."""
        if recorded is None or record.case not in self.cases or not self.is_of_this_version:
            return False
        if record.view is not None and record.view not in self.config.views:
            return False
        try:
            return recorded != settings.of_job(self.cases[record.case].config, record.stage, record.view)
        except LoopError:  # its file need not be here any more
            return False

    def distrust(self, files: Iterable[Path]) -> None:
        """Leave out the arrays whose metadata are damaged, given the files that are."""
        for path in self.shard_paths:
            if self.store / path / "zarr.json" in files:
                self.opened.pop(path, None)

    def pack_labels(self, group: str) -> dict[str, list[str]]:
        """Labels along the dimension of each pack of a group."""
        coordinates = layout.labels(self.config, [], [])
        dimensions = [pack.dimension for pack in schema.packs_of(group)]
        return {name: np.asarray(coordinates[f"{group}:{name}"]).tolist() for name in dimensions}

    def records(self) -> list[JobRecord]:
        """Records that exist, sorted."""
        found = []
        for stage, names in STAGES.items():
            root = self.folder / "ledger" / stage
            for path in root.glob("/".join(["*"] * len(names)) + ".json"):
                case, view, size = (*path.relative_to(root).with_suffix("").parts, None, None)[:3]
                if not path.name.startswith(".") and str(size or 0).isdecimal():
                    found.append(JobRecord(path, stage, str(case), view, None if size is None else int(size)))
        return sorted(found, key=lambda record: record.path)

    def wanted(self) -> list[Path]:
        """Paths of the records of all jobs of the configuration."""
        return [path for case in self.cases for path in record_paths(self.folder, case, self.config)]

    def row(self, record: JobRecord) -> tuple[int, ...] | None:
        """Row of the case, and index of the view if there is one; None if the registry does not have them."""
        row, index = self.rows.get(record.case), self.views.get(record.view or "")
        if row is None or (record.view is not None and index is None):
            return None
        return (row,) if record.view is None else (row, index or 0)

    def shards(self, record: JobRecord) -> set[str]:
        """Paths below the store of the shards that a job writes; none if its row is not known."""
        row, groups = self.row(record), schema.written_by(record.stage, self.config, record.size)
        if row is None or (record.size is not None and record.size not in self.config.bmode.sizes):
            return set()
        arrays = ((group, array) for group in groups for array in self.groups[group])
        return {f"{group}/{array.shard(row)}" for group, array in arrays if array.leading == len(row)}

    def name(self, path: Path) -> str:
        """Path below the folder."""
        return path.relative_to(self.folder).as_posix()


TIMESTAMP = ".snakemake_timestamp"
"""File that Snakemake leaves in a folder that is a target."""


def files_below(folder: Path) -> Iterator[str]:
    """Paths of all files below a folder, of which only one folder at a time is kept in memory."""
    length = len(str(folder)) + 1
    for parent, _, names in os.walk(folder):
        below = parent[length:].replace(os.sep, "/")
        yield from (f"{below}/{name}" if below else name for name in names if name != TIMESTAMP)


def reason(error: BaseException) -> str:
    """What an error says, in one line and without a place in the text."""
    return str(getattr(error, "msg", error)).partition("\n")[0]
