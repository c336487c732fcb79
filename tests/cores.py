"""What the processes of the tests share: the cores, and what is compiled. To be imported before numpy and numba."""

import fcntl
import os
from pathlib import Path

from echotruth.provenance import code_version

ROOT = Path(__file__).parents[1]
# A compiled function is cached by the file it stands in, not by those it calls from: one cache a version of the code.
CACHE = ROOT / ".snakemake/numba" / code_version(*map(str, (ROOT / "workflow/scripts").glob("*.py")))
os.environ["NUMBA_CACHE_DIR"] = str(CACHE)
# Threads of BLAS that wait for a core that is taken spin: a decomposition of a matrix then costs twenty times its work.
os.environ["OPENBLAS_NUM_THREADS"] = "1"


def one_at_a_time(save):
    """Two processes that save two forms of a function at once would give both the same number."""

    def locked(*given):
        CACHE.mkdir(parents=True, exist_ok=True)
        with (CACHE / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            save(*given)

    return locked


def share():
    from numba.core.caching import IndexDataCacheFile

    IndexDataCacheFile.save = one_at_a_time(IndexDataCacheFile.save)


share()
