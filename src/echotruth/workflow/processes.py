"""What the processes of all jobs have in common: beginning of their shell commands, and cache of compiled functions."""

import fcntl
import os
import sys
from pathlib import Path
from shlex import quote
from typing import Any

from echotruth.config import shipped
from echotruth.repository.provenance import code_version
from echotruth.workflow import instructions

SCRIPTS_THAT_COMPILE = ("mechanics", "phantom", "rf", "truth", "bmode", "tracking", "inference", "report")
"""Scripts that call compiled functions."""


def prefix(folder: Path) -> str:
    """Beginning of the shell commands of all rules, given the folder of the repository, `out/NAME`."""
    variables = {
        "SCRIPTS": str(shipped.ROOT / "workflow/scripts"),
        "REPOSITORY": str(folder),
        "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}",  # the Python of this process comes first
        "NUMBA_CACHE_DIR": str(Path(".snakemake/numba", cache_name()).absolute()),
    }
    exports = " ".join(f"{name}={quote(value)}" for name, value in variables.items())
    return f"set -euo pipefail; {instructions.exports()}export {exports}; "


def cache_name() -> str:
    """Name of the folder of compiled functions.

    Numba checks only the file of a cached function for changes, not those of the functions that it calls. Therefore
    each version of the code has a cache of its own.
    """
    return code_version(*map(script, SCRIPTS_THAT_COMPILE))


def script(stage: str) -> str:
    """Path of the script of a stage."""
    return str(shipped.ROOT / f"workflow/scripts/{stage}.py")


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
