"""What is to be exported of a repository."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.evaluation import kept
from echotruth.evaluation.choice import Item, chosen
from echotruth.export.clip import Clip
from echotruth.export.error import ExportError
from echotruth.repository import ledger
from echotruth.repository.ledger import GATES, record_path, repository_folder


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
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
        Configuration of the repository.
    selection : Selection
    """

    folder: Path
    config: Config
    selection: Selection

    @property
    def trackers(self) -> list[str]:
        """Names of the chosen trackers; all of the repository's own if none is named."""
        own = list(self.config.tracking.trackers)
        named = self.selection.trackers
        return self._chosen("tracker", named, kept.trackers(self.folder, self.config) if named else own)

    def hearts(self) -> Iterator[Clip]:
        """The chosen hearts."""
        cases = {case.id: case for case in expand(self.config, str(self.folder / "config.yaml"))}
        for case in self._chosen("case", self.selection.cases, list(cases)):
            yield Clip(self.folder, cases[case])

    def views(self) -> Iterator[Clip]:
        """The chosen views of the chosen hearts."""
        views = self._chosen("view", self.selection.views, list(self.config.views))
        for heart in self.hearts():
            for view in views:
                yield Clip(self.folder, heart.case, view)

    def clips(self) -> Iterator[Clip]:
        """The clips of the chosen sizes of the chosen views."""
        sizes = list(self.config.bmode.sizes)
        wanted = self._chosen("size", self.selection.sizes, sizes) if self.selection.sizes else [max(sizes)]
        for view in self.views():
            for size in wanted:
                yield Clip(self.folder, view.case, view.view, size)

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
            raise ExportError(f"{self.folder} has no hearts: look at the section cases of its config.yaml")
        return found, problems

    def _chosen(self, what: str, names: Sequence[Item], known: Sequence[Item]) -> list[Item]:
        return chosen(what, names, known, self.folder, ExportError)


def source(repository: Path, selection: Selection) -> Source:
    """Open a repository.

    Parameters
    ----------
    repository : Path
        `out/NAME` or `out/NAME/NAME.zarr`.
    selection : Selection

    Raises
    ------
    ExportError
        If there is no repository.
    ConfigError
        If its configuration cannot be read.
    """
    try:
        folder = repository_folder(repository)
    except FileNotFoundError as error:
        raise ExportError(str(error)) from None
    return Source(folder, load(folder / "config.yaml"), selection)


def unfinished(clip: Clip, *stages: str) -> str:
    """Why a heart or clip cannot be exported, in one sentence; "" if it can.

    Parameters
    ----------
    clip : Clip
    *stages : str
        Stages of which it needs the arrays.
    """
    gates = ledger.imaged_statuses(clip.case.config.physiology.exclude_implausible)
    for stage in stages:
        view, accepted = (None, gates) if stage in GATES else (clip.view, ("complete",))
        path = record_path(clip.folder, stage, clip.case.id, view)
        what = " ".join(filter(None, [clip.case.id, view]))
        if not path.is_file():
            return f"{clip.folder} has no {stage} of {what} yet: run it to its end"
        try:
            record = ledger.read(path)
        except ValueError:
            return f"{path} is damaged: run echotruth check {clip.folder} --heal, and the configuration again"
        if (status := record.get("status")) not in accepted:
            return f"{what} of {clip.folder} is {status}: cases.csv says why"
    return ""
