"""Caches of compiled functions on disk, one per group of stages and version of the code.

Numba checks only the file of the cached function for changes, not those of the functions that it calls. Therefore each
version of the code has a cache of its own.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import Any

from echotruth.repository.provenance import code_version

CACHE_GROUPS = {
    "mechanics": ("mechanics", "physiology"),
    "view": ("phantom", "truth", "rf", "bmode", "tracking", "evaluation"),
    "report": ("report",),
}
"""Stages that share a cache, because they run in the same jobs or call the same functions."""


def cache_folder(group: str, scripts: Path) -> str:
    """Name of the cache folder of a group of stages, given the folder of their scripts."""
    return f"{group}-{code_version(*(str(scripts / f'{stage}.py') for stage in CACHE_GROUPS[group]))}"


def lock_cache_writes() -> None:
    """Make Numba lock a cache while it writes to it, so that processes can share it.

    Numba numbers the specialisations of a function as it saves them. Two processes that save at the same time would use
    the same number, and one specialisation would load the code of the other.
    """
    from numba.core.caching import IndexDataCacheFile

    cache: Any = IndexDataCacheFile
    save = cache.save
    if save.__name__ == "locked_save":
        return

    def locked_save(self, *arguments):
        folder = Path(self._cache_path)
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            save(self, *arguments)

    cache.save = locked_save
