"""Work that threads share: as many as numba uses, one in a job of one core.

Compiled loops let go of Python's lock, so that threads of Python run them side by side. Numba's own parallel loops take
two to three times as long to compile.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import TypeVar

from numba import get_num_threads

Item = TypeVar("Item")
Found = TypeVar("Found")


def share(loop: Callable[[tuple[int, int]], object], count: int) -> None:
    """Share the turns of a loop out among as many threads as numba uses.

    Parameters
    ----------
    loop : callable
        Compiled with `nogil`; carries out the turns from the first of its argument to the one before the second. No
        turn may depend on another; then the result does not depend on the number of threads.
    count : int
        Number of turns.
    """
    parts = max(1, min(get_num_threads(), count))
    bounds = [count * part // parts for part in range(parts + 1)]
    each(loop, list(pairwise(bounds)))


def each(function: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """Results of a function for each of some items, in their order, from as many threads as numba uses.

    Parameters
    ----------
    function : callable
        Does not share work itself: it would wait for the threads that wait for it.
    items : sequence
    """
    threads = get_num_threads()
    if min(threads, len(items)) < 2:
        return [function(item) for item in items]
    return list(_pool(threads).map(function, items))


@lru_cache(maxsize=1)
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="echotruth")


# Threads do not live on in a forked process.
os.register_at_fork(after_in_child=_pool.cache_clear)
