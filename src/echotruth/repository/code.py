"""The code that a stage uses: its script, the modules of the package that it imports, and those that they import.

Modules that pass numbers on do not count, as the numbers themselves do: those of the configuration, of the cases, of
the workflow and of the repository, but for the rounding of what is stored.
"""

import re
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from pathlib import Path

from echotruth.config import shipped

PACKAGE = Path(__file__).parents[1]
"""Folder of echotruth."""

PASSING = tuple(f"echotruth.{name}" for name in ("cases", "config", "extras", "files", "repository", "workflow"))
"""Modules and packages that pass numbers on."""

COUNTED = ("repository/rounding.py", "repository/arrays.csv", "units.py")
"""What counts for every stage, imported or not: the quanta of what is stored, and the units of the configuration."""

_COMPILED = re.compile(
    r"^[ \t]*@(?:numba\.)?(?:n?jit|(?:gu)?vectorize|stencil|intrinsic|register_jitable|overload)\b|\bcfunc\(",
    re.MULTILINE,
)
"""How a function is given to Numba."""

_FOR_TYPES = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+", re.MULTILINE)
_IMPORT = re.compile(
    r"^[ \t]*(?:from (echotruth[\w.]*) import (\([^)]*\)|[^\n#]*)|import (echotruth[\w.]*))", re.MULTILINE
)


def code_hash(stage: str, besides: Iterable[str] = (), without: Iterable[str] = ()) -> str:
    """Hash of the code that a stage uses.

    Parameters
    ----------
    stage : str
    besides : iterable of str
        Modules that it imports by a name which the configuration gives, as `echotruth.materials.fung`.
    without : iterable of str
        Modules and packages that are imported only with other settings.

    Returns
    -------
    str of 16 hexadecimal digits
    """
    return _hash(stage, tuple(sorted(besides)), tuple(sorted(without)))


@cache
def _hash(stage: str, besides: tuple[str, ...], without: tuple[str, ...]) -> str:
    digest = sha256()
    for file in files_of(stage, besides, without):
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()[:16]


def files_of(stage: str, besides: Iterable[str] = (), without: Iterable[str] = ()) -> list[Path]:
    """Files that a stage uses, in the order of their paths; the parameters are those of :func:`code_hash`."""
    script = shipped.ROOT / f"workflow/scripts/{stage}.py"
    found = {script, *(PACKAGE / name for name in COUNTED)} | reached([script, *map(_file, besides)], without)
    return sorted(found.union(*map(data_of, found)))


def compiled_files() -> list[Path]:
    """Files with functions that Numba compiles, and those that these import, in the order of their paths."""
    laws = PACKAGE.glob("materials/*.py")  # the package materials imports and compiles them by name
    holders = (file for file in PACKAGE.rglob("*.py") if _COMPILED.search(file.read_text(encoding="utf-8")))
    return sorted(reached([*laws, *holders]))


@cache
def data_of(file: Path) -> set[Path]:
    """Files beside a module that are no modules, and which it names or which have its name."""
    text, others = file.read_text(encoding="utf-8"), (path for path in file.parent.iterdir() if path.is_file())
    return {path for path in others if path.suffix != ".py" and (path.stem == file.stem or path.name in text)}


def reached(files: Iterable[Path | None], without: Iterable[str] = ()) -> set[Path]:
    """Files of the package that some files import, wherever in them, and those that these import in turn."""
    waiting, found = [file for file in files if file], set()
    left_out = (*PASSING, *without)
    while waiting:
        for module in imported(waiting.pop()):
            file = None if any(f"{module}.".startswith(f"{name}.") for name in left_out) else _file(module)
            if file and file not in found:
                found.add(file)
                waiting.append(file)
    return found | {file for file in files if file}


@cache
def imported(file: Path) -> list[str]:
    """Names that a file imports from the package, which may be those of modules; not those for type checkers alone."""
    names = []
    for module, members, alone in _IMPORT.findall(_FOR_TYPES.sub("", file.read_text(encoding="utf-8"))):
        names += [module or alone, *(f"{module}.{name}" for name in re.findall(r"(\w+)(?: as \w+)?", members))]
    return names


@cache
def _file(module: str) -> Path | None:
    """File of a module of the package; none if it is the name of something else."""
    path = PACKAGE.parent / Path(*module.split("."))
    files = (path / "__init__.py", path.with_suffix(".py"))
    return next((file for file in files if file.is_file()), None)
