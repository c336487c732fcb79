"""Compiled functions on disk: one cache for each group of stages, which processes share.

A compiled function is cached by the file it stands in, not by those it calls from, so that there is one cache for each
version of the code.
"""

from __future__ import annotations

import fcntl
from pathlib import Path

from echotruth.repository.provenance import code_version

GROUPS = {
    "mechanics": ("mechanics", "physiology"),
    "imaging": ("phantom", "truth", "rf", "bmode"),
    "tracking": ("tracking", "evaluation"),
    "report": ("report",),
}
"""Stages that share a cache, for they are done by the same jobs or call the same functions."""


def folder(group: str, scripts: Path) -> str:
    """Name of the cache of a group, whose scripts are in a folder."""
    return f"{group}-{code_version(*(str(scripts / f'{stage}.py') for stage in GROUPS[group]))}"


def share() -> None:
    """Let this process and others that do the same write to one cache, one at a time.

    Numba numbers the forms of a function as it saves them: two that are saved at once would get the same number, and
    one of them the code of the other.
    """
    from numba.core.caching import IndexDataCacheFile as File

    if hasattr(File.save, "alone"):
        return
    save = File.save

    def locked(self, *given):
        place = Path(self._cache_path)
        place.mkdir(parents=True, exist_ok=True)
        with (place / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            save(self, *given)

    locked.alone = True
    File.save = locked
