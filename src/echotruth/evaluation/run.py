"""Evaluation of one tracker on the clips of a published repository, scored as the workflow scores its own trackers.

The scores are written to `external/NAME.csv` in the folder of the repository, one row per clip, and, if asked for, the
displacement and the curves to `external/NAME.zarr` (:mod:`echotruth.repository.estimates`); nothing else changes.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from echotruth import files
from echotruth.config import shipped
from echotruth.config.loading import validate
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.parallel import in_processes
from echotruth.evaluation.scoring import Truth, metrics, read_truth, score
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository import estimates, group, metadata
from echotruth.repository.choice import chosen
from echotruth.repository.coordinates import coordinates_of
from echotruth.repository.estimates import external_store
from echotruth.repository.places import place
from echotruth.section import Name, Section
from echotruth.tracking.external_program import in_one_line
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from echotruth.repository.reader import Repository

Row = dict[str, Any]
"""Case, view, size_px, tracker and version (`clip`) of a clip, its metrics, and why the tracker failed (or "")."""


@dataclass(frozen=True)
class EvaluationRun:
    """One tracker and the repository on which it is evaluated.

    Attributes
    ----------
    repository : Repository
    name : str
        Name of the tracker.
    settings : Section
        Settings of the tracker, as one of `tracking.trackers`.
    keep : bool
        Whether to store displacement, quality and curves beside the scores.
    """

    repository: Repository
    name: str
    settings: Section
    keep: bool = False

    @property
    def file(self) -> Path:
        """File of the scores."""
        return self.repository.folder / "external" / f"{self.name}.csv"

    def case_views(self, cases: list[str], views: list[str]) -> list[tuple[str, str]]:
        """Case and view of every complete clip.

        Parameters
        ----------
        cases, views : list of str
            Those to include; all if empty.

        Raises
        ------
        ValueError
            If the repository does not have one of them, or has no complete clip.
        """
        finished = self.repository.finished(cases, views, "truth", "bmode")
        case_views = [(case.id, view) for case, complete in finished for view in complete]
        if not case_views:
            folder = self.repository.folder
            raise EvaluationError(f"{folder} has no complete clip of these cases and views: run it to its end")
        return case_views

    def sizes(self, sizes: list[int]) -> list[int]:
        """Image sizes to include; all if the list is empty."""
        return chosen("size", sizes, self.repository.sizes)

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
        for rows in in_processes(partial(_score_view, self, sizes), case_views, jobs, ended):
            yield from rows

    def check_writable(self) -> None:
        """Make the folder of the scores, and the arrays to be kept; EvaluationError if they cannot be written there."""
        if self.repository.is_sample:
            raise EvaluationError(f"{shipped.SAMPLE}: {shipped.NOT_WRITTEN}")
        with self._writing():
            self.file.parent.mkdir(exist_ok=True)
            with TemporaryFile(dir=self.file.parent):
                pass
            shutil.rmtree(self._draft.parent, ignore_errors=True)  # of an evaluation that was broken off
            if self.keep:
                about = {"settings": self.settings.model_dump(mode="json")}
                metadata.write(self._draft, about, consolidated=False)

    def write(self, rows: list[Row]) -> pd.DataFrame:
        """Write the scores, and move the motion that is kept beside them; they replace those of the same name."""
        import pandas as pd

        table = pd.DataFrame(rows)
        with self._writing():
            shutil.rmtree(store := external_store(self.repository.folder, self.name), ignore_errors=True)
            if self.keep:
                self._draft.replace(store)
            shutil.rmtree(self._draft.parent, ignore_errors=True)
            files.write(self.file, table.to_csv(index=False).encode())
        return table

    def keep_found(self, case_view: tuple[str, str], found: dict[int, dict[str, np.ndarray]]) -> None:
        """Store what the tracker found in the clips of a view, by image size."""
        case, about = self.repository.case(case_view[0]), {"clip": self.repository.version(*case_view)}
        groups = {}
        for size, arrays in found.items():
            name = f"tracking/{size}"
            values = {key: value[None] for key, value in arrays.items() if key in estimates.names_of_trackers()}
            coordinates = coordinates_of(name, case.config) | {"tracker": [self.name]}
            groups[place(name, case.heart, *case_view)] = partial(
                group.write, group=name, values=values, coordinates=coordinates, config=case.config, attributes=about
            )
        with self._writing():
            group.write_groups(self._draft, groups)

    @property
    def _draft(self) -> Path:
        """Store of what is kept until the evaluation is at its end, alone in a folder that no reader looks into."""
        return self.file.parent / f".{self.name}" / f"{self.name}.zarr"

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            remedy = f"it must be a folder that you may write to ({error.strerror})"
            raise EvaluationError(f"{self.file.parent} cannot hold the scores: {remedy}") from error


def prepare(repository: Repository, name: str, values: dict[str, Any], keep: bool = False) -> EvaluationRun:
    """Prepare the evaluation of a tracker that is not one of the repository's.

    Parameters
    ----------
    repository : Repository
    name : str
        Name of the tracker; letters, digits and underscores.
    values : dict
        Its settings, as in a configuration.
    keep : bool
        Whether to store displacement, quality and curves beside the scores.

    Raises
    ------
    EvaluationError
        If the repository has a tracker of that name, or the name is invalid.
    ConfigError
        If the settings are invalid.
    """
    config = repository.config
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        remedy = "use letters, digits and underscores, 40 at most and a letter first, with --name"
        raise EvaluationError(f"{name!r} cannot be the name of a tracker: {remedy}") from None
    if name in config.tracking.trackers:
        taken = f"{name} is already a tracker of {repository.folder}"
        raise EvaluationError(f"{taken}: give this one another name with --name")
    tracking = {"grid": config.tracking.grid, "trackers": {name: values}}
    checked = validate(config.model_dump() | {"tracking": tracking}, f"tracker {name}")
    return EvaluationRun(repository, name, checked.tracking.trackers[name], keep)


def _score_view(run: EvaluationRun, sizes: list[int], case_view: tuple[str, str]) -> list[Row]:
    """Scores of the clips of one view of one heart."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        with _reading(run, case_view):
            clips = read_clips(run.repository, *case_view)
            clip_of_size = {size: clip for size, clip in clips.items() if size in sizes}
        tracked = {size: track_clip(clip, run.settings) for size, clip in clip_of_size.items()}
        # The truth is read only now, so that a tracker does not find it in its process.
        with _reading(run, case_view):
            truth = read_truth(run.repository, *case_view)
        found = {size: _score_clip(run, case_view, clip_of_size[size], truth, *tracked[size]) for size in tracked}
        if run.keep:
            run.keep_found(case_view, {size: arrays for size, (_, arrays) in found.items()})
        return [row for row, _ in found.values()]


@contextmanager
def _reading(run: EvaluationRun, case_view: tuple[str, str]) -> Iterator[None]:
    """EvaluationError if a clip or its truth cannot be read."""
    try:
        yield
    except Exception as error:  # Zarr raises many kinds of what is damaged
        remedy = f"run it again ({in_one_line(str(error))})"
        raise EvaluationError(f"{run.repository.folder} cannot be read at {' '.join(case_view)}: {remedy}") from error


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
) -> tuple[Row, dict[str, np.ndarray]]:
    """Row of a clip, and the arrays of the tracker."""
    keys = {"case": case_view[0], "view": case_view[1], "size_px": clip.size, "tracker": run.name}
    keys["clip"] = run.repository.version(*case_view)
    displacement, quality = clip.on_grid(*estimate)
    scored = score(displacement, truth)
    row = keys | metrics(scored, truth.wall.plane) | {"failure": failure}
    return row, {"displacement": displacement, "quality": quality} | scored


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
