"""Job: the work of one stage on one heart (and view), and its record in the ledger."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Callable, Mapping
from inspect import getfile
from itertools import takewhile
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
import zarr
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from echotruth.cases import Case, find_case
from echotruth.config import View
from echotruth.config.loading import load
from echotruth.heart import Heart
from echotruth.repository import ledger, packing, schema
from echotruth.repository.checksums import ChecksumError, checksums, verify
from echotruth.repository.ledger import GATES, record_path
from echotruth.repository.provenance import code_version, settings_version
from echotruth.repository.store import NotWritten, Store, packs_of, schema_of
from echotruth.seeds import generator
from echotruth.workflow import instructions, lease
from echotruth.workflow.assignment import add_options, handed_case
from echotruth.workflow.checkpoint import Checkpoints
from echotruth.workflow.compiled import lock_cache_writes
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.settings import mechanics_settings, stage_settings
from echotruth.workflow.stage_cost import Cost

Result = Mapping[str, Mapping[str, ArrayLike]]
"""Arrays by group."""
TAKEN_UP = ("mechanics", "phantom", "truth", "rf", "bmode")
"""Stages whose result is taken up if it stands already. Physiology and evaluation are made within a second, and
tracking takes up the results of single trackers itself."""
log = logging.getLogger("echotruth")


class Job:
    """Inputs, results and record of one stage for one case (and view).

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    stage : str
        Name of the stage.
    case : str or Case
        The case, or the id by which it is looked up in the configuration of the repository.
    view : str, optional
        Name of the view, for stages that are run per view.
    code : str, optional
        Version of the code of the stage (default: that of the running script).

    Attributes
    ----------
    verdict : dict
        Status of the record, and what else the stage writes to it.
    ahead : Path or None
        Folder for the record if this stage is carried out before its rule asks for it; the rule moves it to the ledger.
    """

    def __init__(
        self, folder: Path, stage: str, case: str | Case, view: str | None = None, code: str | None = None
    ) -> None:
        self.folder, self.stage = folder, stage
        self.case = find_case(load(folder / "config.yaml"), case) if isinstance(case, str) else case
        self.code = code or code_version(sys.argv[0])
        self.view_name = view
        self.verdict: dict[str, Any] = {"status": "complete"}
        self.ahead: Path | None = None
        self._notes: dict[str, Any] = {}
        self.store = Store(folder / f"{self.case.config.name}.zarr")
        self.row = ledger.rows(folder / "registry.txt")[self.case.id]

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
        """Row of the case, and index of the view if there is one: their places in the store, which never change."""
        if self.view_name is None:
            return (self.row,)
        return self.row, ledger.rows(self.folder / "views.txt")[self.view_name]

    @property
    def scratch(self) -> Path:
        """Folder for what the stages of a heart, or of one of its views, remember and pass to each other."""
        return self.folder / "scratch" / self.case.id / (self.view_name or "")

    @property
    def checkpoints(self) -> Checkpoints:
        """Checkpoints of the heart, or of the view."""
        return Checkpoints(self.scratch / "checkpoint.json")

    @property
    def checkpoint_folder(self) -> Path:
        """Folder in which this stage saves its progress until it is committed, so that a stopped run can continue."""
        return self.folder / "scratch" / self.case.id / f"{self.stage}-{self.code}"

    @property
    def record(self) -> Path:
        """Path of the record of this job."""
        return self.ahead / f"{self.stage}.json" if self.ahead else self._entry

    @property
    def _entry(self) -> Path:
        """Place of the record in the ledger."""
        return record_path(self.folder, self.stage, self.case.id, self.view_name)

    @property
    def fingerprint(self) -> str:
        """Hash of the place of this stage's result and of what it is made from: code, settings, files of the heart."""
        if self.view_name is None:
            return settings_version(self.code, self.index, mechanics_settings(self.case.config))
        path = record_path(self.folder, "mechanics", self.case.id)
        motion = ledger.read(path).get("sha256", {}) if path.is_file() else {}
        settings = stage_settings(self.stage, self.case.config, self.view_name, motion)
        return settings_version(self.code, self.index, settings)

    def read(self, group: str, *names: str) -> dict[str, Any]:
        """Arrays of a group for this case (and view)."""
        return self.store.read(group, *self.index, names=names or None)

    def coordinates(self, group: str, *names: str) -> dict[str, Any]:
        """Coordinates of a group, which all cases share."""
        return {name: np.asarray(zarr.open_array(self.store.path / group / name, mode="r")[...]) for name in names}

    @property
    def heart(self) -> Heart:
        """Solved heart of this case."""
        groups = ("geometry", "fibres", "pathology", "mechanics")
        return Heart.of({group: self.store.read(group, self.row) for group in groups}, self.case.config)

    def save_scratch(self, **arrays: Any) -> None:
        """Save arrays for the next stage of this view."""
        self.checkpoints.drop(self.stage)  # it was made beside other arrays
        self.scratch.mkdir(parents=True, exist_ok=True)
        draft = self.scratch / f".{self.stage}.partial.npz"
        np.savez(draft, **arrays)
        draft.replace(self.scratch / f"{self.stage}.npz")

    def has_scratch(self, stage: str) -> bool:
        """Whether the arrays that an earlier stage of this view saved are still there."""
        return (self.scratch / f"{stage}.npz").is_file()

    def clear_scratch(self) -> None:
        """Delete the arrays that the stages of this view passed to each other; checkpoints stay."""
        for path in self.scratch.glob("*.npz"):
            path.unlink()

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
            accepted = ledger.imaged_statuses(self.case.config.physiology.exclude_implausible)
            if record["status"] not in accepted:
                return record["reason"]
        return ""

    def set_verdict(self, status: str, reason: str) -> None:
        """Set the status of the record of a job that has a result, and its reason."""
        self.verdict = {"status": status, "reason": reason}

    def commit(self, result: Result, cost: Cost) -> dict[str, float]:
        """Write the result, then the record; return the cost."""
        self.withdraw()
        files: list[Path] = []
        for group, values in result.items():
            # Coordinates, such as the times of a motion, belong to no job: they stand since the arrays were laid out.
            stored = packing.pack(packs_of(group), values)
            own = {array.name for array in schema_of(group)} & stored.keys()
            for file in self.store.files(group, *self.index):
                # Zarr would read a damaged shard before it replaces all of its chunks.
                if file.relative_to(self.store.path / group).parts[0] in own:
                    file.unlink()
            self.store.write(group, {name: stored[name] for name in own}, *self.index)
            files += self.store.files(group, *self.index)
        sha256 = checksums(files, self.store.path)
        spent = cost.stop()
        self._commit(self._record(**self.verdict, **spent, frames=self.case.config.loop.frames, sha256=sha256))
        return spent

    def remember(self, **notes: Any) -> None:
        """Keep notes for the next run of this stage, in its checkpoint; they are saved with the result."""
        self._notes |= notes

    def stands(self) -> bool:
        """Whether an earlier run made this stage's result from the same, and all its files are whole."""
        entry = self.checkpoints.entry(self.stage)
        if self.stage not in TAKEN_UP or entry.get("fingerprint") != self.fingerprint:
            return False
        try:
            verify(self.store.path, self.record, entry["record"])
        except ChecksumError:
            return False
        return True

    def take_up(self) -> None:
        """Commit the record of the earlier run again."""
        lease.confirm()
        ledger.commit(self.record, self.checkpoints.entry(self.stage)["record"])

    def withdraw(self) -> None:
        """Withdraw the record of an earlier run, because the files for which it vouches are about to change."""
        self._entry.unlink(missing_ok=True)

    def record_without_result(self, status: str, reason: str) -> None:
        """Record that there is no result, and why; delete the result of an earlier run."""
        self.withdraw()
        for group in schema.written_by(self.stage, self.case.config):
            for file in self.store.files(group, *self.index):
                file.unlink()
        self._commit(self._record(**self.verdict | {"status": status, "reason": reason}))

    def _record(self, **entries: Any) -> dict[str, Any]:
        job = {"stage": self.stage, "case": self.case.id, "view": self.view_name, "seed": self.case.config.seed}
        return job | {"code": self.code, "instructions": instructions.kind()} | entries

    def _commit(self, record: dict[str, Any]) -> None:
        """Commit the record: that of a result first where the next run looks for it, then in the ledger."""
        lease.confirm()
        if "sha256" in record and (self.stage in TAKEN_UP or self._notes):
            fingerprint = self.fingerprint if self.stage in TAKEN_UP else ""
            self.checkpoints.save(self.stage, fingerprint=fingerprint, record=record, **self._notes)
        ledger.commit(self.record, record)
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
    job = open_job(stage, getfile(work), arguments)
    if not skipped(job):
        carry_out(job, work, cost)


