"""Plan a large sweep in less time and memory: what Snakemake makes for every job anew is made once, or not at all.

Nothing of this is part of Snakemake's interface: a version that has changed it plans as it does without.
"""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import Coroutine, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache
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


def hasten(rules: Iterable[Rule]) -> None:
    """Remember the parameters of all functions in rules, for which Snakemake asks several times a job, and save memory.

    Parameters
    ----------
    rules : iterable of Rule
        All rules of a workflow, once they are defined.
    """
    gc.freeze()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS, 20, 100)
    with suppress(ImportError, AttributeError):
        from snakemake import iocontainers
        from snakemake.io import IOCache

        # Each list of files, params or wildcards has two of these, which do nothing but refuse to be called.
        iocontainers.AttributeGuard.__new__ = cache(lambda guard, name: object.__new__(guard))
        iocontainers.AttributeGuard.__reduce__ = lambda self: (type(self), (self.name,))
        # A dry run saves what it knows of all files, which later runs do not trust: an empty copy will do.
        IOCache._simple_copy = lambda self: type(self)(self.max_wait_time)
    with suppress(ImportError, AttributeError):
        from snakemake import dag

        # It would make a task for every job at once, to ask for the times of its files.
        dag.asyncio = SimpleNamespace(**vars(asyncio) | {"TaskGroup": SmallTaskGroup})
    with suppress(ImportError, AttributeError):
        from snakemake.common import overwrite_function_params
        from snakemake.resources import Resource

        functions = [Resource.evaluate, *(function for rule in rules for function in _functions(rule))]
        for function in functions:
            overwrite_function_params(function, signature(function).parameters)


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
