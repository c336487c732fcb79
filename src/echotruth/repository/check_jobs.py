"""Check of a job: its record, its files, and their values."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
import zarr

from echotruth.repository import ledger, packing, schema, values
from echotruth.repository.checksums import damage
from echotruth.repository.inventory import Fault, Inventory, JobRecord, reason
from echotruth.repository.ledger import record_path
from echotruth.repository.schema import packs_of
from echotruth.repository.verdict import verdict

STATUSES = ("complete", "failed", "skipped")
"""What a record can say; the jobs of the last two have no files."""

BLOCK_BYTES = 64_000_000
"""Most bytes of values that one thread reads at a time."""


@dataclass
class JobFaults:
    """What was found of a job: its faults, its number of files, and their arrays; None if its record is unreadable."""

    faults: list[Fault]
    files: int = 0
    arrays: frozenset[str] | None = None


def check_job(repository: Inventory, job: JobRecord, quick: bool) -> JobFaults:
    """Record of a job, its files, and their values unless it is to be quick."""
    name = repository.name(job.path)
    remedy = f"echotruth run makes it again ({job.job})"
    record, problem = _read_record(job)
    if record is None:
        return JobFaults([Fault(name, problem, remedy, (job.path,))])
    row = repository.row(job)
    if row is None:
        return JobFaults(
            [Fault(name, "is of a case or view that registry.txt or views.txt does not have", remedy, (job.path,))]
        )
    if repository.has_other_settings(job, record.get("settings")):
        return JobFaults([Fault(name, "is of other settings than those of config.yaml", remedy, (job.path,))])
    expected = repository.shards(job) if record["status"] == "complete" else set()
    listed = {path: hash for path, hash in record.get("sha256", {}).items() if _is_current(repository, path)}
    found = JobFaults([], len(listed), frozenset(path.partition("/c/")[0] for path in listed if path in expected))
    if set(listed) != expected and job.case in repository.cases:
        odd = sorted(set(listed) ^ expected)[0]
        wrong = "names a file that is not of its job" if odd in listed else "does not name a file of its job"
        found.faults.append(Fault(name, f"{wrong}, {odd}", remedy, (job.path,)))
    for path, hash in listed.items():
        if problem := damage(repository.store / path, hash):
            file = repository.store / path
            found.faults.append(Fault(repository.name(file), problem, remedy, (job.path,), (file,)))
    if not quick and not found.faults and job.case in repository.cases:
        found.faults = list(_check_values(repository, job, row, listed))
    return found


COMPRESSED = ("kinematics/volume_ratio_min", "physiology/volume_ratio_min")
"""Arrays that tell that elements collapse, for which a heart is found implausible."""


def _is_complete(repository: Inventory, case: str) -> bool:
    """Whether a heart is within its bounds, as far as it is known."""
    job = JobRecord(record_path(repository.folder, "mechanics", case), "mechanics", case)
    record, _ = _read_record(job)
    return record is None or verdict(record, repository.cases[case].config.physiology).status == "complete"


def _fault_of_value(repository: Inventory, job: JobRecord, group: str, name: str, problem: str) -> Fault:
    """A value of an array, or of a member of a pack, that no heart can have."""
    packs = schema.holders(group)
    text = f"{name} {problem}" if name in packs else problem
    path = f"{repository.name(repository.store)}/{group}/{packs.get(name, name)}"
    record = repository.name(job.path)
    remedy = f"look at the configuration, or delete {record} and run again if it was made by other code"
    return Fault(path, f"{text} ({job.job})", remedy)


def _read_record(job: JobRecord) -> tuple[dict[str, Any] | None, str]:
    """A record, or None and what is wrong with it."""
    try:
        record = ledger.read(job.path)
    except (OSError, ValueError) as error:
        return None, f"cannot be read ({reason(error)})"
    identity = {"stage": job.stage, "case": job.case, "view": job.view, "size": job.size}
    if any(record.get(key, "") != value for key, value in identity.items()):
        return None, f"is not the record of {job.job}"
    if record.get("status") not in STATUSES:
        return None, f"has the status {record.get('status')!r}, not one of {', '.join(STATUSES)}"
    hashes = record.get("sha256", {})
    has_files = record["status"] == "complete"
    if (has_files and "sha256" not in record) or not are_checksums(hashes):
        return None, "has no checksums of the files of its job"
    return record, ""


def are_checksums(hashes: object) -> bool:
    return isinstance(hashes, dict) and all(isinstance(hash, str) and len(hash) == 64 for hash in hashes.values())


def _is_current(repository: Inventory, path: str) -> bool:
    """Whether the hierarchy still has the array of a shard, or the path is of none at all.

    A case that left the configuration keeps its record, which may name groups that left it later.
    """
    group = path.partition("/c/")[0].rpartition("/")[0]
    return group in repository.groups or schema.kind(group) not in schema.KINDS


def _check_values(repository: Inventory, job: JobRecord, row: tuple[int, ...], files: Iterable[str]) -> Iterator[Fault]:
    """Faults of the values of a job."""
    arrays = {path.partition("/c/")[0] for path in files}
    for group in sorted({path.rpartition("/")[0] for path in arrays}):
        names = [name for inside, _, name in (path.rpartition("/") for path in arrays) if inside == group]
        opened = {name: repository.opened.get(f"{group}/{name}") for name in names}
        if any(array is None for array in opened.values()):
            continue  # its metadata are damaged
        try:
            found = _problems(
                repository, job, group, {name: array for name, array in opened.items() if array is not None}, row
            )
        except Exception as error:  # by the metadata of other arrays, the reading fails in many ways
            yield _fault_of_metadata(repository, group, names, error)
            continue
        for name, problem in found.items():
            if f"{group}/{name}" not in COMPRESSED or _is_complete(repository, job.case):
                yield _fault_of_value(repository, job, group, name, problem)


def _problems(
    repository: Inventory, job: JobRecord, group: str, opened: dict[str, zarr.Array[Any]], row: tuple[int, ...]
) -> dict[str, str]:
    """The first problem of each array of a group: that of the first part of its frames."""
    found: dict[str, str] = {}
    labels, config = repository.pack_labels(group), repository.cases[job.case].config
    for first, part in _blocks(group, opened, row):
        named = packing.unpack(packs_of(group), part, labels)
        for name, problem in values.faults(group, named, first, config):
            found.setdefault(name, problem)
    return found


def _fault_of_metadata(repository: Inventory, group: str, names: list[str], error: Exception) -> Fault:
    """Arrays of a group whose metadata do not fit their files; without these, a run writes them anew."""
    files = tuple(sorted(repository.store / group / name / "zarr.json" for name in names))
    problem = f"has arrays that cannot be read by their zarr.json ({reason(error)})"
    path = f"{repository.name(repository.store)}/{group}"
    return Fault(path, problem, "echotruth run writes them again", (repository.publication_record,), files)


def _blocks(
    group: str, opened: dict[str, zarr.Array[Any]], row: tuple[int, ...]
) -> Iterator[tuple[int, values.Arrays]]:
    """First frame and arrays of parts of the frames, which fit into memory."""
    by_name = {array.name: array for array in schema.arrays_of(group)}
    with_frames = [name for name in opened if "frame" in by_name[name].dims]
    whole = {name: np.asarray(opened[name][row[: by_name[name].leading]]) for name in opened if name not in with_frames}
    if not with_frames:
        yield 0, whole
        return
    axes = {name: by_name[name].dims.index("frame") for name in with_frames}
    frames = opened[with_frames[0]].shape[axes[with_frames[0]]]
    of_a_job = (opened[name].nbytes / prod(opened[name].shape[: by_name[name].leading]) for name in with_frames)
    step = max(1, int(BLOCK_BYTES / sum(of_a_job) * frames))
    for first in range(0, frames, step):
        part = {}
        for name in with_frames:
            leading = by_name[name].leading
            index: tuple[int | slice, ...] = (*row[:leading], *[slice(None)] * (axes[name] - leading))
            part[name] = np.asarray(opened[name][(*index, slice(first, first + step))])
        yield first, whole | part


def check_loop(repository: Inventory, job: JobRecord) -> list[Fault]:
    """Loop and det F of a heart whose record says that it is complete."""
    record, _ = _read_record(job)
    row = repository.row(job)
    if record is None or row is None or job.case not in repository.cases or not _is_complete(repository, job.case):
        return []
    curves = {f"mechanics/{name}": name for name in ("pressure", "volume", "pressure_target", "volume_target")}
    curves |= {"kinematics/volume_ratio_min": "volume_ratio_min"}
    if not {*curves, "physiology/scalars"} <= set(repository.opened):
        return []
    try:
        arrays = {name: np.asarray(repository.opened[path][row[0]]) for path, name in curves.items()}
        scalars = {"scalars": np.asarray(repository.opened["physiology/scalars"][row[0]])}
        found = packing.unpack(packs_of("physiology"), scalars, repository.pack_labels("physiology"))
        problems = list(values.loop_faults(arrays, found, repository.cases[job.case].config))
    except Exception:  # by the metadata of other arrays, which the check of the values has told
        return []
    return [_fault_of_value(repository, job, "physiology", name, problem) for name, problem in problems]