def skipped(job: Job) -> bool:
    """Whether a stage is not to be run for this heart; the record says why."""
    reason = job.skip_reason()
    if reason:
        log.warning("skipped: %s", reason)
        job.record_without_result("skipped", reason)
    return bool(reason)


def carry_out(job: Job, work: Work, cost: Cost) -> None:
    """Do the work of a job and record its result, or that the heart has none."""
    cost.start()
    try:
        # The rounding of BLAS sums depends on the number of threads, but results must not.
        with threadpool_limits(1):
            result = work(job)
    except (NotWritten, ChecksumError) as error:
        sys.exit(f"{job.stage}: {error}")
    except CaseFailed as error:
        log.warning("failed: %s", error)
        job.record_without_result("failed", str(error))
        return
    log.info("done in %.1f s", job.commit(result, cost)["seconds"])


def open_job(stage: str, script: str, arguments: argparse.Namespace) -> Job:
    """Job of a stage, given its script and the arguments of a command line, and its name in the log.

    Anything that is wrong with the arguments ends the process with a sentence.
    """
    view, case = getattr(arguments, "view", None), arguments.case
    try:
        lease.follow(arguments.repository)
        if arguments.config is not None:
            case = handed_case(case, arguments.config, arguments.parameters)
        job = Job(arguments.repository, stage, case, view, arguments.code.get(stage) or code_version(script))
    except (ValueError, lease.LeaseError) as error:
        sys.exit(f"{stage}: {error}")
    if view is not None and view not in job.case.config.views:
        sys.exit(f"{stage}: {view} is not a view of {arguments.repository}: use {', '.join(job.case.config.views)}")
    prepare(job, arguments.threads)
    return job


def prepare(job: Job, threads: int) -> None:
    """Give the log the name of a job, and its number of threads to numba."""
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
    add_options(parser)
    return parser
