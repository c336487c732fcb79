"""How a repository is getting on: what of it is made, what failed and why, and whether a run works on it."""

from __future__ import annotations

from collections import Counter
from itertools import product
from pathlib import Path
from typing import Any

from echotruth.config import Config
from echotruth.repository.checksums import CHECKSUMS, METADATA
from echotruth.repository.places import NOT_NEEDED, OF_HEART, STAGES, groups_of
from echotruth.repository.reader import Repository
from echotruth.workflow import lock
from echotruth.workflow.concerns import concerns

MAX_SHOWN = 10
"""Largest number of hearts that are named with their reasons."""


def status_of(folder: Path) -> dict[str, Any]:
    """Status of a repository.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.

    Returns
    -------
    dict
        `repository`, its folder; `state`, running, finished or stopped; `jobs`, stage -> number that is done and number
        of all; `verdicts`, number of cases by their status; and `reasons`, case -> status and reason of those that are
        not complete.

    Raises
    ------
    FileNotFoundError
        If the folder is no repository.
    """
    repository = Repository(folder)
    table, store = repository.parameters, Path(repository.store)  # type: ignore[arg-type]  # it is a folder
    done = {stage: _done(repository, store, stage) for stage in STAGES if stage != "inference" or _infers(repository)}
    needed = [numbers for stage, numbers in done.items() if stage not in NOT_NEEDED]
    is_finished = (folder / CHECKSUMS).is_file() and all(made == number for made, number in needed)
    lost = table[~table["status"].isin(["complete", "unfinished"])]
    return {
        "repository": str(folder),
        "state": "running" if lock.is_held(folder) else "finished" if is_finished else "stopped",
        "jobs": done,
        "verdicts": dict(Counter(table["status"])),
        "reasons": {case: f"{status}: {reason}" for case, status, reason in lost[["status", "reason"]].itertuples()},
    }


def _infers(repository: Repository) -> bool:
    return bool(repository.config.inference.tracker)


def _done(repository: Repository, store: Path, stage: str) -> tuple[int, int]:
    """Number of the groups of a stage that are made, and of all."""
    views = [None] if stage in OF_HEART else repository.views
    trackers = repository.trackers if stage == "tracking" else [""]
    groups = [group for tracker in trackers for group in groups_of(stage, repository.config.image_names, tracker)]
    places = {repository.path(*one) for one in product(groups, repository.present, views)}
    return sum((store / place / METADATA).is_file() for place in places), len(places)


def text(status: dict[str, Any]) -> str:
    """The status, a line for each stage, then the hearts."""
    states = {"running": "a run works on it", "finished": "finished", "stopped": "not finished: run it to go on"}
    lines = [f"{status['repository']}: {states[status['state']]}", ""]
    lines += [f"{stage:13}{f'{done}/{number}':>12}" for stage, (done, number) in status["jobs"].items()]
    return "\n".join([*lines, "", *verdicts(status)])


def conclusion(config: Config, folder: Path) -> list[str]:
    """What is to be known at the end of a run: what speaks against its images, and which hearts have no result."""
    return [*(f"warning: {concern.text}" for concern in concerns(config)), *verdicts(status_of(folder))]


def verdicts(status: dict[str, Any]) -> list[str]:
    """Number of hearts by their status, and the reasons of those that are not complete."""
    counts = ", ".join(f"{number} {name}" for name, number in status["verdicts"].items())
    reasons = [f"  {case}: {reason}" for case, reason in status["reasons"].items()]
    more = [f"  and {len(reasons) - MAX_SHOWN} more"] if len(reasons) > MAX_SHOWN else []
    return [f"Hearts: {counts}", *reasons[:MAX_SHOWN], *more]
