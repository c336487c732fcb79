"""A tracker run again on variants of the clips of a repository, with the settings with which it was scored.

The tracker is given nothing but images by which a clip could be known (`variants.anonymous`).
The truth of a clip is read only after it has returned, so that it does not find it in its process.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from echotruth.evaluation.availability import check_runs
from echotruth.evaluation.clip import read_clips
from echotruth.evaluation.displacement_error import evaluate
from echotruth.evaluation.leaderboard import scores_of_guests
from echotruth.evaluation.parallel import in_processes
from echotruth.evaluation.run import prepare, track_clip
from echotruth.evaluation.scoring import Truth, read_truth
from echotruth.evaluation.tracker_options import EvaluationError, parse_tracker
from echotruth.loop.cycle import read_loop
from echotruth.repository import estimates
from echotruth.repository.reader import Repository
from echotruth.section import Section

from . import results
from .repositories import opened
from .results import COLUMNS, Row
from .splits import split_of
from .variants import VARIANTS, anonymous


@dataclass(frozen=True)
class Rerun:
    """A tracker, and variants of the clips of a repository on which it is run.

    Attributes
    ----------
    repository : Repository
    tracker : str
        Name under which it was scored.
    settings : Section
        Settings with which it was scored.
    variant : str
        One of `variants.VARIANTS`.
    split : str
        Half of the hearts on whose clips it is run.
    """

    repository: Repository
    tracker: str
    settings: Section
    variant: str
    split: str

    def case_views(self) -> list[tuple[str, str]]:
        """Case and view of every clip of the half that the tracker has tracked.

        Raises
        ------
        EvaluationError
            If there is none.
        """
        cases = [id for id, case in self.repository.every.items() if split_of(case) == self.split]
        clips, sizes = [(case, view) for case in cases for view in self.repository.views], self.sizes
        found = [clip for clip in clips if self._is_tracked(*clip, sizes)]
        if not found:
            remedy = "run the repository to its end, or evaluate the tracker again with --keep"
            raise EvaluationError(
                f"{self.repository.folder}: {self.tracker} has tracked no clip of the split {self.split}: {remedy}"
            )
        return found

    @property
    def sizes(self) -> list[int]:
        """Image sizes at which the tracker was scored, px."""
        own, known = self.repository.config.tracking.trackers, self.repository.sizes
        table = scores_of_guests(self.repository)
        scored = set(table[table["tracker"] == self.tracker]["size_px"])
        return [size for size in known if self.tracker in own or size in scored] or known

    def rows(self, sizes: list[int], jobs: int = 1) -> Iterator[Row]:
        """Scores of the variants, one row each.

        Parameters
        ----------
        sizes : list of int
            Image sizes, px.
        jobs : int
            Number of processes.
        """
        for rows in in_processes(partial(_view_rows, self, sizes), self.case_views(), jobs):
            yield from rows

    def _is_tracked(self, case: str, view: str, sizes: list[int]) -> bool:
        """Whether what the tracker found in a clip is stored, and the clip is still the same."""
        if self.repository.problem(case, view, "truth", "bmode", "tracking"):
            return False
        return any(estimates.each(self.repository, case, view, sizes, [self.tracker], "nrmse_all"))


def prepare_rerun(repository: Repository, tracker: str, variant: str, split: str) -> Rerun:
    """Prepare the run of a tracker that was scored on a repository.

    Parameters
    ----------
    repository : Repository
    tracker : str
        Its name, or `package.module:function` if its name was derived from that.
    variant, split : str
        As :class:`Rerun` has them.

    Raises
    ------
    EvaluationError
        If it was not scored, what was scored was not kept, or it cannot run.
    """
    own = repository.config.tracking.trackers
    name = parse_tracker(tracker, None, [])[0] if ":" in tracker else tracker
    if name in own:
        return Rerun(repository, name, own[name], variant, split)
    if name not in repository.trackers:
        remedy = f"evaluate it with --keep first, or use one of {', '.join(repository.trackers)}"
        raise EvaluationError(f"{tracker}: the motion that it tracked is not kept in {repository.folder}: {remedy}")
    settings = prepare(repository, name, estimates.settings(repository, name)).settings
    check_runs(settings)
    return Rerun(repository, name, settings, variant, split)


def rerun(
    repositories: list[Path], tracker: str, variant: str, split: str, sizes: list[int], jobs: int = 1
) -> Iterator[str]:
    """Run a tracker again on variants of the clips of repositories, and keep the scores; a line of text for every clip.

    Repositories that have not kept what it found are left out. The tracker is named as in :func:`prepare_rerun`; image
    sizes are in px, all if none is given. EvaluationError if the tracker was not evaluated on any of the repositories,
    or an image size is that of none.
    """
    runs, reasons = [], []
    for repository in map(opened, repositories):
        known, folder = repository.sizes, repository.folder
        if missing := [size for size in sizes if size not in known]:
            choices = ", ".join(map(str, known))
            raise EvaluationError(f"--size {missing[0]}: is not an image size of {folder}: use {choices}")
        try:
            run = prepare_rerun(repository, tracker, variant, split)
        except EvaluationError as error:
            reasons.append(str(error))
            continue
        if chosen := [size for size in run.sizes if size in (sizes or known)]:
            runs.append((run, chosen))
        else:
            choices = ", ".join(map(str, run.sizes))
            reasons.append(f"--size {sizes[0]}: {tracker} was not evaluated at it on {folder}: use {choices}")
    if not runs:
        raise EvaluationError("\n".join(reasons))
    for run, chosen in runs:
        rows = []
        for row in run.rows(chosen, jobs):
            rows.append(row)
            yield _line(row, variant)
        results.write(run.repository, run.tracker, variant, rows)


def _line(row: Row, variant: str) -> str:
    outcome = row["failure"] or f"NRMSE {row['error_percent']:.1f} % (before {row['before_percent']:.1f})"
    return f"{row['case']} {row['view']} {row['size_px']} px, {variant}: {outcome}"


def _view_rows(run: Rerun, sizes: list[int], case_view: tuple[str, str]) -> list[Row]:
    """Rows of the variants of the clips of one view of one heart."""
    with threadpool_limits(1):
        repository = run.repository
        time = read_loop(repository.config.loop).time
        found: dict[int, tuple[np.ndarray, str, int]] = {}
        for size, clip in read_clips(repository, *case_view).items():
            if size in sizes:
                variant = VARIANTS[run.variant](clip)
                estimate, failure = track_clip(anonymous(variant.clip, time), run.settings)
                found[size] = clip.on_grid(*variant.restored(*estimate))[0], failure, variant.last
        truth, of_clip = read_truth(repository, *case_view), repository.version(*case_view)
        rows = []
        for size, (displacement, failure, last) in found.items():
            found_before = estimates.tracked(repository, *case_view, run.tracker, size, "displacement")
            before = found_before["displacement"]
            frame = min(truth.es, last)
            errors = (_error(values, truth, frame) for values in (displacement, before))
            rows.append(dict(zip(COLUMNS, (*case_view, size, of_clip, *errors, failure), strict=True)))
        return rows


def _error(displacement: np.ndarray, truth: Truth, frame: int) -> float:
    """NRMSE in one frame, %, in which points without an estimate count as points that did not move."""
    tracked = np.asarray(displacement, float)[:, truth.inside]
    return float(100 * evaluate(tracked, truth.displacement, truth.wall, frame)["nrmse_all"])
