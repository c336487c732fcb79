"""Check of what belongs to no job: the structure of the hierarchy, registries, and files of no record."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from echotruth.repository import ledger
from echotruth.repository.array import Array
from echotruth.repository.check_jobs import are_checksums
from echotruth.repository.checksums import damage
from echotruth.repository.inventory import Fault, Inventory, files_below, reason
from echotruth.repository.store import Store

_REWRITTEN = "echotruth run writes it again"
"""Remedy of a file that no job wrote."""


def check_structure(repository: Inventory, pool: ThreadPoolExecutor) -> tuple[set[str] | None, list[Fault]]:
    """Files that no job wrote, and their faults; None if no record of them can be read."""
    record, remedy, publish = repository.structure_record, _REWRITTEN, (repository.publication_record,)
    try:
        hashes = ledger.read(record)["sha256"]
        if not are_checksums(hashes):
            raise ValueError("has no checksums")
    except (OSError, ValueError, KeyError, TypeError) as error:
        problem = "is missing" if isinstance(error, FileNotFoundError) else f"cannot be read ({reason(error)})"
        # Nothing else vouches for the files of the structure, and a run makes all of them.
        unproved = (record, *_structure_files(repository))
        return None, [Fault(repository.name(record), problem, remedy, publish, unproved)]
    files = [repository.store / path for path in hashes]
    problems = pool.map(damage, files, hashes.values())
    return set(hashes), [
        Fault(repository.name(file), problem, remedy, publish, (file,))
        for file, problem in zip(files, problems, strict=True)
        if problem
    ]


def _structure_files(repository: Inventory) -> Iterator[Path]:
    """Files that are not shards of jobs."""
    for path in files_below(repository.store):
        if not ("/c/" in path and path.partition("/c/")[0] in repository.shard_paths):
            yield repository.store / path


def check_registries(repository: Inventory) -> Iterator[Fault]:
    """Rows of cases and views against their labels in the store, which then count."""
    store = Store(repository.store)
    for name, dimension in (("registry.txt", "case"), ("views.txt", "view")):
        labels, path = store.labels(dimension), repository.folder / name
        known = repository.rows if dimension == "case" else repository.views
        # A killed start may have registered more than it laid out.
        if labels and list(known)[: len(labels)] != labels:
            known.clear()
            known.update({label: row for row, label in enumerate(labels)})
            problem = f"does not have the {dimension}s of the store in their order" if path.is_file() else "is missing"
            yield Fault(name, problem, _REWRITTEN, (repository.publication_record,), (path,))


def check_configuration(repository: Inventory) -> list[Fault]:
    """The configuration, by which all the rest is checked."""
    return [fault for fault in _beside(repository, repository.records_beside[0]) if fault.path == "config.yaml"]


def check_others(repository: Inventory) -> Iterator[Fault]:
    """Record of the publication, and the files beside the store: table, configurations of the hearts, and report."""
    path = repository.publication_record
    try:
        if path.exists() and not isinstance(ledger.read(path).get("files"), int):
            raise ValueError("it is not that of a publication")
    except ValueError as error:
        yield Fault(repository.name(path), f"cannot be read ({reason(error)})", _REWRITTEN, (path,))
    for record in repository.records_beside:
        yield from _beside(repository, record)


def _beside(repository: Inventory, record: Path) -> Iterator[Fault]:
    """Files beside the store against the checksums in their record."""
    name, page = repository.name(record), repository.folder / "report.html"
    of_report = record.name == "report.json"
    # Without its page a run draws the report again, and then writes its record.
    page_of_it = (page,) if of_report else ()
    if not (record.exists() or record.is_symlink()):
        # Earlier versions have not written it, and there need be no report yet.
        if repository.is_of_this_version and (page.exists() or not of_report):
            yield Fault(name, "is missing", _REWRITTEN, (), page_of_it)
        return
    try:
        files = ledger.read(record)["files"]
        if not are_checksums(files):
            raise ValueError("has no checksums")
    except (OSError, ValueError, KeyError, TypeError) as error:
        yield Fault(name, f"cannot be read ({reason(error)})", _REWRITTEN, (), (record, *page_of_it))
        return
    for name, checksum in files.items():
        if problem := damage(repository.folder / name, checksum):
            # Without its configuration the folder is no repository, and a run writes it in any case.
            dropped = () if name == "config.yaml" else (repository.folder / name,)
            yield Fault(name, problem, _REWRITTEN, (), dropped)


def check_metadata(repository: Inventory) -> Iterator[Fault]:
    """Metadata of the arrays of the jobs against the schema, and times against their order."""
    remedy = "run the configuration with this version of echotruth"
    for path, array in repository.shard_paths.items():
        name = f"{repository.name(repository.store)}/{path}"
        opened = repository.opened.get(path)
        if opened is None:
            file = repository.store / path / "zarr.json"
            yield Fault(name, "is not an array that can be opened", remedy, (repository.publication_record,), (file,))
        elif problem := _metadata_problem(opened, array, repository):
            yield Fault(name, problem, remedy, (), (repository.store / path / "zarr.json",))
    yield from _check_times(repository)


def _metadata_problem(opened: zarr.Array[Any], array: Array, repository: Inventory) -> str:
    """How the metadata of an array differ from the schema; empty if they do not."""
    pairs = {
        "dimensions": (tuple(getattr(opened.metadata, "dimension_names", None) or ()), array.dims),
        "type": (str(opened.dtype), array.dtype),
        "units": (opened.attrs.get("units"), array.units),
        "long_name": (opened.attrs.get("long_name"), array.long_name),
        "quantum": (opened.attrs.get("quantum"), array.quantum),
        "rows": (opened.shape[0] >= len(repository.cases), True),
    }
    return next((f"has {key} {found!r}, not {right!r}" for key, (found, right) in pairs.items() if found != right), "")


def _check_times(repository: Inventory) -> Iterator[Fault]:
    try:
        times = np.asarray(zarr.open_array(repository.store, path="mechanics/time", mode="r", zarr_format=3)[...])
    except Exception:  # a repository that was not laid out, or in an earlier layout
        return
    rows = [repository.rows[case] for case in repository.cases if repository.rows.get(case, len(times)) < len(times)]
    wrong = [row for row in rows if times[row, 0] != 0 or not (np.diff(times[row]) > 0).all()]
    if wrong:
        name = f"{repository.name(repository.store)}/mechanics/time"
        yield Fault(name, f"does not increase from 0 in row {wrong[0]}", "look at the loop of the configuration")


Listed = dict[tuple[str, int | None, tuple[int, ...]], frozenset[str]]
"""Stage, image size and row of a job -> arrays of which its record lists the shard."""


def unrecorded_files(repository: Inventory, listed: Listed, structure: set[str] | None) -> Iterator[Fault]:
    """Files that belong to no record; those of jobs that have none yet are left out."""
    for path in files_below(repository.store):
        file = repository.store / path
        array, _, index = path.partition("/c/")
        if path.endswith(".partial"):
            problem = "is unfinished, of a process that was killed"
        elif index and array in repository.shard_paths:
            problem = "" if _has_owner(repository, array, index, listed) else "belongs to no job"
        else:
            problem = "" if structure is None or path in structure else "belongs to no array of the repository"
        if problem:
            yield Fault(repository.name(file), problem, "--heal deletes it", files=(file,))


def _has_owner(repository: Inventory, path: str, index: str, listed: Listed) -> bool:
    """Whether a shard is that of a job, or of one that has no record yet."""
    array = repository.shard_paths[path]
    if not all(part.isdecimal() for part in index.split("/")):
        return False
    place = [int(part) for part in index.split("/")]
    row, rest = tuple(place[: array.leading]), place[array.leading :]
    if len(place) != len(array.dims) or any(rest):
        return False
    if row[0] >= len(repository.rows) or (len(row) == 2 and row[1] >= len(repository.views)):
        return False
    arrays = listed.get((*repository.writers[path.rpartition("/")[0]], row))
    return arrays is None or path in arrays
