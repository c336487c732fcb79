"""Execution of one stage for one case, view and image size, and the record that commits its result.

A stage is a script: it reads the configuration of its case and what it needs from the store, calls one function, and
writes the arrays to the store. Last of all it commits a record with their checksums to the ledger, which is the output
that Snakemake knows of. A job that was killed has no record, and is run again.
"""

import argparse
import logging
import sys
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from echotruth.cases.case import Case
from echotruth.config import View
from echotruth.config.loading import ConfigError
from echotruth.heart import Heart
from echotruth.imaging.view import Plane, imaging_plane
from echotruth.repository import ledger, packing, schema, settings
from echotruth.repository.case_file import read_case
from echotruth.repository.checksums import ChecksumError, checksums
from echotruth.repository.ledger import STAGES, record_path, repository_folder
from echotruth.repository.provenance import code_version
from echotruth.repository.store import NotWritten, Store
from echotruth.repository.verdict import excluded
from echotruth.seeds import generator
from echotruth.workflow import instructions, lease
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.processes import lock_cache_writes, script

Result = Mapping[str, Mapping[str, ArrayLike]]
"""Arrays by group."""

Work = Callable[["Job"], Result]
log = logging.getLogger("echotruth")


class Job:
    """Inputs, results and record of one stage for one case, view and image size.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    stage : str
    case : str
        Id of the case, whose configuration is `cases/CASE.json`.
    view : str, optional
        Name of the view, for stages that are run per view.
    size : int, optional
        Image size, px, for stages that are run per size.
    code : str, optional
        Version of the code of the stage (default: that of its script).
    same_as : Path, optional
        Record of the case whose motion is taken over.

    Attributes
    ----------
    config : Config
        Configuration of the case.
    scatterers, lines : Path
        Files that the stages of a view pass on, and Snakemake deletes when they are not needed any more.
    earlier : dict
        Record of an earlier run; empty if there is none.
    """

    def __init__(
        self,
        folder: Path,
        stage: str,
        case: str,
        view: str | None = None,
        size: int | None = None,
        code: str = "",
        same_as: Path | None = None,
    ) -> None:
        self.folder, self.stage, self.view_name, self.size, self.same_as = folder, stage, view, size or 0, same_as
        self.case: Case = read_case(folder, case)
        self.config = self.case.config
        self.code = code or code_version(script(stage))
        self.store = Store(folder / f"{self.config.name}.zarr")
        self.record = record_path(folder, stage, case, view, size)
        self.earlier = self._read_earlier()
        scratch = folder / "scratch" / case / str(view)
        self.scatterers, self.lines = scratch / "scatterers.npz", scratch / "lines.npz"
        self._notes: dict[str, Any] = {}
        self.row = ledger.rows(folder / "registry.txt")[case]

    def _read_earlier(self) -> dict[str, Any]:
        try:
            return ledger.read(self.record)
        except (FileNotFoundError, ValueError):
            return {}

    @property
    def view(self) -> View:
        """Settings of the view."""
        return self.config.views[str(self.view_name)]

    @property
    def random_of(self) -> Callable[[str], np.random.Generator]:
        """Function from what is drawn to its random numbers for this case and view."""
        return partial(generator, self.case, str(self.view_name))

    @property
    def index(self) -> tuple[int, ...]:
        """Row of the case, and index of the view if there is one: their places in the store, which never change."""
        if self.view_name is None:
            return (self.row,)
        return self.row, ledger.rows(self.folder / "views.txt")[self.view_name]

    @cached_property
    def heart(self) -> Heart:
        """Solved heart of this case."""
        groups = ("geometry", "fibres", "pathology", "mechanics")
        return Heart.of({group: self.store.read(group, self.row) for group in groups}, self.config)

    @cached_property
    def plane(self) -> Plane:
        """Imaging plane of the view."""
        return imaging_plane(self.view, self.config.rf, self.heart.endo_at_ed)

    def read(self, group: str, *names: str) -> dict[str, Any]:
        """Arrays of a group for this case (and view)."""
        return self.store.read(group, *self.index, names=names or None)

    def coordinates(self, group: str, *names: str) -> dict[str, Any]:
        """Coordinates of a group, which all cases share."""
        paths = {name: self.store.path / group / name for name in names}
        return {name: np.asarray(zarr.open_array(path, mode="r", zarr_format=3)[...]) for name, path in paths.items()}

    def files(self, group: str) -> list[Path]:
        """Files of this job in a group."""
        return self.store.files(group, *self.index)

    def pass_on(self, file: Path, arrays: Mapping[str, np.ndarray]) -> None:
        """Write the file with which a stage of a view passes arrays on."""
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **arrays)  # type: ignore[arg-type]  # no array has the name of an option

    def passed_on(self, file: Path) -> dict[str, np.ndarray]:
        """Arrays that an earlier stage of the view passed on.

        Raises
        ------
        FileNotFoundError
            If they are not there, or not any more: a damaged file is deleted, so that the next run makes it anew.
        """
        if not file.is_file():
            stage = {self.scatterers: "phantom", self.lines: "rf"}[file]
            raise FileNotFoundError(f"{file}: is not there: run the stage {stage} first")
        try:
            # A .npz has a CRC-32 of every array.
            with np.load(file, allow_pickle=False) as opened:
                arrays = dict(opened)
            # What is no array comes as the bytes that stand there.
            if not all(isinstance(values, np.ndarray) for values in arrays.values()):
                raise ValueError
            return arrays
        except Exception:  # a damaged archive raises one of many errors
            file.unlink()
            remedy = "it is deleted, and the next run makes it anew"
            raise FileNotFoundError(f"{file}: is not what was written: {remedy}") from None

    def note(self, **entries: Any) -> None:
        """Add entries to the record of this job."""
        self._notes |= entries

    def excluded(self) -> str:
        """Why this stage is not run for this heart; empty if it is to be run."""
        return "" if self.stage == "mechanics" else excluded(self.folder, self.case.id, self.config)

    def commit(self, result: Result) -> None:
        """Write the result, then the record."""
        self.withdraw()
        files: list[Path] = []
        for group, values in result.items():
            # Coordinates, such as the times of a motion, belong to no job: they stand since the arrays were laid out.
            stored = packing.pack(schema.packs_of(group), values)
            own = {array.name for array in schema.arrays_of(group)} & stored.keys()
            for file in self.files(group):
                # Zarr would read a damaged shard before it replaces all of its chunks.
                if file.relative_to(self.store.path / group).parts[0] in own:
                    file.unlink()
            self.store.write(group, {name: stored[name] for name in own}, *self.index)
            files += self.files(group)
        self._commit(status="complete", sha256=checksums(files, self.store.path), **self._notes)

    def withdraw(self) -> None:
        """Withdraw the record of an earlier run, because the files for which it vouches are about to change.

        So are those of the whole repository; and if this job is killed, Snakemake makes a record that is lost again
        only for what lacks its own output.
        """
        (self.folder / "ledger/repository.json").unlink(missing_ok=True)
        self.record.unlink(missing_ok=True)

    def commit_without_result(self, status: str, reason: str) -> None:
        """Record that there is no result, and why; delete the result of an earlier run."""
        self.withdraw()
        for group in schema.written_by(self.stage, self.config, self.size or None):
            for file in self.files(group):
                file.unlink()
        passed_on = {"phantom": [self.scatterers], "rf": [self.lines]}
        for file in passed_on.get(self.stage, []):
            self.pass_on(file, {})
        self._commit(status=status, reason=reason)

    def _commit(self, **entries: Any) -> None:
        lease.confirm()
        place = {"case": self.case.id, "view": self.view_name, "size": self.size or None}
        made = {"seed": self.config.seed, "code": self.code, "instructions": instructions.kind()}
        made["settings"] = settings.of_job(self.config, self.stage, self.view_name)
        ledger.commit(self.record, {"stage": self.stage} | place | made | entries)


