"""Plan a large sweep, and schedule its jobs, in less time and memory: what Snakemake makes for every job is made once.

Nothing of this is part of Snakemake's interface: a version that has changed it plans as it does without.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import threading
from collections.abc import Collection, Coroutine, Iterator, Sequence
from contextlib import suppress
from functools import cache, partial
from inspect import signature
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from snakemake.rules import Rule
    from snakemake.settings.types import Batch

logger = logging.getLogger("echotruth")

OBJECTS_BETWEEN_COLLECTIONS = 200_000
"""Objects made before Python looks for garbage. A plan only grows, and each search goes over all of it."""


def hasten(rules: Collection[Rule]) -> None:
    """Let Snakemake plan and schedule in less time and memory; what this version of it does not have stays as it is.

    Parameters
    ----------
    rules : collection of Rule
        All rules of a workflow, once they are defined.
    """
    gc.freeze()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS, 20, 100)
    changes = (
        _share_guards,
        _save_no_file_cache,
        _run_tasks_in_small_groups,
        _wait_with_one_timer,
        partial(_keep_parameters, rules),
        partial(_compare_no_files, rules),
    )
    for change in changes:
        with suppress(ImportError, AttributeError):
            change()


def _share_guards() -> None:
    """Let all lists share what each list of files, params or wildcards holds of its own: who may not be called."""
    from snakemake.iocontainers import AttributeGuard, Namedlist

    AttributeGuard.__new__ = cache(lambda guard, name: object.__new__(guard))
    AttributeGuard.__reduce__ = lambda self: (type(self), (self.name,))
    allowed = list(Namedlist()._allowed_overrides)
    Namedlist._allowed_overrides = property(lambda self: allowed, lambda self, names: None)


def _save_no_file_cache() -> None:
    """Let a dry run save an empty copy of what it knows of all files, which later runs do not trust."""
    from snakemake.io import IOCache

    IOCache._simple_copy = lambda self: type(self)(self.max_wait_time)


def _run_tasks_in_small_groups() -> None:
    """Let Snakemake not make a task for every job at once, to ask for the times of its files."""
    from snakemake import dag

    dag.asyncio = SimpleNamespace(**vars(asyncio) | {"TaskGroup": SmallTaskGroup})


def _wait_with_one_timer() -> None:
    """Let the scheduler look for jobs once a second; it would do so once more a second for every job that has ended."""
    from snakemake.scheduling.job_scheduler import JobScheduler

    def look_again(scheduler: Any, delay: float) -> None:
        if vars(scheduler).get("is_waiting"):
            return

        def look() -> None:
            scheduler.is_waiting = False
            scheduler._open_jobs.release()

        scheduler.is_waiting = True
        threading.Timer(delay, look).start()

    JobScheduler._schedule_reevalutation = look_again


def _keep_parameters(rules: Collection[Rule]) -> None:
    """Remember the parameters of all functions in rules, for which Snakemake asks several times a job."""
    from snakemake.common import overwrite_function_params
    from snakemake.resources import Resource

    functions = [Resource.evaluate, *(function for rule in rules for function in _functions(rule))]
    for function in functions:
        overwrite_function_params(function, signature(function).parameters)


def _compare_no_files(rules: Collection[Rule]) -> None:
    """Do not look for files inside an output that is a directory, for which all paths are sorted, if there is none."""
    from snakemake.dag import DAG
    from snakemake.io import is_flagged

    if not any(is_flagged(path, "directory") for rule in rules for path in rule.output):
        DAG.check_directory_outputs = lambda self: None


class SmallTaskGroup:
    """Task group as that of asyncio, which makes its tasks when it ends, not more than some at a time.

    What :meth:`create_task` returns cannot be waited for: the end of the group waits for all.
    """

    SIZE = 1000
    """Largest number of tasks at a time."""

    async def __aenter__(self) -> SmallTaskGroup:
        self._waiting: list[Coroutine[Any, Any, Any]] = []
        return self

    def create_task(self, coroutine: Coroutine[Any, Any, Any]) -> None:
        """Run a coroutine before the group ends."""
        self._waiting.append(coroutine)

    async def __aexit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        try:
            while self._waiting and kind is None:
                some, self._waiting = self._waiting[: self.SIZE], self._waiting[self.SIZE :]
                async with asyncio.TaskGroup() as group:
                    for coroutine in some:
                        group.create_task(coroutine)
        finally:
            for coroutine in self._waiting:
                coroutine.close()


def in_batch(files: Sequence[Path], rule: str, batch: Batch | None) -> list[str]:
    """Files of the batch of a rule that is planned; all of them if none is, or the last, which looks for all others.

    Snakemake would make an object for each file before it chooses those of the batch.

    Parameters
    ----------
    files : sequence of Path
        All input files of the rule.
    rule : str
        Name of the rule.
    batch : Batch or None
        What the option `--batch` chooses.
    """
    paths = [path.as_posix() for path in files]
    if batch is None or batch.rulename != rule or batch.is_final or len(paths) < batch.batches:
        return paths
    chosen: list[str] = type(batch).get_batch(batch, paths)
    batch.get_batch = list  # type: ignore[method-assign]  # they are chosen already
    logger.info("Only batch %s is planned: run the others too, the last one last.", batch)
    return chosen


def _functions(rule: Rule) -> Iterator[Any]:
    """Functions from which the input, the params and the resources of a rule follow."""
    resources = [resource._evaluator for resource in rule.resources.values()]
    for item in (*rule.input, *rule.params, rule.group, *resources):
        function = getattr(getattr(item, "_file", item), "callable", item)
        if callable(function) and hasattr(function, "__code__"):
            yield function
