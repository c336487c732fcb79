"""What is known of the clips of repositories: labels, metrics of every tracker, and difficulty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import pandas as pd

from echotruth.config import Config
from echotruth.evaluation.clip_metrics import ClipMetrics, clip_metrics
from echotruth.evaluation.difficulty.table import difficulties
from echotruth.evaluation.leaderboard import scores_of_guests
from echotruth.evaluation.parallel import in_processes
from echotruth.evaluation.resampling import CLIP
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository.reader import Repository

from .conditions import MAIN_SPECIES, with_conditions
from .repositories import opened
from .splits import check_halves, split_of_label

NEEDED = (*CLIP, "tracker", "split", "true_gls_percent", "true_gcs_percent")
"""Columns of the tables of repositories of which no clip is evaluated."""


@dataclass(frozen=True)
class Suite:
    """A repository, and how far it is.

    Attributes
    ----------
    repository : Repository
    complete : list of (case, view)
        Views that are tracked and evaluated.
    """

    repository: Repository
    complete: list[tuple[str, str]]

    @property
    def config(self) -> Config:
        """Its configuration."""
        return self.repository.config

    @property
    def name(self) -> str:
        """Name of the configuration."""
        return self.config.name

    @property
    def expected(self) -> int:
        """Number of views that the configuration makes."""
        return len(self.repository.every) * len(self.config.views)

    @property
    def clips(self) -> tuple[int, int]:
        """Numbers of clips that are evaluated, and of all: each view has one of every image size."""
        sizes = len(self.config.bmode.sizes)
        return sizes * len(self.complete), sizes * self.expected


@dataclass(frozen=True)
class Records:
    """Tables of several repositories, each with the columns `repository` and `species`.

    Attributes
    ----------
    suites : list of Suite
    clips, segments, reliability : DataFrame
        As :func:`echotruth.evaluation.clip_metrics.clip_metrics` returns them, and columns of
        `conditions.with_conditions`.
    difficulty : DataFrame
        Columns `CLIP` of :mod:`echotruth.evaluation.resampling`, and those of
        :func:`echotruth.evaluation.difficulty.floors.difficulty`.
    """

    suites: list[Suite]
    clips: pd.DataFrame
    segments: pd.DataFrame
    reliability: pd.DataFrame
    difficulty: pd.DataFrame

    def of_split(self, split: str) -> Records:
        """The part of one half of the hearts."""
        return self._where("split", split)

    @property
    def species(self) -> list[str]:
        """Species of the clips."""
        return [] if self.clips.empty else list(dict.fromkeys(self.clips["species"]))

    def of_main_species(self) -> Records:
        """The part of the main species; all if no clip is of it."""
        return self._where("species", MAIN_SPECIES) if MAIN_SPECIES in self.species else self

    def _where(self, column: str, value: str) -> Records:
        tables = {name: getattr(self, name) for name in ("clips", "segments", "reliability")}
        return replace(self, **{name: table[table[column] == value] for name, table in tables.items()})

    @property
    def sizes(self) -> list[int]:
        """Image sizes, px, the largest first."""
        return sorted((int(size) for size in self.clips["size_px"].unique()), reverse=True)

    @property
    def largest(self) -> int:
        """Largest image size that all repositories have, px; 0 without clips.

        Raises
        ------
        EvaluationError
            If they have none in common.
        """
        found = {str(name): set(part["size_px"]) for name, part in self.clips.groupby("repository")}
        common = set.intersection(*found.values()) if found else {0}
        if not common:
            listed = ", ".join(f"{name} ({_listed(sorted(sizes, reverse=True))} px)" for name, sizes in found.items())
            raise EvaluationError(f"the repositories have no image size in common: {listed}: rank each by itself")
        return int(max(common))


def read(repositories: list[Path], sizes: list[int], jobs: int = 1) -> Records:
    """Read the records of repositories.

    Parameters
    ----------
    repositories : list of Path
        Folders.
    sizes : list of int
        Image sizes to include, px; all if empty.
    jobs : int
        Number of processes.

    Raises
    ------
    EvaluationError
        As :func:`read_suites` does, and if a repository has no clips of these sizes.
    """
    suites = read_suites(repositories)
    parts: list[tuple[Suite, ClipMetrics]] = []
    floors = []
    for suite in suites:
        chosen = [size for size in suite.config.bmode.sizes if size in (sizes or [size])]
        if not chosen:
            choices = _listed(suite.config.bmode.sizes)
            raise EvaluationError(f"{suite.repository.folder}: has no images of {sizes[0]} px: use {choices}")
        metrics = partial(clip_metrics, suite.repository, sizes=chosen)
        # A share for each process: what all cases have in common is read once in each.
        shares = _shares(list(dict.fromkeys(case for case, _ in suite.complete)), jobs)
        parts += [(suite, found) for found in in_processes(metrics, shares, jobs)]
        difficulty = partial(_difficulty, suite.repository)
        floors += [found.assign(repository=suite.name) for found in in_processes(difficulty, suite.complete, jobs)]
    several = len(suites) > 1
    clips, segments, sure = (
        with_conditions(pd.concat([_of(suite, found[k], several) for suite, found in parts], ignore_index=True))
        if parts
        else pd.DataFrame(columns=list(NEEDED))
        for k in range(3)
    )
    difficult = pd.concat(floors, ignore_index=True) if floors else pd.DataFrame(columns=list(CLIP))
    return Records(suites, clips, segments, sure, difficult)


def read_suites(repositories: list[Path]) -> list[Suite]:
    """See how far repositories are.

    Parameters
    ----------
    repositories : list of Path
        Folders.

    Raises
    ------
    EvaluationError
        If a folder is no repository, two have one name, a heart is not in one half, or scores of a tracker from outside
        cannot be read.
    """
    suites = [_suite(folder) for folder in repositories]
    names = [suite.name for suite in suites]
    if doubled := next((name for name in names if names.count(name) > 1), ""):
        raise EvaluationError(f"two repositories have the name {doubled}: give each once")
    return suites


def _suite(folder: Path) -> Suite:
    """A repository, given its folder or its store."""
    repository = opened(folder)
    try:
        scores_of_guests(repository)
    except ValueError as error:
        raise EvaluationError(str(error)) from None
    try:
        check_halves(repository.every)
    except EvaluationError as error:
        raise EvaluationError(f"{repository.folder}: {error}") from None
    wanted = [(case, view) for case in repository.every for view in repository.views]
    return Suite(repository, [clip for clip in wanted if not repository.problem(*clip, "tracking")])


def _listed(sizes: Sequence[int]) -> str:
    return ", ".join(map(str, sizes))


def _shares(cases: list[str], number: int) -> list[list[str]]:
    """Cases in their order in as many parts of one size, the last of which may be smaller; none of no cases."""
    size = -(-len(cases) // max(1, number))
    return [cases[start : start + size] for start in range(0, len(cases), max(1, size))]


def _difficulty(repository: Repository, clip: tuple[str, str]) -> pd.DataFrame:
    case, view = clip
    return difficulties(repository, cases=[case], views=[view])


def _of(suite: Suite, table: pd.DataFrame, several: bool) -> pd.DataFrame:
    """A table of a repository beside those of others: hearts of two repositories may have one name."""
    species = suite.config.geometry.preset
    heart = f"{suite.name}/" + table["heart"] if several else table["heart"]
    split = table["split"].map(split_of_label)
    return table.assign(repository=suite.name, species=species, heart=heart, split=split)