def main(stage: str, work: Work, description: str | None) -> None:
    """Run a stage with the arguments of its command line, and record its result, or that the heart has none."""
    arguments = vars(_parser(stage, description).parse_args())
    folder = arguments.pop("folder")
    _prepare(arguments.pop("threads"), " ".join(str(arguments[name]) for name in STAGES[stage]))
    try:
        lease.follow(folder)
        job = Job(repository_folder(folder), stage, **arguments)
    except (ConfigError, FileNotFoundError, KeyError, lease.LeaseError) as error:
        sys.exit(f"{stage}: {error}")
    if job.view_name is not None and job.view_name not in job.config.views:
        sys.exit(f"{stage}: {job.view_name} is not a view of {job.folder}: use {', '.join(job.config.views)}")
    if job.size and job.size not in job.config.bmode.sizes:
        sizes = ", ".join(map(str, job.config.bmode.sizes))
        sys.exit(f"{stage}: {job.size} is not an image size of {job.folder}: use {sizes}")
    run(job, work)


def run(job: Job, work: Work) -> None:
    """Do the work of a job and record its result, or that the heart has none."""
    if reason := job.excluded():
        log.warning("skipped: %s", reason)
        return job.commit_without_result("skipped", reason)
    try:
        # The rounding of BLAS sums depends on the number of threads, but results must not.
        with threadpool_limits(1):
            result = work(job)
            job.commit(result)
    except (NotWritten, ChecksumError, FileNotFoundError) as error:
        sys.exit(f"{job.stage}: {error}")
    except OSError as error:
        remedy = "the folder must be writable, on a disk that has space and no errors"
        sys.exit(f"{job.stage}: {error.filename or job.folder}: {error.strerror or error}: {remedy}")
    except CaseFailed as error:
        log.warning("failed: %s", error)
        job.commit_without_result("failed", str(error))


def _prepare(threads: int, place: str) -> None:
    """Give the log the name of a job, and its number of threads to numba."""
    import numba

    lock_cache_writes()
    numba.set_num_threads(max(1, min(threads, numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]  # set at run time
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format=f"{place}: %(message)s", force=True)
    logging.getLogger("numba").setLevel(logging.WARNING)


def _parser(stage: str, description: str | None) -> argparse.ArgumentParser:
    """Command line of a stage."""
    parser = argparse.ArgumentParser(prog=f"{stage}.py", description=description)
    parser.add_argument("folder", type=Path, help="folder of the repository, such as out/demo")
    helps = {"case": "case id from cases.csv", "view": "name of the view", "size": "image size in pixels"}
    for name in STAGES[stage]:
        parser.add_argument(name, type=int if name == "size" else str, help=helps[name])
    parser.add_argument("--threads", type=int, default=1, help="number of threads; results do not depend on it")
    parser.add_argument("--code", default="", help="version of the code, for the record (default: that of the script)")
    if stage == "mechanics":
        parser.add_argument("--same-as", type=Path, nargs="?", help="record of a heart whose motion is taken over")
    return parser
