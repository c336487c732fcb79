"""The ledger: one record for every finished job, which commits its results, and the rows of cases and views."""

import json
from collections.abc import Sequence
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

from echotruth.config import Config
from echotruth.repository import durable

STAGES: dict[str, tuple[str, ...]] = {
    "mechanics": ("case",),
    "phantom": ("case", "view"),
    "rf": ("case", "view"),
    "truth": ("case", "view", "size"),
    "bmode": ("case", "view", "size"),
    "tracking": ("case", "view", "size"),
    "inference": ("case",),
}
"""Stages in the order of their jobs -> what their jobs are for: a heart, a view of it, or an image size of a view."""

NOT_A_REPOSITORY = "is not a repository: give the folder that a run made, such as out/demo"
"""What an error says of a folder, whose path stands before it."""


def stages(config: Config) -> dict[str, tuple[str, ...]]:
    """The :data:`STAGES` that a configuration has: without a tracker to infer from, there is no inference."""
    return {name: of for name, of in STAGES.items() if name != "inference" or config.inference.tracker}


def imaged_statuses(exclude_implausible: bool) -> tuple[str, ...]:
    """Statuses of the hearts that are imaged and tracked, by the key `physiology.exclude_implausible`."""
    return ("complete",) if exclude_implausible else ("complete", "implausible")


def record_path(folder: Path, stage: str, case: str, view: str | None = None, size: int | None = None) -> Path:
    """Path of the record of a job: ledger/STAGE/CASE.json, ledger/STAGE/CASE/VIEW.json or .../VIEW/SIZE.json."""
    place = "/".join(str(part) for part in (case, view, size) if part is not None)
    return folder / "ledger" / stage / f"{place}.json"


def record_paths(folder: Path, case: str, config: Config) -> list[Path]:
    """Paths of the records of all jobs of a heart, in the order of the stages.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    case : str
    config : Config
        Its views and image sizes are those of all cases.
    """
    values: dict[str, Sequence[Any]] = {"case": [case], "view": [*config.views], "size": config.bmode.sizes}
    places = {stage: product(*(values[name] for name in names)) for stage, names in stages(config).items()}
    return [record_path(folder, stage, *place) for stage, found in places.items() for place in found]


def commit(path: Path, record: dict[str, Any]) -> None:
    """Write a record atomically: its content is on disk before the file gets its name; `seal` is a hash of it."""
    durable.write(path, f"{json.dumps(record | {'seal': _seal(record)}, indent=1, sort_keys=True)}\n".encode())


def read(path: Path) -> dict[str, Any]:
    """Read a record, without its seal; one made before records had seals is taken as it is.

    Raises
    ------
    JSONDecodeError, UnicodeDecodeError
        If it is not what was written.
    """
    # A pipe or a device could be read for ever.
    if path.exists() and not path.is_file():
        raise json.JSONDecodeError("it is not a file", "", 0)
    return parse(path.read_text(encoding="utf-8"))


def parse(text: str) -> dict[str, Any]:
    """A record from the text of its file, as :func:`read` returns it."""
    try:
        record = json.loads(text)
    except RecursionError:
        raise json.JSONDecodeError("it is nested too deeply", text, 0) from None
    if not isinstance(record, dict):
        raise json.JSONDecodeError("it is not a record", text, 0)
    seal = record.pop("seal", None)
    is_other = seal is not None and seal != _seal(record)
    if is_other or (seal is None and _has_seal_of_other_name(record)):
        raise json.JSONDecodeError("the record is not what was written", text, 0)
    if flaw := _flaw(record):
        raise json.JSONDecodeError(flaw, text, 0)
    return record


def _flaw(record: dict[str, Any]) -> str:
    """What makes a record one that this program has not written, whatever its seal is; empty if nothing does."""
    listed = (record.get(key) for key in ("sha256", "files"))
    names = (name for files in listed if isinstance(files, dict) for name in files)
    # Whoever heals, merges or releases the repository would delete the file, or take it along.
    if any(name.startswith("/") or ".." in name.split("/") for name in names):
        return "it names a file outside of the repository"
    measures = record.get("bounded", {})
    if not (isinstance(measures, dict) and all(isinstance(value, int | float) for value in measures.values())):
        return "its entry bounded does not hold numbers"
    return ""


def _has_seal_of_other_name(record: dict[str, Any]) -> bool:
    """Whether the name of the seal was damaged, so that the record seems to have none."""
    digits = [key for key, value in record.items() if isinstance(value, str) and len(value) == 16]
    return any(record[key] == _seal({name: record[name] for name in record if name != key}) for key in digits)


def _seal(record: dict[str, Any]) -> str:
    return sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()[:16]


def repository_folder(repository: str | Path) -> Path:
    """Folder of a repository, given it or its store.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    """
    if "://" in str(repository):
        remedy = "download it, and give the folder; echotruth.Repository reads an address too"
        raise FileNotFoundError(f"{repository}: is an address and not a folder: {remedy}")
    folder = Path(repository)
    folder = folder.parent if folder.suffix == ".zarr" else folder
    if not (folder / "registry.txt").is_file():
        raise FileNotFoundError(f"{repository}: {NOT_A_REPOSITORY}")
    configuration = folder / "config.yaml"
    # An empty file would be read as a configuration of defaults.
    if configuration.is_file() and configuration.stat().st_size == 0:
        raise FileNotFoundError(f"{configuration}: is empty: run the repository again, which writes it")
    return folder


def rows(registry: Path) -> dict[str, int]:
    """Row of every case, or index of every view, ever registered: the number of the line with its name.

    Parameters
    ----------
    registry : Path
        `registry.txt` (cases) or `views.txt` in the folder of the repository.
    """
    return {id: row for row, id in enumerate(_lines(registry))}


def register(registry: Path, ids: list[str], stored: Sequence[str] = ()) -> dict[str, int]:
    """Append new cases or views to the registry; the row of one never changes.

    Processes that register at the same time wait for each other, and none loses a row.

    Parameters
    ----------
    registry : Path
        `registry.txt` (cases) or `views.txt` in the folder of the repository.
    ids : list of str
        Cases or views of the configuration.
    stored : sequence of str
        Those in the store, in their order: a registry that is lost or damaged is made again from them.

    Returns
    -------
    dict
        Row of every case, or index of every view, ever registered.
    """
    with durable.lock(registry.with_name(f".{registry.name}.lock")):
        before = _lines(registry)
        damaged = before[: len(stored)] != list(stored)
        known = [*stored, *before[len(stored) :]] if damaged else before
        new = list(dict.fromkeys([*known, *ids]))
        if new != before or not registry.exists():
            durable.write(registry, "".join(f"{id}\n" for id in new).encode())
        return rows(registry)


def _lines(registry: Path) -> list[str]:
    return registry.read_text(encoding="utf-8", errors="replace").split() if registry.is_file() else []
