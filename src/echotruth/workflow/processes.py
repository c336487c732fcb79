"""What the processes of all jobs have in common: beginning of their shell commands, and cache of compiled functions."""

import fcntl
import os
import sys
from hashlib import sha256
from pathlib import Path
from shlex import quote
from typing import Any

from echotruth.repository.version import PACKAGE
from echotruth.workflow import instructions


def prefix(root: Path) -> str:
    """Beginning of the shell commands of all rules.

    Parameters
    ----------
    root : Path
        Folder of the Snakefile: a checkout, whose package is used whatever is installed, or the installed package.
    """
    variables = {
        "SCRIPTS": str(root / "workflow/scripts"),
        "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}",  # the Python of this process comes first
        "NUMBA_CACHE_DIR": str(Path(".snakemake/numba", cache_name()).absolute()),
    }
    forbidden = ""
    if os.environ.get("PYTHONDONTWRITEBYTECODE"):
        # A process compiles what it imports for longer than most jobs take: it does so once, in a folder of its own.
        forbidden = "unset PYTHONDONTWRITEBYTECODE; "
        variables["PYTHONPYCACHEPREFIX"] = str(Path(".snakemake/pycache").absolute())
    if (root / "src").is_dir():
        variables["PYTHONPATH"] = f"{root / 'src'}:{os.environ.get('PYTHONPATH', '')}".rstrip(":")
    exports = " ".join(f"{name}={quote(value)}" for name, value in variables.items())
    commands = f"set -euo pipefail; {forbidden}{instructions.exports()}export {exports}; "
    return commands.replace("{", "{{").replace("}", "}}")


def cache_name() -> str:
    """Name of the folder of compiled functions.

    Numba checks only the file of a cached function for changes, not those of the functions that it calls. Therefore
    each version of the code has a cache of its own.
    """
    digest = sha256()
    for file in sorted(PACKAGE.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


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
