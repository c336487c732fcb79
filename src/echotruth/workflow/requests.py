"""Records that the workflow asks for: few are enough, because each job needs the record of the one before."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from echotruth.repository.ledger import GATES, VIEW_STAGES, record_path

ORDER = (*GATES, *VIEW_STAGES)
"""Stages in the order of their jobs."""


def requested_records(folder: Path, cases: Iterable[str], views: Iterable[str]) -> list[Path]:
    """Records of the last stage, and every record that is lost.

    Nothing needs a lost record any more: those that followed from it exist. So it is made again only if it is named.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    cases : iterable of str
        Case ids.
    views : iterable of str
        Names of the views.
    """
    views = list(views)
    existing = {stage: existing_records(folder / "ledger" / stage) for stage in ORDER}
    return [path for case in cases for path in _requested(folder, case, views, existing)]


def _requested(folder: Path, case: str, views: list[str], existing: dict[str, set[str]]) -> Iterator[Path]:
    for view in views:
        yield record_path(folder, VIEW_STAGES[-1], case, view)
        yield from (record_path(folder, stage, case, view) for stage in _lost(VIEW_STAGES, f"{case}/{view}", existing))
    gates = [stage for stage in GATES if case not in existing[stage]]
    if gates:
        followed = any(f"{case}/{view}" in existing[stage] for stage in VIEW_STAGES for view in views)
        lost = gates if followed else _lost(GATES, case, existing)
        yield from (record_path(folder, stage, case) for stage in lost)


def _lost(stages: tuple[str, ...], name: str, existing: dict[str, set[str]]) -> list[str]:
    """Stages without a record of which a later one has a record."""
    there = [name in existing[stage] for stage in stages]
    return [stage for place, stage in enumerate(stages) if not there[place] and any(there[place:])]


def existing_records(folder: Path) -> set[str]:
    """Records of a stage, given its folder in the ledger: CASE or CASE/VIEW."""
    found: set[str] = set()
    for entry in _entries(folder):
        if entry.name.endswith(".json"):
            found.add(entry.name.removesuffix(".json"))
        else:
            names = (view.name for view in _entries(Path(entry.path)))
            found |= {f"{entry.name}/{name.removesuffix('.json')}" for name in names if name.endswith(".json")}
    return found


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    if not folder.is_dir():
        return []
    with os.scandir(folder) as entries:
        return [entry for entry in entries if not entry.name.startswith(".")]
