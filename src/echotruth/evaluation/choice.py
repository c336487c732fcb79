"""What is asked for of a repository: cases, their hearts, views, image sizes and trackers, and what is complete."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from echotruth.cases import Case, expand
from echotruth.cases.case import Label
from echotruth.cases.ids import integer_if_whole
from echotruth.config import Config
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository import ledger
from echotruth.repository.ledger import record_path
from echotruth.workflow.job import Job
from echotruth.workflow.settings import motions

Item = TypeVar("Item", str, int)


def chosen(
    what: str,
    names: Sequence[Item] | None,
    known: Sequence[Item],
    folder: Path | None = None,
    error: type[ValueError] = ValueError,
) -> list[Item]:
    """Those of the known names that are asked for, in their order; all if none are.

    Parameters
    ----------
    what : str
        What the names are, for the message.
    names : sequence or None
        A text is a single name.
    known : sequence
    folder : Path, optional
        Folder of the repository, for the message to a user of the command line.
    error : type of ValueError, optional
        What is raised.

    Raises
    ------
    ValueError
        If one is not known.
    """
    if isinstance(names, str):
        names = [names]
    for name in names or ():
        if name not in known:
            choices = ", ".join(map(str, known[:20])) or "none: it has no such thing"
            asked = f"{what} = {name!r}: use one of {choices}."
            raise error(asked if folder is None else f"{name} is not a {what} of {folder}: use {choices}")
    return [name for name in known if not names or name in names]


def require_known(what: str, name: Item, known: Collection[Item]) -> Item:
    """A name that has to be known; ValueError says what else there is."""
    if name not in known:
        raise ValueError(f"{what} = {name!r}: use one of {', '.join(map(str, list(known)[:20]))}.")
    return name


def image_size(config: Config, size: int | None) -> int:
    """Pixels along a side of a clip: the size asked for, or the largest.

    Raises
    ------
    ValueError
        If the configuration has no clips of that size.
    """
    sizes = config.bmode.sizes
    if size is not None and size not in sizes:
        known = ", ".join(map(str, sizes))
        raise ValueError(f"size = {size}: use one of {known}, which bmode.size_px and bmode.downsampling set.")
    return sizes[0] if size is None else size


def folder_of(repository: Path) -> Path:
    """Folder of a repository, given it or its store; EvaluationError if it is none."""
    try:
        return ledger.repository_folder(repository)
    except FileNotFoundError as error:
        raise EvaluationError(str(error)) from None


def is_complete(folder: Path, case: str, view: str | None, *stages: str) -> bool:
    """Whether stages of a heart, or of one of its views, are complete."""
    paths = [record_path(folder, stage, case, view) for stage in stages]
    return all(path.is_file() and ledger.read(path).get("status") == "complete" for path in paths)


def cases_of(folder: Path, config: Config) -> dict[str, Case]:
    """Cases of a repository by id."""
    return {case.id: case for case in expand(config, str(folder / "config.yaml"))}


def hearts_of(cases: dict[str, Case]) -> dict[str, str]:
    """Heart of every case: its label; without one, that of the first case with the same motion, or the name of that."""
    told = {name: label_text(case.labels.get("heart")) for name, case in cases.items()}
    if all(told.values()):
        return told
    motion = motions({name: case.config for name, case in cases.items()})
    first: dict[str, str] = {}
    for name, heart in told.items():
        first.setdefault(motion[name], heart or name)
    return {name: heart or first[motion[name]] for name, heart in told.items()}


def label_text(label: Label) -> str:
    """A label as text, a whole number without a decimal point; "" if there is none."""
    return "" if label is None else str(integer_if_whole(label))


def jobs_of(
    folder: Path,
    config: Config,
    known: Mapping[str, Case],
    cases: Sequence[str] | None,
    views: Sequence[str] | None,
    *stages: str,
) -> Iterator[Job]:
    """Jobs that track views of known cases, those asked for, of which these stages are complete.

    ValueError if there is no such case or view.
    """
    chosen_views = chosen("view", views, list(config.views))
    for case in chosen("case", cases, list(known)):
        for view in chosen_views:
            if is_complete(folder, case, view, *stages):
                yield Job(folder, "tracking", known[case], view, code="read")


def job_of(repository: str | Path, case: str, view: str | None = None) -> Job:
    """The job that tracks a view of a heart, through which a repository is read.

    FileNotFoundError or ValueError if there is no such repository, case or view.
    """
    folder = ledger.repository_folder(repository)
    job = Job(folder, "tracking", require_known("case", case, ledger.rows(folder / "registry.txt")), view)
    if view is not None:
        require_known("view", view, job.case.config.views)
    return job
