"""What the processes of all jobs have in common: beginning of their shell commands, and cache of compiled functions."""

import fcntl
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib.metadata import distributions
from pathlib import Path
from shlex import quote
from typing import Any

from echotruth.files import private, temporary, user_cache
from echotruth.repository.code import compiled_files
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
        "NUMBA_CACHE_DIR": str(cache()),
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


def cache() -> Path:
    """Folder of compiled functions, in which nobody else can write, as what is read there is executed.

    It is in the user's cache; or in the working folder; or, where that is another user's, one of this process alone.
    """
    home = user_cache() or private(Path(".snakemake/numba").absolute()) or temporary()
    return home / cache_name()


def cache_name() -> str:
    """Name of the folder of compiled functions.

    Numba checks only the file of a cached function for changes, not those of the functions that it calls. Therefore
    each version of what is compiled, and of its compiler, has a cache of its own.
    """
    compilers = [one.version for one in distributions(name="numba")]  # none where echotruth only reads and scores
    digest = sha256(f"{sys.implementation.cache_tag} {compilers}".encode())
    for file in compiled_files():
        digest.update(file.name.encode() + file.read_bytes())
    return f"numba-{digest.hexdigest()[:16]}"


def guard_cache() -> None:
    """Make Numba lock a cache while it writes to it, so that processes can share it, and pass over what is damaged.

    Numba numbers the specialisations of a function as it saves them. Two processes that save at the same time would use
    the same number, and one specialisation would load the code of the other.
    """
    from numba.core.caching import IndexDataCacheFile

    cache: Any = IndexDataCacheFile
    load, save = cache.load, cache.save
    if save.__name__ == "locked_save":
        return

    def locked_save(self, *arguments):
        with _locked(self):
            save(self, *arguments)

    def checked_load(self, key):
        with suppress(Exception):  # whatever pickle makes of damaged bytes
            return load(self, key)
        with _locked(self):
            try:
                return load(self, key)
            except Exception:
                Path(self._index_path).unlink(missing_ok=True)
                return None

    cache.load, cache.save = checked_load, locked_save


@contextmanager
def _locked(cache: Any) -> Iterator[None]:
    folder = Path(cache._cache_path)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
