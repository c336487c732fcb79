"""The ledger: one record for every finished job, which commits its results, and the rows of the cases."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

GATES = ("mechanics", "physiology")
"""Stages that decide whether the later ones process a heart."""

VIEW_STAGES = ("phantom", "truth", "rf", "bmode", "tracking", "evaluation")
"""Stages with a record for every view of a case."""


def record_path(folder: Path, stage: str, case: str, view: str | None = None) -> Path:
    """Path of the record of a job: ledger/STAGE/CASE.json or ledger/STAGE/CASE/VIEW.json."""
    name = f"{case}.json" if view is None else f"{case}/{view}.json"
    return folder / "ledger" / stage / name


def commit(path: Path, record: dict[str, Any]) -> None:
    """Write a record atomically: its content is on disk before the file gets its name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    with draft.open("w", encoding="utf-8") as file:
        json.dump(record, file, indent=1, sort_keys=True)
        file.write("\n")
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)


def read(path: Path) -> dict[str, Any]:
    """Read a record."""
    return json.loads(path.read_text(encoding="utf-8"))


def rows(registry: Path) -> dict[str, int]:
    """Row of every case ever registered: the number of the line with its id."""
    known = registry.read_text(encoding="utf-8").split() if registry.exists() else []
    return {id: row for row, id in enumerate(known)}


def register(registry: Path, ids: list[str]) -> dict[str, int]:
    """Append new cases to the registry; the row of a case never changes.

    Parameters
    ----------
    registry : Path
    ids : list of str
        Cases of the configuration.

    Returns
    -------
    dict
        Row of every case ever registered.
    """
    known = list(rows(registry))
    known += [id for id in ids if id not in set(known)]
    draft = registry.with_name(f".{registry.name}")
    registry.parent.mkdir(parents=True, exist_ok=True)
    draft.write_text("".join(f"{id}\n" for id in known), encoding="utf-8")
    draft.replace(registry)
    return rows(registry)
