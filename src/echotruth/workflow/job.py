"""Execution of one stage for a heart, for a view, or for a tracker in a view.

A stage is a script: it reads the configuration of its case and the groups that are inputs of its rule, calls one
function, and writes groups. A group is moved to its place when it is whole; a job that was killed leaves none.
"""

import argparse
import gc
import json
import logging
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from echotruth.cases.case import Case
from echotruth.config import Config, View
from echotruth.config.diagnosis import bounds_of
from echotruth.heart import Heart
from echotruth.imaging.view import NoWall, Plane, before_probe
from echotruth.repository import group, metadata, schema
from echotruth.repository.coordinates import coordinates_of
from echotruth.repository.places import OF_HEART, groups_of, place, repository_folder
from echotruth.repository.status import excluded
from echotruth.repository.version import version_of
from echotruth.seeds import generator
from echotruth.workflow import lock
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.processes import guard_cache

Result = Mapping[str, Mapping[str, ArrayLike]]
"""Arrays, and coordinates of their own, by group."""

Work = Callable[["Job"], Result]
log = logging.getLogger("echotruth")


def case_file(folder: Path, case: str) -> Path:
    """File with the configuration of one case, which its jobs read."""
    return folder / "cases" / f"{case}.json"


def case_text(case: Case) -> str:
    """Content of the file of a case."""
    return json.dumps({"heart": case.heart, "config": case.config.model_dump(mode="json")})


def read_case(folder: Path, case: str) -> Case:
    """The case of a job.

    Raises
    ------
    FileNotFoundError
        If it has no configuration, or one that is damaged.
    """
    path, remedy = case_file(folder, case), "the ids are in cases.csv; run the repository again, which writes the file"
    try:
        found = json.loads(path.read_bytes())
        return Case(case, {}, Config.model_validate(found["config"], strict=False), heart=found["heart"])
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: is not there: {remedy}") from None
    except (ValueError, KeyError, TypeError):
        raise FileNotFoundError(f"{path}: is damaged: {remedy}") from None


class Job:
    """Inputs and results of one stage for one case, view and tracker.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    stage : str
    case : str
        Id of the case; of mechanics, of any that has the heart.
    view : str, optional
        Name of the view, for stages that are run per view.
    tracker : str, optional
        Name of the tracker, for tracking.

    Attributes
    ----------
    config : Config
        Configuration of the case.
    notes : dict
        Further attributes of the groups that are written.
    """

    def __init__(
        self, folder: Path, stage: str, case: str, view: str | None = None, tracker: str | None = None
    ) -> None:
        self.folder, self.stage, self.view_name, self.tracker = folder, stage, view, tracker
        self.case: Case = read_case(folder, case)
        self.config = self.case.config
        self.store = folder / f"{self.config.name}.zarr"
        self.notes: dict[str, Any] = {}

    @property
    def view(self) -> View:
        """Settings of the view."""
        return self.config.views[str(self.view_name)]

    @property
    def random_of(self) -> Callable[[str], np.random.Generator]:
        """Function from what is drawn to its random numbers for this case and view."""
        return partial(generator, self.case, str(self.view_name))

    @property
    def heart(self) -> Heart:
        """Solved heart of this case, as it moves before the probe of the view."""
        return self._before_probe[0]

    @property
    def plane(self) -> Plane:
        """Imaging plane of the view."""
        return self._before_probe[1]

    @cached_property
    def solved(self) -> Heart:
        """Solved heart of this case, as it moves in the heart frame."""
        groups = {name: self.read(name) for name in ("geometry", "fibres", "pathology", "mechanics")}
        return Heart.of(groups, self.config)

    @cached_property
    def _before_probe(self) -> tuple[Heart, Plane]:
        return before_probe(self.solved, self.config, str(self.view_name))

    def read(self, name: str, *arrays: str) -> dict[str, Any]:
        """Arrays of a group for this case (and view), all if none is named."""
        return group.read(self.store, self._place(name), *arrays)

    def coordinate(self, name: str, coordinate: str) -> Any:
        """Values of a coordinate of a group."""
        return np.asarray(group.open_group(self.store, self._place(name))[coordinate][...])  # type: ignore[index]

    @cached_property
    def excluded(self) -> str:
        """Why this stage is not run for this heart; empty if it is to be run."""
        if self.stage == "mechanics":
            return ""
        return excluded(metadata.attributes(self.store / self._place("heart")), bounds_of(self.config))

    @cached_property
    def version(self) -> str:
        """What the groups are made with; to be asked for first, as code and files may change while the job works."""
        return version_of(self.stage, self.config, self.view_name, self.tracker, self.excluded)

    def groups(self) -> list[str]:
        """Groups that this job writes: those of which Snakemake knows."""
        return groups_of(self.stage, self.config.image_names, self.tracker)

    def write(self, result: Result) -> None:
        """Write the groups of a result, each as a whole."""
        about = {"status": "complete", "reason": "", "version": self.version} | self.notes
        if self.stage in OF_HEART:
            self._write({name: partial(_write_groups, result, self.config, about) for name in self.groups()})
        else:
            self._write(
                {name: partial(_write_group, name, values, self.config, about) for name, values in result.items()}
            )

    def write_nothing(self, status: str, reason: str) -> None:
        """Write groups that say why there is no result."""
        about = {"status": status, "reason": reason, "version": self.version}
        self._write({name: partial(group.write_nothing, attributes=about) for name in self.groups()})

    def _write(self, groups: dict[str, Callable[[Path], None]]) -> None:
        group.write_groups(self.store, {self._place(name): write for name, write in groups.items()})

    def _place(self, name: str) -> str:
        return place(name, self.case.heart, self.case.id, self.view_name)


