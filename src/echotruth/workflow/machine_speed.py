"""How fast this machine is: CPU time that stages took in repositories that were made here, over what was expected."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import ConfigError, load
from echotruth.repository.ledger import GATES
from echotruth.workflow import expected_cost

MAX_REPOSITORIES = 5
"""Largest number of repositories that are read, those that were changed last."""
MAX_RECORDS = 20
"""Largest number of records that are read of each of their stages."""
MAX_CASES = 500
"""Largest sweep whose hearts are told apart; those of a larger one count as the heart without its sweep."""
MIN_SECONDS = 5.0
"""Expected CPU time of a stage from which on it has a factor of its own."""
LIMITS = 0.2, 5.0
"""Smallest and largest factor; beyond them something else than the machine differs."""


class Speed(NamedTuple):
    """CPU time on this machine over that expected.

    Attributes
    ----------
    factors : dict
        Stage -> factor; the entry "" is that of all stages, for those which are not measured.
    repositories : tuple of str
        Folders that they were measured in; none for the constants of :mod:`.expected_cost` as they are.
    """

    factors: dict[str, float]
    repositories: tuple[str, ...] = ()

    def of(self, stage: str) -> float:
        """Factor of a stage."""
        return self.factors.get(stage, self.factors.get("", 1.0))


def measured_speed(out: Path) -> Speed:
    """Speed in the repositories of a folder.

    Parameters
    ----------
    out : Path
        Folder of repositories, such as `out`; it need not exist.
    """
    measured: dict[str, float] = defaultdict(float)
    expected: dict[str, float] = defaultdict(float)
    used = []
    for folder in _latest(out):
        found = list(_compared(folder))
        for stage, seconds, usual in found:
            measured[stage] += seconds
            expected[stage] += usual
        if found:
            used.append(str(folder))
    if sum(expected.values()) < MIN_SECONDS:
        return Speed({})
    pairs = {stage: (measured[stage], usual) for stage, usual in expected.items() if usual >= MIN_SECONDS}
    factors = {"": sum(measured.values()) / sum(expected.values())}
    factors |= {stage: seconds / usual for stage, (seconds, usual) in pairs.items()}
    return Speed({stage: min(max(factor, LIMITS[0]), LIMITS[1]) for stage, factor in factors.items()}, tuple(used))


def _latest(out: Path) -> list[Path]:
    """Folders of repositories with records, the one that was changed last first."""
    ledgers = [path for path in out.glob("*/ledger") if path.is_dir()]
    latest = sorted(ledgers, key=lambda path: path.stat().st_mtime, reverse=True)
    return [path.parent for path in latest[:MAX_REPOSITORIES]]


def _compared(folder: Path) -> Iterator[tuple[str, float, float]]:
    """Stage, CPU time, and expected CPU time of some jobs of a repository."""
    try:
        config = load(folder / "config.yaml")
        hearts = {case.id: case.config for case in expand(config)} if config.cases.number <= MAX_CASES else {}
    except (ConfigError, OSError):
        return
    for stage in expected_cost.STAGES:
        for path in islice((folder / "ledger" / stage).glob("**/[!.]*.json"), MAX_RECORDS):
            record = _read(path)
            seconds = record.get("cpu_seconds")
            heart = hearts.get(str(record.get("case")), None if hearts else config)
            if seconds is None or heart is None or "shared_with" in record:
                continue
            usual = _expected(heart, stage, record.get("view"))
            if usual is not None:
                yield stage, float(seconds) - float(record.get("compile_seconds", 0)), usual


def _expected(config: Config, stage: str, view: str | None) -> float | None:
    """Expected CPU time of a stage, s; None for a view that the configuration no longer has."""
    if stage in GATES:
        return expected_cost.mechanics_seconds(config) if stage == "mechanics" else expected_cost.PHYSIOLOGY_SECONDS
    return expected_cost.view_seconds(config, view)[stage] if view in config.views and view else None


def _read(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}
