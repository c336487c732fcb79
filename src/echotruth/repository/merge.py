"""Merging of repositories: hearts of one become further rows of another, with their files and records.

What was there before keeps its place and its bytes. The structure is not of a job; whoever merges lays it out again.
"""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from echotruth.cases import Case, all_cases, as_table
from echotruth.config import Cases, Config
from echotruth.config.loading import ConfigError, validate
from echotruth.repository import durable, ledger
from echotruth.repository.checksums import ChecksumError, verify
from echotruth.repository.equivalence import first_difference
from echotruth.repository.inventory import Inventory, JobRecord, reason
from echotruth.section import dotted_values, value_of


class MergeError(ValueError):
    """Raised if repositories cannot be merged."""


def spanning(into: str, configs: dict[Path, Config]) -> Config:
    """Configuration of all cases of several repositories.

    A key that one of them does not sweep has the value there that it has without the sweep.

    Parameters
    ----------
    into : str
        Name of the new configuration.
    configs : dict
        Configuration of each repository, by its folder.

    Raises
    ------
    MergeError
        If they differ in more than their cases.
    """
    (folder, first), *others = configs.items()
    for other, config in others:
        if key := _difference(first, config):
            raise MergeError(f"{other}: {key} differs from that of {folder}: only name and cases may differ")
    are_grids = all(config.cases == Cases.model_validate(config.cases.grid) for config in configs.values())
    cases = _joint_grid(list(configs.values())) if are_grids else _joint_table(configs)
    try:
        return validate(first.model_dump(mode="json") | {"name": into, "cases": cases}, into)
    except ConfigError as error:
        raise MergeError(str(error)) from None


def _joint_grid(configs: list[Config]) -> dict[str, list[Any]]:
    """All values of each key that one of the configurations sweeps."""
    keys = list(dict.fromkeys(key for config in configs for key in config.cases.grid))
    cases: dict[str, list[Any]] = {}
    for key in keys:
        cases[key] = []
        for config in configs:
            values = config.cases.grid.get(key, [value_of(config, key)])
            cases[key] += [value for value in values if value not in cases[key]]
    return cases


def _joint_table(configs: dict[Path, Config]) -> dict[str, str]:
    """Table of all hearts, under the ids that they have."""
    cases: dict[str, Case] = {}
    for folder, config in configs.items():
        for id, case in all_cases(config).items():
            same = cases.setdefault(id, case).config
            if same != case.config.model_copy(update={"name": same.name}):
                remedy = "give it another id in one of them"
                raise MergeError(f"{folder}: {id} is another heart than that of the same id: {remedy}")
    return {"table": as_table(list(cases.values()))}


def compare(source: Path, target: Path) -> None:
    """Make sure that jobs which two repositories have both made have the same results in them.

    The bytes must be the same, or, if machines of two kinds made them, the numbers but for rounding.

    Parameters
    ----------
    source, target : Path
        Folders of the repositories.

    Raises
    ------
    MergeError
        If a job has other results, or is damaged.
    """
    giving, receiving = Inventory(source), Inventory(target)
    for record in _records(giving):
        if _in(record, giving, receiving).is_file():
            _compare(record, giving, receiving)


def verify_files(source: Path) -> None:
    """Compare all files of the jobs of a repository with their checksums.

    Raises
    ------
    MergeError
        If one is damaged.
    """
    giving = Inventory(source)
    for record in _records(giving):
        _verify(giving, record.path)


def take_over(source: Path, target: Path) -> tuple[list[JobRecord], int]:
    """Take over the jobs of a repository that another one lacks; what the other has stays as it is.

    Parameters
    ----------
    source : Path
        Folder of the repository that has them, and stays as it is; see :func:`verify_files`.
    target : Path
        Folder of the repository that receives them; laid out for all cases and views of both.

    Returns
    -------
    taken : list of JobRecord
        Records of the jobs that were taken over.
    known : int
        Number of those that the other one had already.
    """
    giving, receiving = Inventory(source), Inventory(target)
    records = _records(giving)
    new = [record for record in records if not _in(record, giving, receiving).is_file()]
    for record in new:
        _copy(record, giving, receiving)
    taken = [replace(record, path=_in(record, giving, receiving)) for record in new]
    return taken, len(records) - len(new)