def _write_group(name: str, values: Mapping[str, ArrayLike], config: Config, about: dict[str, Any], to: Path) -> None:
    own = {coordinate: values[coordinate] for coordinate in values if coordinate in schema.COORDINATES}
    group.write(to, name, values, coordinates_of(name, config) | own, config, about)


def _write_groups(result: Result, config: Config, about: dict[str, Any], folder: Path) -> None:
    """Write several groups into one, which has their metadata too."""
    for name, values in result.items():
        _write_group(name, values, config, {}, folder / name.rpartition("/")[2])
    metadata.write(folder, about)


def main(stage: str, work: Work, description: str | None) -> None:
    """Run a stage with the arguments of its command line, and write its groups, or why there are none."""
    arguments = vars(_parser(stage, description).parse_args())
    folder = arguments.pop("folder")
    _prepare(arguments.pop("threads"), " ".join(str(value) for value in arguments.values()))
    try:
        folder = repository_folder(folder)
        lock.share(folder)
        job = Job(folder, stage, **arguments)
    except (FileNotFoundError, lock.LockError) as error:
        sys.exit(f"{stage}: {error}")
    if job.view_name is not None and job.view_name not in job.config.views:
        sys.exit(f"{stage}: {job.view_name} is not a view of {job.folder}: use {', '.join(job.config.views)}")
    if job.tracker is not None and job.tracker not in job.config.tracking.trackers:
        known = ", ".join(job.config.tracking.trackers)
        sys.exit(f"{stage}: {job.tracker} is not a tracker of {job.folder}: use {known}")
    run(job, work)


def run(job: Job, work: Work) -> None:
    """Do the work of a job and write its groups, or why the heart has none."""
    from threadpoolctl import threadpool_limits

    try:
        log.info("version %s", job.version)
        if job.excluded:
            log.warning("skipped: %s", job.excluded)
            return job.write_nothing("skipped", job.excluded)
        # The rounding of BLAS sums depends on the number of threads, but results must not.
        with threadpool_limits(1):
            return job.write(work(job))
    except (group.NotWritten, FileNotFoundError, NoWall) as error:
        sys.exit(f"{job.stage}: {error}")
    except OSError as error:
        remedy = "the folder must be writable, on a disk that has space and no errors"
        sys.exit(f"{job.stage}: {error.filename or job.folder}: {error.strerror or error}: {remedy}")
    except CaseFailed as error:
        log.warning("failed: %s", error)
        job.write_nothing("failed", str(error))


def _prepare(threads: int, place: str) -> None:
    """Give the log the name of a job, and its number of threads to Numba.

    Numba is loaded here for all stages: a tracker may compile functions that no module of its stage imports before.
    """
    with suppress(ModuleNotFoundError):  # an installation without the extra make runs trackers that need no Numba
        import numba

        guard_cache()
        numba.set_num_threads(max(1, min(threads, numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]
    gc.freeze()  # the collector need not walk through all that was imported, each time anew
    logging.getLogger("numba").setLevel(logging.WARNING)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format=f"{place}: %(message)s", force=True)


def _parser(stage: str, description: str | None) -> argparse.ArgumentParser:
    """Command line of a stage."""
    parser = argparse.ArgumentParser(prog=f"{stage}.py", description=description)
    parser.add_argument("folder", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("case", help="case id from cases.csv")
    if stage not in OF_HEART:
        parser.add_argument("view", help="name of the view")
    if stage == "tracking":
        parser.add_argument("tracker", help="name of the tracker")
    parser.add_argument("--threads", type=int, default=1, help="number of threads; results do not depend on it")
    return parser
