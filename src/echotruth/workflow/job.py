"""Job: the work of one stage on one heart (and view), and its record in the ledger."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Callable
from inspect import getfile
from itertools import takewhile
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from echotruth.cases import Case, find_case
from echotruth.config import View
from echotruth.config.loading import load
from echotruth.heart import Heart
from echotruth.repository import ledger, schema
from echotruth.repository.checksums import checksums
from echotruth.repository.ledger import GATES, record_path
from echotruth.repository.provenance import code_version
from echotruth.repository.store import NotWritten, Store, Values
from echotruth.seeds import generator
from echotruth.workflow.compiled import lock_cache_writes
from echotruth.workflow.cost import Cost
from echotruth.workflow.failure import CaseFailed

Result = dict[str, Values]
log = logging.getLogger("echotruth")


class Job:
    """Inputs, results and record of one stage for one case (and view).

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    stage : str
        Name of the stage.
    case : str
        Case id.
    view : str, optional
        Name of the view, for stages that are run per view.
    script : str, optional
        Path of the script of the stage (default: the running script).
    """

    def __init__(self, folder: Path, stage: str, case: str, view: str | None = None, script: str | None = None) -> None:
        self.folder, self.stage = folder, stage
        self._script = script or sys.argv[0]
        self.case: Case = find_case(load(folder / "config.yaml"), case)
        self.view_name = view
        self.verdict = {"status": "complete"}
        self.store = Store(folder / f"{self.case.config.name}.zarr")
        self.row = ledger.rows(folder / "registry.txt")[case]

    @property
    def view(self) -> View:
        """Settings of the view."""
        return self.case.config.views[str(self.view_name)]

    @property
    def random(self) -> np.random.Generator:
        """Random numbers of this stage, case and view."""
        return generator(self.case, str(self.view_name), self.stage)

    @property
    def index(self) -> tuple[int, ...]:
        """Row of the case, and index of the view if there is one."""
        views = list(self.case.config.views)
        return (self.row,) if self.view_name is None else (self.row, views.index(self.view_name))

    @property
    def scratch(self) -> Path:
        """Folder for arrays that one stage of a view passes to the next and that are not kept."""
        return self.folder / "scratch" / self.case.id / str(self.view_name)

    @property
    def checkpoint_folder(self) -> Path:
        """Folder in which this stage saves its progress until it is committed, so that a stopped run can continue."""
        return self.folder / "scratch" / self.case.id / f"{self.stage}-{code_version(self._script)}"

    @property
    def record(self) -> Path:
        """Path of the record of this job."""
        return record_path(self.folder, self.stage, self.case.id, self.view_name)

    def read(self, group: str, *names: str) -> dict[str, Any]:
        """Arrays of a group for this case (and view)."""
        return self.store.read(group, *self.index, names=names or None)

    @property
    def heart(self) -> Heart:
        """Solved heart of this case."""
        groups = ("geometry", "fibres", "pathology", "mechanics")
        return Heart.of({group: self.store.read(group, self.row) for group in groups}, self.case.config)

    def save_scratch(self, **arrays: Any) -> None:
        """Save arrays for the next stage of this view."""
        self.scratch.mkdir(parents=True, exist_ok=True)
        np.savez(self.scratch / f"{self.stage}.npz", **arrays)

    def load_scratch(self, stage: str) -> dict[str, Any]:
        """Load the arrays that an earlier stage of this view saved."""
        path = self.scratch / f"{stage}.npz"
        if not path.is_file():
            raise NotWritten(f"{path}: file not found: run the stage {stage} first")
        with np.load(path) as file:
            return dict(file)

    def skip_reason(self) -> str:
        """Reason not to run this stage for this heart; empty if it is to be run."""
        for gate in takewhile(lambda stage: stage != self.stage, GATES):
            path = record_path(self.folder, gate, self.case.id)
            record = ledger.read(path) if path.exists() else {"status": "complete"}
            accepted = ("complete",) if self.case.config.physiology.exclude_implausible else ("complete", "implausible")
            if record["status"] not in accepted:
                return record["reason"]
        return ""

    def set_verdict(self, status: str, reason: str) -> None:
        """Set the status of the record of a job that has a result, and its reason."""
        self.verdict = {"status": status, "reason": reason}

    def commit(self, result: Result, cost: Cost) -> dict[str, float]:
        """Write the result, then the record; return the cost."""
        files: list[Path] = []
        for group, values in result.items():
            self.store.write(group, values, *self.index)
            files += self.store.files(group, *self.index)
        sha256 = checksums(files, self.store.path)
        spent = cost.stop()
        self._record(**self.verdict, **spent, frames=self.case.config.loop.frames, sha256=sha256)
        return spent

    def record_without_result(self, status: str, reason: str) -> None:
        """Record that there is no result, and why; delete the result of an earlier run."""
        for group in schema.written_by(self.stage, self.case.config):
            for file in self.store.files(group, *self.index):
                file.unlink()
        self._record(status=status, reason=reason)

    def _record(self, **entries: Any) -> None:
        job = {"stage": self.stage, "case": self.case.id, "view": self.view_name, "seed": self.case.config.seed}
        ledger.commit(self.record, job | {"code": code_version(self._script)} | entries)
        rmtree(self.checkpoint_folder, ignore_errors=True)


Work = Callable[[Job], Result]


def main(stage: str, work: Work, description: str | None, per_view: bool = True) -> None:
    """Run a stage with the arguments of its command line."""
    run(stage, work, parser(stage, description, per_view).parse_args(), Cost())


def run(stage: str, work: Work, arguments: argparse.Namespace, cost: Cost) -> None:
    """Run a stage and record its result.

    Parameters
    ----------
    stage : str
    work : callable
        Maps a job to its arrays by group.
    arguments : Namespace
        As parsed by :func:`parser`.
    cost : Cost
        Cost counter of this process.
    """
    job = _open(stage, getfile(work), arguments)
    _prepare(job, arguments.threads)
    if reason := job.skip_reason():
        log.warning("skipped: %s", reason)
        job.record_without_result("skipped", reason)
        return
    cost.start()
    try:
        # The rounding of BLAS sums depends on the number of threads, but results must not.
        with threadpool_limits(1):
            result = work(job)
    except NotWritten as error:
        sys.exit(f"{stage}: {error}")
    except CaseFailed as error:
        log.warning("failed: %s", error)
        job.record_without_result("failed", str(error))
        return
    log.info("done in %.1f s", job.commit(result, cost)["seconds"])


def _open(stage: str, script: str, arguments: argparse.Namespace) -> Job:
    try:
        view = getattr(arguments, "view", None)
        job = Job(arguments.repository, stage, arguments.case, view, script)
    except ValueError as error:
        sys.exit(f"{stage}: {error}")
    if view is not None and view not in job.case.config.views:
        sys.exit(f"{stage}: {view} is not a view of {arguments.repository}: use {', '.join(job.case.config.views)}")
    return job


def _prepare(job: Job, threads: int) -> None:
    import numba

    lock_cache_writes()
    numba.set_num_threads(max(1, min(threads, numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]  # set at run time
    label = " ".join(filter(None, [job.stage, job.case.id, job.view_name]))
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format=f"{label}: %(message)s", force=True)
    logging.getLogger("numba").setLevel(logging.WARNING)


def parser(stage: str, description: str | None, per_view: bool = True) -> argparse.ArgumentParser:
    """Command line of a stage: repository, case, view (for stages that are run per view) and threads."""
    parser = argparse.ArgumentParser(prog=stage, description=description)
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("case", help="case id from cases.csv")
    if per_view:
        parser.add_argument("view", help="name of the view")
    parser.add_argument("--threads", type=int, default=1, help="number of threads; results do not depend on it")
    return parser
