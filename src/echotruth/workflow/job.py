"""A job: one script's work on one heart, or one heart and view, and its record in the ledger."""

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

from echotruth.cases import Case, find, generator
from echotruth.config import View
from echotruth.config.loading import load
from echotruth.heart import Heart
from echotruth.repository import ledger, schema
from echotruth.repository.ledger import GATES, record_path
from echotruth.repository.provenance import code_version
from echotruth.repository.store import NotWritten, Store, Values
from echotruth.workflow.compiled import share
from echotruth.workflow.cost import Cost

Result = dict[str, Values]
log = logging.getLogger("echotruth")


class CannotBeMade(ValueError):
    """A heart that has no solution: it is recorded and left out, and the other hearts go on."""


class Job:
    """Where a script finds its inputs and puts its results.

    Parameters
    ----------
    folder : Path
        Of the repository, `out/NAME`.
    stage : str
        Name of the stage.
    case : str
        Case id.
    view : str, optional
        Name of the view, for stages that work on one.
    script : str, optional
        Path of the script of the stage (default: the one that runs).
    """

    def __init__(self, folder: Path, stage: str, case: str, view: str | None = None, script: str | None = None) -> None:
        self.folder, self.stage = folder, stage
        self._script = script or sys.argv[0]
        self.case: Case = find(load(folder / "config.yaml"), case)
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
    def place(self) -> tuple[int, ...]:
        """Row of the case, and index of the view where there is one."""
        views = list(self.case.config.views)
        return (self.row,) if self.view_name is None else (self.row, views.index(self.view_name))

    @property
    def scratch(self) -> Path:
        """Folder for what the stages of one view hand on without keeping it."""
        return self.folder / "scratch" / self.case.id / str(self.view_name)

    @property
    def unfinished(self) -> Path:
        """Folder for what a stopped run of this stage leaves to the next, until it is committed."""
        return self.folder / "scratch" / self.case.id / f"{self.stage}-{code_version(self._script)}"

    @property
    def record(self) -> Path:
        """Where this job's record stands."""
        return record_path(self.folder, self.stage, self.case.id, self.view_name)

    def read(self, group: str, *names: str) -> dict[str, Any]:
        """Arrays of a group for this case (and view)."""
        return self.store.read(group, *self.place, names=names or None)

    @property
    def heart(self) -> Heart:
        """The heart of this case, as the mechanics left it."""
        geometry, fibres, pathology, mechanics = (
            self.store.read(group, self.row) for group in ("geometry", "fibres", "pathology", "mechanics")
        )
        return Heart(
            nodes=geometry["node_position"],
            cells=geometry["cell_node"],
            displacement=mechanics["displacement"],
            wall_depth=fibres["wall_depth"],
            endo=geometry["endo"],
            layers=self.case.config.fibres.layers,
            es=int(mechanics["es_frame"]),
            region=pathology["region"],
        )

    def hand_on(self, **arrays: Any) -> None:
        """Leave arrays in the scratch folder for the next stage of this view."""
        self.scratch.mkdir(parents=True, exist_ok=True)
        np.savez(self.scratch / f"{self.stage}.npz", **arrays)

    def take(self, stage: str) -> dict[str, Any]:
        """Arrays an earlier stage of this view handed on."""
        path = self.scratch / f"{stage}.npz"
        if not path.is_file():
            raise NotWritten(f"{path}: is not there: run the stage {stage} first")
        with np.load(path) as file:
            return dict(file)

    def left_out(self) -> str:
        """Why this stage is not for this heart; empty where it is."""
        for gate in takewhile(lambda stage: stage != self.stage, GATES):
            path = record_path(self.folder, gate, self.case.id)
            record = ledger.read(path) if path.exists() else {"status": "complete"}
            passes = ("complete",) if self.case.config.physiology.exclude else ("complete", "implausible")
            if record["status"] not in passes:
                return record["reason"]
        return ""

    def mark(self, status: str, reason: str) -> None:
        """Let the record say, beside what is written, what is wrong with it."""
        self.verdict = {"status": status, "reason": reason}

    def commit(self, result: Result, cost: Cost) -> dict[str, float]:
        """Write the results and then the record that says so; what it has cost."""
        files: list[Path] = []
        for group, values in result.items():
            self.store.write(group, values, *self.place)
            files += self.store.files(group, *self.place)
        sha256 = ledger.checksums(files, self.store.path)
        spent = cost.spent()
        self._record(**self.verdict, **spent, frames=self.case.config.loop.frames, sha256=sha256)
        return spent

    def give_up(self, status: str, reason: str) -> None:
        """Record that there is no result, and why; one of an earlier run goes."""
        for group in schema.written_by(self.stage, self.case.config):
            for file in self.store.files(group, *self.place):
                file.unlink()
        self._record(status=status, reason=reason)

    def _record(self, **entries: Any) -> None:
        named = {"stage": self.stage, "case": self.case.id, "view": self.view_name, "seed": self.case.config.seed}
        ledger.commit(self.record, named | {"code": code_version(self._script)} | entries)
        rmtree(self.unfinished, ignore_errors=True)


Work = Callable[[Job], Result]


def main(stage: str, work: Work, description: str | None, per_view: bool = True) -> None:
    """Run the work of a script from its command line."""
    run(stage, work, parser(stage, description, per_view).parse_args(), Cost())


def run(stage: str, work: Work, arguments: argparse.Namespace, cost: Cost) -> None:
    """Do the work of a stage and record what came of it.

    Parameters
    ----------
    stage : str
    work : callable
        From the job to its arrays, by group.
    arguments : Namespace
        As of :func:`parser`.
    cost : Cost
        Of this process.
    """
    job = _open(stage, getfile(work), arguments)
    _prepare(job, arguments.threads)
    if reason := job.left_out():
        log.warning("skipped: %s", reason)
        job.give_up("skipped", reason)
        return
    cost.begin()
    try:
        result = _single_blas(work, job)
    except NotWritten as error:
        sys.exit(f"{stage}: {error}")
    except CannotBeMade as error:
        log.warning("gives up: %s", error)
        job.give_up("failed", str(error))
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


def _single_blas(work: Work, job: Job) -> Result:
    """BLAS on one thread: its sums depend on how many there are, and the bytes must not."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        return work(job)


def _prepare(job: Job, threads: int) -> None:
    import numba

    share()
    numba.set_num_threads(max(1, min(threads, numba.config.NUMBA_NUM_THREADS)))
    place = " ".join(filter(None, [job.stage, job.case.id, job.view_name]))
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format=f"{place}: %(message)s", force=True)
    logging.getLogger("numba").setLevel(logging.WARNING)


def parser(stage: str, description: str | None, per_view: bool = True) -> argparse.ArgumentParser:
    """Command line of a stage: repository, case, view where there is one, threads."""
    parser = argparse.ArgumentParser(prog=stage, description=description)
    parser.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
    parser.add_argument("case", help="case id, as in cases.csv")
    if per_view:
        parser.add_argument("view", help="name of the view")
    parser.add_argument("--threads", type=int, default=1, help="threads to use; the results do not depend on it")
    return parser
