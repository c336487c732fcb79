"""Loops that threads share.

Compiled loops let go of Python's lock, so that threads of Python run them side by side. Numba's own parallel loops take
two to three times as long to compile.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise

from numba import get_num_threads


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
    threads = get_num_threads()
    parts = min(threads, count)
    if parts < 2:
        loop((0, count))
        return
    bounds = [count * part // parts for part in range(parts + 1)]
    list(_pool(threads).map(loop, pairwise(bounds)))


@lru_cache(maxsize=1)
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="echotruth")


# Threads do not live on in a forked process.
os.register_at_fork(after_in_child=_pool.cache_clear)
