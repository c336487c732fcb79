"""Evaluation of one tracker on the clips of a published repository, scored as the workflow scores its own trackers.

The scores are written to `external/NAME.csv` in the folder of the repository, one row per clip, and, if asked for, the
displacement and the curves to `external/NAME.zarr` (:mod:`echotruth.evaluation.kept`); nothing else changes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from echotruth.cases import all_cases
from echotruth.config import Config
from echotruth.config.loading import load, validate
from echotruth.evaluation import kept
from echotruth.evaluation.choice import chosen, folder_of, is_complete
from echotruth.evaluation.clip import Clip, clips
from echotruth.evaluation.digest import digest
from echotruth.evaluation.parallel import in_processes
from echotruth.evaluation.scoring import Truth, ground_truth, metrics, score
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.section import Name, Section
from echotruth.tracking.external_program import in_one_line
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

Row = dict[str, Any]
"""Case, view, size_px, tracker and digest (`clip`) of a clip, its metrics, and why the tracker failed (or "")."""


@dataclass(frozen=True)
class EvaluationRun:
    """One tracker and the repository on which it is evaluated.

    Attributes
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
        Configuration of the repository.
    name : str
        Name of the tracker.
    settings : Section
        Settings of the tracker, as one of `tracking.trackers`.
    keep : bool
        Whether to store displacement, quality and curves beside the scores.
    """

    folder: Path
    config: Config
    name: str
    settings: Section
    keep: bool = False

    @property
    def file(self) -> Path:
        """File of the scores."""
        return self.folder / "external" / f"{self.name}.csv"

    def case_views(self, cases: list[str], views: list[str]) -> list[tuple[str, str]]:
        """Case and view of every complete clip.

        Parameters
        ----------
        cases, views : list of str
            Those to include; all if empty.

        Raises
        ------
        EvaluationError
            If the repository does not have one of them, or has no complete clip.
        """
        cases = chosen("case", cases, list(all_cases(self.config)), self.folder, EvaluationError)
        views = chosen("view", views, list(self.config.views), self.folder, EvaluationError)
        every = [(case, view) for case in cases for view in views]
        case_views = [clip for clip in every if is_complete(self.folder, *clip, "truth", "bmode")]
        if not case_views:
            raise EvaluationError(f"{self.folder} has no complete clip of these cases and views: run it to its end")
        return case_views

    def sizes(self, sizes: list[int]) -> list[int]:
        """Image sizes to include; all if the list is empty."""
        return chosen("size", sizes, self.config.bmode.sizes, self.folder, EvaluationError)

    def rows(self, case_views: list[tuple[str, str]], sizes: list[int], jobs: int = 1) -> Iterator[Row]:
        """Score the clips, one row each, in the order of `case_views` and image sizes for any number of jobs.

        Parameters
        ----------
        case_views : list of (case, view)
        sizes : list of int
        jobs : int
            Number of processes.

        Raises
        ------
        EvaluationError
            If `jobs` is less than 1, or the tracker ends its process without an exception.
        """
        ended = f"{self.name} ended its process and cannot be scored: run it as a program, with --command"
        try:
            for rows in in_processes(partial(_score_view, self, sizes), case_views, jobs, ended):
                yield from rows
        except BaseException:  # also when nobody asks for the rest of the rows
            self.keeping.discard()
            raise

    def check_writable(self) -> None:
        """Make the folder of the scores, and the arrays to be kept; EvaluationError if they cannot be written there."""
        with self._writing():
            self.file.parent.mkdir(exist_ok=True)
            with TemporaryFile(dir=self.file.parent):
                pass
            if self.keep:
                self.keeping.begin()

    def write(self, rows: list[Row]) -> pd.DataFrame:
        """Write the scores atomically, and give what is kept its name; they replace earlier ones of the same name.

        What an earlier evaluation of this name kept is removed also if nothing is kept now, and so are its
        scores on variants of the clips, NAME.*.json (benchmarks/suite/results.py): they are not of what was scored.
        """
        import pandas as pd

        table = pd.DataFrame(rows)
        draft = self.file.with_name(f".{self.file.name}.{os.getpid()}")
        with self._writing():
            table.to_csv(draft, index=False)
            if self.keep:
                clips = {f"{row['case']}/{row['view']}": row["clip"] for row in rows}
                self.keeping.publish(clips, self.settings.model_dump(mode="json"))
            else:
                kept.remove(self.folder, self.name)
            for earlier in self.file.parent.glob(f"{self.name}.*.json"):
                earlier.unlink()
            draft.replace(self.file)
        return table

    @property
    def keeping(self) -> kept.Keeping:
        """Store of what the tracker finds, in the making."""
        return kept.Keeping(self.folder, self.config, self.name)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            remedy = f"it must be a folder that you may write to ({error.strerror})"
            raise EvaluationError(f"{self.file.parent} cannot hold the scores: {remedy}") from error


def prepare(repository: Path, name: str, values: dict[str, Any], keep: bool = False) -> EvaluationRun:
    """Prepare the evaluation of a tracker that is not one of the repository's.

    Parameters
    ----------
    repository : Path
        `out/NAME` or `out/NAME/NAME.zarr`.
    name : str
        Name of the tracker; letters, digits and underscores.
    values : dict
        Its settings, as in a configuration.
    keep : bool
        Whether to store displacement, quality and curves beside the scores.

    Raises
    ------
    EvaluationError
        If there is no such repository, it has a tracker of that name, or the name is invalid.
    ConfigError
        If the settings are invalid.
    """
    folder = folder_of(repository)
    config = load(folder / "config.yaml")
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        remedy = "use letters, digits and underscores, 40 at most and a letter first, with --name"
        raise EvaluationError(f"{name!r} cannot be the name of a tracker: {remedy}") from None
    if name in config.tracking.trackers:
        raise EvaluationError(f"{name} is already a tracker of {folder}: give this one another name with --name")
    tracking = {"grid_px": config.tracking.grid_px, "trackers": {name: values}}
    checked = validate(config.model_dump() | {"tracking": tracking}, f"tracker {name}")
    return EvaluationRun(folder, config, name, checked.tracking.trackers[name], keep)


def _score_view(run: EvaluationRun, sizes: list[int], case_view: tuple[str, str]) -> list[Row]:
    """Scores of the clips of one view of one heart."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        # The random numbers of a job depend on its stage: a tracker is to draw the same as in the workflow.
        job = Job(run.folder, "tracking", *case_view)
        with _reading(run, case_view):
            clip_of_size = {size: clip for size, clip in clips(job).items() if size in sizes}
        tracked = {size: track_clip(clip, run.settings) for size, clip in clip_of_size.items()}
        # The truth is read only now, so that a tracker does not find it in its process.
        with _reading(run, case_view):
            truth = ground_truth(job)
        found = {size: _score_clip(run, case_view, clip_of_size[size], truth, *tracked[size]) for size in tracked}
        if run.keep:
            try:
                run.keeping.write(job, {size: arrays for size, (_, arrays) in found.items()})
            except OSError as error:
                raise EvaluationError(f"{run.file.parent} cannot hold the displacement: {error.strerror}") from error
        return [row for row, _ in found.values()]


