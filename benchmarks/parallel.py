"""The same work on many clips, in several processes."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import TypeVar

from echotruth.evaluation.tracker_options import EvaluationError

Item = TypeVar("Item")
Result = TypeVar("Result")

ENDED = "a process ended without an error, as when memory is short: try --jobs 1"
"""What is said of a process that ends without an exception, unless something else is."""


def in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], jobs: int, ended: str = ENDED
) -> Iterator[Result]:
    """Apply a function to items, in their order for any number of processes.

    Parameters
    ----------
    function : callable
        Of one item; it, the item and what it returns can be sent to another process.
    items : sequence
    jobs : int
        Number of processes; with 1, this one.
    ended : str
        What to say if a process ends without an exception.

    Raises
    ------
    EvaluationError
        If `jobs` is less than 1, or a process ends without an exception.
    """
    if jobs < 1:
        raise EvaluationError(f"--jobs {jobs}: must be 1 or more")
    if jobs == 1:
        yield from map(function, items)
        return
    threads = max(1, (os.cpu_count() or 1) // jobs)
    with ProcessPoolExecutor(jobs, get_context("spawn"), _limit_threads, (threads,)) as pool:
        try:
            yield from pool.map(function, items)
        except BrokenProcessPool:
            raise EvaluationError(ended) from None
        finally:
            pool.shutdown(cancel_futures=True)


def _limit_threads(threads: int) -> None:
    """Limit the threads of Numba, which asks for them when a tracker imports it."""
    os.environ["NUMBA_NUM_THREADS"] = str(min(threads, int(os.environ.get("NUMBA_NUM_THREADS", threads))))
