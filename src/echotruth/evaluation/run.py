"""A trial: one tracker over the clips of a published repository, scored as the workflow scores its own.

Its scores stand in `guests/NAME.csv` in the folder of the repository, one row a clip; nothing else there is touched.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import load, validate
from echotruth.evaluation.clip import Clip, clips
from echotruth.evaluation.digest import digest
from echotruth.evaluation.scoring import Truth, ground_truth, row, score
from echotruth.evaluation.tracker_options import CannotTry
from echotruth.repository import ledger
from echotruth.repository.ledger import record_path
from echotruth.section import Name, Section
from echotruth.tracking.external_program import in_one_line
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, Any]
"""A clip's case, view, size_px, tracker and digest (`clip`), its measures, and why the tracker failed (else empty)."""


@dataclass(frozen=True)
class Trial:
    """One tracker and the repository on which it is tried.

    Attributes
    ----------
    folder : Path
        Of the repository, `out/NAME`.
    config : Config
        Of the repository.
    name : str
        Of the tracker.
    settings : Section
        Of the tracker, as one of `tracking.trackers`.
    """

    folder: Path
    config: Config
    name: str
    settings: Section

    @property
    def file(self) -> Path:
        """Where the scores are written."""
        return self.folder / "guests" / f"{self.name}.csv"

    def places(self, cases: list[str], views: list[str]) -> list[tuple[str, str]]:
        """Case and view of every clip there is.

        Parameters
        ----------
        cases, views : list of str
            These alone; all where it is empty.

        Raises
        ------
        CannotTry
            If one of them is not of the repository, or there is no clip.
        """
        cases = self._chosen("case", cases, [case.id for case in expand(self.config)])
        views = self._chosen("view", views, list(self.config.views))
        found = [(case, view) for case in cases for view in views if self._is_complete(case, view)]
        if not found:
            raise CannotTry(f"{self.folder} has no complete clip of what was asked: run it to its end")
        return found

    def sizes(self, sizes: list[int]) -> list[int]:
        """Image sizes: these alone, or all where the list is empty."""
        return self._chosen("size", sizes, list(self.config.bmode.sizes))

    def rows(self, places: list[tuple[str, str]], sizes: list[int], jobs: int = 1) -> Iterator[Row]:
        """Score the clips, one row each, in the order of `places` and of the image sizes whatever the number of jobs.

        Parameters
        ----------
        places : list of (case, view)
        sizes : list of int
        jobs : int
            Number of processes.

        Raises
        ------
        CannotTry
            If there is to be no process, or the tracker ends one otherwise than by an exception.
        """
        if jobs < 1:
            raise CannotTry(f"--jobs {jobs}: must be 1 or more")
        work = partial(_rows, self, sizes)
        if jobs == 1:
            for place in places:
                yield from work(place)
            return
        threads = max(1, (os.cpu_count() or 1) // jobs)
        with ProcessPoolExecutor(jobs, get_context("spawn"), _limit, (threads,)) as pool:
            try:
                for rows in pool.map(work, places):
                    yield from rows
            except BrokenProcessPool:
                remedy = "make it a program, with --command"
                raise CannotTry(f"{self.name} ended its process, so that nothing is known of it: {remedy}") from None
            finally:
                pool.shutdown(cancel_futures=True)

    def make_room(self) -> None:
        """Make the folder of the scores; CannotTry, before there are any, where they could not be written."""
        with self._writing():
            self.file.parent.mkdir(exist_ok=True)
            with TemporaryFile(dir=self.file.parent):
                pass

    def write(self, rows: list[Row]) -> pd.DataFrame:
        """Write the scores, whole or not at all, in place of those of an earlier trial of that name."""
        import pandas as pd

        table = pd.DataFrame(rows)
        draft = self.file.with_name(f".{self.file.name}.{os.getpid()}")
        with self._writing():
            table.to_csv(draft, index=False)
            draft.replace(self.file)
        return table

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            remedy = f"it must be a folder that you may write to ({error.strerror})"
            raise CannotTry(f"{self.file.parent} cannot hold the scores: {remedy}") from error

    def _chosen(self, what: str, asked: list[Any], known: list[Any]) -> list[Any]:
        for each in asked:
            if each not in known:
                there = ", ".join(map(str, known[:20]))
                raise CannotTry(f"{each} is not a {what} of {self.folder}: use {there}")
        return [each for each in known if each in asked or not asked]

    def _is_complete(self, case: str, view: str) -> bool:
        records = [record_path(self.folder, stage, case, view) for stage in ("truth", "bmode")]
        return all(path.is_file() and ledger.read(path)["status"] == "complete" for path in records)


def trial(repository: Path, name: str, values: dict[str, Any]) -> Trial:
    """A trial of a tracker that is not one of the repository's.

    Parameters
    ----------
    repository : Path
        `out/NAME` or `out/NAME/NAME.zarr`.
    name : str
        Of the tracker; letters, digits and underscores.
    values : dict
        Its settings, as they would stand in the configuration.

    Raises
    ------
    CannotTry
        If there is no such repository, or it has a tracker of that name, or the name cannot be.
    ConfigError
        If the settings cannot be.
    """
    folder = repository.parent if repository.suffix == ".zarr" else repository
    if not (folder / "config.yaml").is_file() or not (folder / "registry.txt").is_file():
        raise CannotTry(f"{repository} is not a repository: give the folder that a run made, as out/demo")
    config = load(folder / "config.yaml")
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        remedy = "use letters, digits and underscores only, a letter first and 40 at most, with --name"
        raise CannotTry(f"{name!r} cannot be the name of a tracker: {remedy}") from None
    if name in config.tracking.trackers:
        raise CannotTry(f"{name} is a tracker of {folder} already: give this one another name with --name")
    tracking = {"grid_px": config.tracking.grid_px, "trackers": {name: values}}
    checked = validate(config.model_dump() | {"tracking": tracking}, f"tracker {name}")
    return Trial(folder, config, name, checked.tracking.trackers[name])


def _limit(threads: int) -> None:
    import numba

    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))