@contextmanager
def _reading(run: EvaluationRun, case_view: tuple[str, str]) -> Iterator[None]:
    """EvaluationError if a clip or its truth cannot be read."""
    try:
        yield
    except (ValueError, KeyError, OSError) as error:
        remedy = f"run it again ({in_one_line(str(error))})"
        raise EvaluationError(f"{run.folder} cannot be read at {' '.join(case_view)}: {remedy}") from error


def track_clip(clip: Clip, settings: Section) -> tuple[tuple[np.ndarray, np.ndarray], str]:
    """Displacement and quality that a tracker finds in a clip, and why it failed, or ""."""
    try:
        return track(*clip.tracker_arguments, settings), ""
    except TrackerFailed as error:
        return clip.no_estimate, str(error)


def _score_clip(
    run: EvaluationRun,
    case_view: tuple[str, str],
    clip: Clip,
    truth: Truth,
    estimate: tuple[np.ndarray, np.ndarray],
    failure: str,
) -> tuple[Row, kept.Found]:
    """Row of a clip, and the arrays of the tracker by group."""
    keys = {"case": case_view[0], "view": case_view[1], "size_px": clip.size, "tracker": run.name}
    keys["clip"] = digest(run.folder, *case_view)
    displacement, quality = clip.on_grid(*estimate)
    scored = score(displacement, truth)
    row = keys | metrics(scored, truth.wall.plane) | {"failure": failure}
    return row, {"tracking": {"displacement": displacement, "quality": quality}, "evaluation": scored}


def format_row(row: Row) -> str:
    """One line of text on a row, to show progress."""
    outcome = row["failure"] or f"NRMSE {row['nrmse_percent']:.1f} %"
    return f"{row['case']} {row['view']} {row['size_px']} px: {outcome}"


def summary(table: pd.DataFrame) -> str:
    """Means over the cases as text, one line per view and image size.

    Parameters
    ----------
    table : DataFrame
        As :meth:`EvaluationRun.write` returns it.
    """
    groups = table.assign(failed=table["failure"] != "").groupby(["view", "size_px"], sort=False)
    counts = {"clips": groups.size(), "failed": groups["failed"].sum()}
    means = groups[["nrmse_all_percent", "nrmse_percent", "epe_um", "drift_um", "coverage_percent"]].mean()
    return means.assign(**counts).to_string(float_format="{:.1f}".format, na_rep="-")
