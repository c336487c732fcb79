"""A tracker that is added to a repository which stands: it is run on its clips by the script of the rule tracking.

Its settings are in `trackers.yaml` in the folder of the repository, and count as if they were in the configuration: it
is one of its trackers, and a run makes what is missing of it.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shlex import join
from typing import Any

import yaml
from pydantic import TypeAdapter, ValidationError

from echotruth import files
from echotruth.config import shipped
from echotruth.config.loading import validate
from echotruth.config.tracking import VOLUMETRIC
from echotruth.evaluation.leaderboard import rows_of
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository.places import JobPlace
from echotruth.repository.publication import publish
from echotruth.repository.reader import Repository
from echotruth.section import Name, Section
from echotruth.workflow import lock, processes
from echotruth.workflow.plan import ADDED, Plan, added_trackers

Row = dict[str, Any]
"""Case, view, size_px and tracker of a clip, its metrics, and why the tracker failed (or "")."""


@dataclass(frozen=True)
class AddedTracker:
    """One tracker and the repository to which it is added.

    Attributes
    ----------
    repository : Repository
    name : str
        Name of the tracker.
    settings : Section
        Settings of the tracker, as one of `tracking.trackers`.
    """

    repository: Repository
    name: str
    settings: Section

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
        finished = self.repository.finished(cases, views, "truth", "bmode", "points")
        case_views = [(case.id, view) for case, complete in finished for view in complete]
        if not case_views:
            folder = self.repository.folder
            raise EvaluationError(f"{folder} has no complete clip of these cases and views: run it to its end")
        return case_views

    def rows(self, case_views: list[tuple[str, str]], jobs: int = 1) -> Iterator[Row]:
        """Run the tracker on clips and publish the repository with it; a row for each clip, in their order.

        Parameters
        ----------
        case_views : list of (case, view)
        jobs : int
            Number of processes at a time.

        Raises
        ------
        EvaluationError
            If the tracker ends its process, a clip is damaged, or the folder cannot be written; what the tracker found
            is then removed, and the repository has the trackers that it had.
        """
        if jobs < 1:
            raise EvaluationError(f"--jobs {jobs}: must be 1 or more")
        if self.repository.is_sample:
            raise EvaluationError(f"{shipped.SAMPLE}: {shipped.NOT_WRITTEN}")
        folder = self.repository.folder
        try:
            with lock.held(folder), self._added(case_views), ThreadPoolExecutor(jobs) as pool:
                try:
                    for case_view, _ in zip(case_views, pool.map(self._run, case_views), strict=True):
                        yield from rows_of(Repository(folder), *case_view, [self.name])
                finally:
                    pool.shutdown(cancel_futures=True)
        except OSError as error:
            remedy = "the folder must be writable, on a disk that has space and no errors"
            raise EvaluationError(f"{error.filename or folder}: {error.strerror or error}: {remedy}") from error

    @contextmanager
    def _added(self, case_views: list[tuple[str, str]]) -> Iterator[None]:
        """Make the tracker one of the repository, and publish it with what was found; after an error, as it was."""
        folder, file, own = self.repository.folder, self.repository.folder / ADDED, self._own()
        before = file.read_bytes() if file.is_file() else None
        try:
            together = added_trackers(folder) | {self.name: self.settings.model_dump(mode="json")}
            files.write(file, yaml.safe_dump(together, sort_keys=False).encode())
            Plan(own, folder=folder).begin()
            yield
        except BaseException:
            file.unlink(missing_ok=True) if before is None else files.write(file, before)
            self._withdraw(Plan(own, folder=folder), case_views)
            raise
        finally:
            plan = Plan(own, folder=folder)
            plan.begin()
            publish(folder, plan.config, list(plan.cases.values()))

    def _withdraw(self, plan: Plan, case_views: list[tuple[str, str]]) -> None:
        """Remove what the tracker found, but for what one of its name had found before with the settings it had."""
        is_known = self.name in plan.config.tracking.trackers
        for case, view in case_views:
            if not (is_known and plan.is_made(JobPlace("tracking", case, view, self.name))):
                shutil.rmtree(plan.store / f"clips/{case}/{view}/tracking/{self.name}", ignore_errors=True)

    def _own(self) -> dict[str, Any]:
        """The configuration without trackers that were added."""
        values, added = self.repository.config.model_dump(mode="json"), added_to(self.repository)
        trackers = {name: own for name, own in values["tracking"]["trackers"].items() if name not in added}
        return values | {"tracking": values["tracking"] | {"trackers": trackers}}

    def _run(self, case_view: tuple[str, str]) -> None:
        """Do the job of the rule tracking on one view, in a process of its own."""
        folder = self.repository.folder
        log = folder / "logs/tracking" / Path(*case_view) / f"{self.name}.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        command = f'{processes.prefix(shipped.ROOT).format()}exec python "$SCRIPTS/tracking.py" '
        with log.open("w") as output:
            arguments = join([str(folder), *case_view, self.name])
            run = subprocess.run(["bash", "-c", command + arguments], stdout=output, stderr=output, check=False)
        if run.returncode:
            said, own = log.read_text(errors="replace").strip().splitlines()[-1:], "tracking: "
            why = f"its process ended: its output is in {log}; a tracker that ends it can be a program, with --command"
            if said and said[0].startswith(own):
                why = said[0].removeprefix(own)
            raise EvaluationError(f"{self.name} has no result on {' '.join(case_view)}: {why}")


def added_to(repository: Repository) -> set[str]:
    """Names of the trackers that were added to a repository, without those that its configuration has by now."""
    found, added = repository.config.tracking.trackers, added_trackers(repository.folder)
    return {name for name in found.keys() & added.keys() if found[name].model_dump(mode="json") == added[name]}


def prepare(repository: Repository, name: str, values: dict[str, Any]) -> AddedTracker:
    """Prepare the evaluation of a tracker that is not one of the configuration of a repository.

    Parameters
    ----------
    repository : Repository
    name : str
        Name of the tracker; letters, digits and underscores.
    values : dict
        Its settings, as in a configuration.

    Raises
    ------
    EvaluationError
        If the configuration has a tracker of that name, the name is invalid, or it tracks slices in place of volumes.
    ConfigError
        If the settings are invalid.
    """
    config = repository.config
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        remedy = "use letters, digits and underscores, 40 at most and a letter first, with --name"
        raise EvaluationError(f"{name!r} cannot be the name of a tracker: {remedy}") from None
    if name in config.tracking.trackers and name not in added_to(repository):
        taken = f"{name} is already a tracker of {repository.folder}"
        raise EvaluationError(f"{taken}: give this one another name with --name")
    tracking = config.tracking.model_dump()
    together = tracking | {"trackers": tracking["trackers"] | {name: values}}
    settings = validate(config.model_dump() | {"tracking": together}, f"tracker {name}").tracking.trackers[name]
    if config.has_volumes and type(settings) not in VOLUMETRIC:
        raise EvaluationError(f"{name} tracks slices: volumes need bspline_dic, or a function or program")
    return AddedTracker(repository, name, settings)


def format_row(row: Row) -> str:
    """One line of text on a row, to show progress."""
    outcome = row["failure"] or f"NRMSE {row['nrmse_percent']:.1f} %"
    return f"{row['case']} {row['view']} {row['size_px']} px: {outcome}"


def summary(rows: list[Row]) -> str:
    """Means over the cases as text, one line per view and image size."""
    import pandas as pd

    table = pd.DataFrame(rows)
    groups = table.assign(failed=table["failure"] != "").groupby(["view", "size_px"], sort=False)
    counts = {"clips": groups.size(), "failed": groups["failed"].sum()}
    shown = ("nrmse_all_percent", "nrmse_percent", "epe_um", "drift_um", "coverage_percent")
    means = groups[[name for name in shown if name in table]].mean()  # volumes have no epe_um
    return means.assign(**counts).to_string(float_format="{:.1f}".format, na_rep="-")