def _rows(trial: Trial, sizes: list[int], place: tuple[str, str]) -> list[Row]:
    """Scores of the clips of one view of one heart."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        # As the stage of that name, so that a tracker draws the same random numbers.
        job = Job(trial.folder, "tracking", *place)
        try:
            truth, found = ground_truth(job), clips(job)
        except (ValueError, KeyError, OSError) as error:
            remedy = f"run it again ({in_one_line(str(error))})"
            raise CannotTry(f"{trial.folder} cannot be read at {' '.join(place)}: {remedy}") from error
        return [_row(trial, place, clip, truth) for size, clip in found.items() if size in sizes]


def _row(trial: Trial, place: tuple[str, str], clip: Clip, truth: Truth) -> Row:
    try:
        answer, failure = track(*clip.given, trial.settings), ""
    except TrackerFailed as error:
        answer, failure = clip.nothing, str(error)
    named = {"case": place[0], "view": place[1], "size_px": clip.size, "tracker": trial.name}
    named["clip"] = digest(trial.folder, *place)
    measures = row(score(clip.on_grid(*answer)[0], truth), truth.wall.plane)
    return named | measures | {"failure": failure}


def told(row: Row) -> str:
    """A row in one line, for those who wait."""
    outcome = row["failure"] or f"NRMSE {row['nrmse_percent']:.1f} %"
    return f"{row['case']} {row['view']} {row['size_px']} px: {outcome}"


def summary(table: pd.DataFrame) -> str:
    """Means over the cases, one line a view and image size, as text.

    Parameters
    ----------
    table : DataFrame
        Of the rows of a trial.
    """
    groups = table.assign(failed=table["failure"] != "").groupby(["view", "size_px"], sort=False)
    counts = {"clips": groups.size(), "failed": groups["failed"].sum()}
    means = groups[["nrmse_all_percent", "nrmse_percent", "epe_um", "drift_um", "coverage_percent"]].mean()
    return means.assign(**counts).to_string(float_format="{:.1f}".format, na_rep="-")
