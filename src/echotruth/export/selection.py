"""What is to be exported of a repository."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from echotruth.export.clip import Clip
from echotruth.export.error import ExportError
from echotruth.repository.choice import chosen
from echotruth.repository.reader import Repository


@dataclass(frozen=True)
class Selection:
    """Choice of cases, views, sizes and trackers.

    Attributes
    ----------
    cases, views, trackers : sequence of str
        Their names; all if empty.
    sizes : sequence of int
        Pixels along a side; the largest if empty.
    """

    cases: Sequence[str] = ()
    views: Sequence[str] = ()
    sizes: Sequence[int] = ()
    trackers: Sequence[str] = ()


@dataclass(frozen=True)
class Source:
    """A repository and what is to be exported of it.

    Attributes
    ----------
    repository : Repository
    selection : Selection
    """

    repository: Repository
    selection: Selection

    @property
    def trackers(self) -> list[str]:
        """Names of the chosen trackers; all of the repository's own if none is named."""
        own = list(self.repository.config.tracking.trackers)
        return chosen("tracker", self.selection.trackers, self.repository.trackers if self.selection.trackers else own)

    def hearts(self) -> Iterator[Clip]:
        """The chosen hearts."""
        cases = {case.id: case for case in self.repository.all_cases()}
        for case in chosen("case", self.selection.cases, cases):
            yield Clip(self.repository, cases[case])

    def views(self) -> Iterator[Clip]:
        """The chosen views of the chosen hearts."""
        views = chosen("view", self.selection.views, self.repository.views)
        for heart in self.hearts():
            for view in views:
                yield Clip(self.repository, heart.case, view)

    def clips(self) -> Iterator[Clip]:
        """The clips of the chosen sizes of the chosen views."""
        sizes = chosen("size", self.selection.sizes, self.repository.sizes)
        for view in self.views():
            for size in sizes if self.selection.sizes else [max(sizes)]:
                yield Clip(self.repository, view.case, view.view, size)

    def finished(self, clips: Iterator[Clip], problem: Callable[[Clip], str]) -> tuple[list[Clip], list[str]]:
        """Those of some clips that can be exported, and the problems of the others.

        Parameters
        ----------
        clips : iterator of Clip
        problem : callable
            What is wrong with a clip, in one sentence; "" if nothing is.

        Raises
        ------
        ExportError
            If none can be exported, or one cannot whose case was named.
        """
        found, problems = [], []
        for clip in clips:
            if reason := problem(clip):
                problems.append(reason)
            else:
                found.append(clip)
        if problems and (self.selection.cases or not found):
            raise ExportError(problems[0])
        if not found:
            raise ExportError(f"{self.repository.folder} has no hearts: look at the section cases of its config.yaml")
        return found, problems