def check_sources(sources: list[Path]) -> dict[Path, Config]:
    """Configurations of repositories by their folders.

    Raises
    ------
    CheckError
        If one is not a repository.
    MergeError
        If one was made when the store had other arrays.
    """
    configs = {}
    for source in sources:
        repository = Inventory(source)
        if not all((repository.store / path / "zarr.json").is_file() for path in repository.shard_paths):
            raise MergeError(f"{source}: was made by an earlier version: run it again before it is merged")
        configs[source] = repository.config
    return configs


def _difference(first: Config, second: Config) -> str:
    """Dotted key in which two configurations differ; empty if they do in none, besides name and cases."""
    bare = (config.model_copy(update={"name": "", "cases": Cases()}) for config in (first, second))
    one, other = (dict(dotted_values(config)) for config in bare)
    return next((key for key in one | other if (key in one, one.get(key)) != (key in other, other.get(key))), "")


def _records(repository: Inventory) -> list[JobRecord]:
    """Records of the cases and views of the configuration."""
    views = (None, *repository.config.views)
    return [record for record in repository.records() if record.case in repository.cases and record.view in views]


def _in(record: JobRecord, giving: Inventory, receiving: Inventory) -> Path:
    """Place of a record in the other ledger."""
    return receiving.folder / record.path.relative_to(giving.folder)


def _renamed(record: JobRecord, giving: Inventory, receiving: Inventory) -> Iterator[tuple[str, str, str]]:
    """Path of each shard of a job in both stores, and its SHA-256."""
    before, after = giving.row(record), receiving.row(record)
    if before is None or after is None:
        raise MergeError(f"{record.path}: its case or view has no row: check {giving.folder} and {receiving.folder}")
    for path, hash in _entries(record.path).get("sha256", {}).items():
        array, _, index = path.partition("/c/")
        rest = index.split("/")[len(before) :]
        yield path, "/".join((array, "c", *map(str, after), *rest)), hash


def _compare(record: JobRecord, giving: Inventory, receiving: Inventory) -> None:
    """Both must have the same bytes of a job that both have, or but for rounding if machines of two kinds made them."""
    mine, theirs = _entries(_in(record, giving, receiving)), _entries(record.path)
    have_same_verdict = all(mine.get(key) == theirs.get(key) for key in ("status", "reason"))
    hashes = {path: hash for _, path, hash in _renamed(record, giving, receiving)}
    if have_same_verdict and hashes == mine.get("sha256", {}):
        return
    what = "has other bytes than in"
    kinds = [str(found.get("instructions")) for found in (theirs, mine)]
    if kinds[0] != kinds[1] and have_same_verdict and mine.get("code") == theirs.get("code"):
        _verify(giving, record.path)
        _verify(receiving, _in(record, giving, receiving))
        different = first_difference(record, giving, receiving)
        if different is None:
            return
        made = f"was made with other instructions ({' and '.join(kinds)})"
        what = f"{made}, and {different} differs by more than rounding from"
    remedy = "make both by the same code, or delete the case in one of them"
    raise MergeError(f"{record.path}: {record.job} {what} {receiving.folder}: {remedy}")


def _verify(repository: Inventory, path: Path) -> None:
    """Compare the files of a job with the checksums in its record."""
    try:
        verify(repository.store, path, _entries(path))
    except ChecksumError as error:
        raise MergeError(f"{error}: heal {repository.folder} before it is merged") from None


def _entries(path: Path) -> dict[str, Any]:
    """What a record holds."""
    try:
        return ledger.read(path)
    except ValueError as error:
        raise MergeError(f"{path}: cannot be read ({reason(error)}): heal its repository before it is merged") from None


def _copy(record: JobRecord, giving: Inventory, receiving: Inventory) -> None:
    """Copy the shards of a job to their row, then its record, which keeps its time."""
    paths = list(_renamed(record, giving, receiving))
    for old, new, _ in paths:
        durable.link(giving.store / old, receiving.store / new)
    target, entries = _in(record, giving, receiving), _entries(record.path)
    if "sha256" in entries:
        entries["sha256"] = {new: hash for _, new, hash in paths}
    ledger.commit(target, entries)
    time = record.path.stat().st_mtime_ns
    os.utime(target, ns=(time, time))
