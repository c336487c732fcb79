"""Versions of the code, settings and packages from which a result was made."""

import ast
import json
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from echotruth.section import Section

PACKAGE = Path(__file__).parents[1]
"""Folder of echotruth."""

PACKAGES = (
    "echotruth",
    "numpy",
    "scipy",
    "numba",
    "scikit-image",
    "pypardiso",
    "mkl",
    "meshio",
    "vtk",
    "xarray",
    "zarr",
)
"""Packages whose version may affect the numbers, besides OpenCV, which is installed under several names."""

_EXCLUDED = ("echotruth.config", "echotruth.cases", "echotruth.repository", "echotruth.workflow")
"""Modules that pass on settings and results without affecting them: a change of these reruns nothing."""


@cache
def code_version(*modules: str, unless: frozenset[tuple[str, str]] = frozenset()) -> str:
    """Hash of the parsed source of modules and of all modules of echotruth that they import.

    It does not depend on comments, layout and docstrings.

    Parameters
    ----------
    *modules : str
        Names such as "echotruth.mechanics", or paths of scripts.
    unless : frozenset of (str, str), optional
        Imports that are not followed: the module that imports, and the one that is imported.
    """
    digest = sha256()
    for name in sorted(_dependencies(modules, unless)):
        digest.update(_source(name).digest.encode())
    return digest.hexdigest()[:16]


def settings_version(*settings: Any) -> str:
    """Hash of settings: sections or plain values. Their order counts, as that of the trackers is that of the arrays."""
    texts = (json.dumps(item.model_dump(mode="json") if isinstance(item, Section) else item) for item in settings)
    return sha256("\n".join(texts).encode()).hexdigest()[:16]


def packages() -> dict[str, str]:
    """Versions of echotruth and of the packages that may affect the numbers, by name."""
    versions: dict[str, str] = {}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    with suppress(ImportError):  # some distributions of OpenCV carry no metadata: ask the module itself
        import cv2

        versions["opencv"] = cv2.__version__
    return versions


def _dependencies(modules: tuple[str, ...], unless: frozenset[tuple[str, str]] = frozenset()) -> set[str]:
    """The modules and all modules of echotruth that they import, directly or not."""
    visited: set[str] = set()
    pending = list(modules)
    while pending:
        name = pending.pop()
        if name not in visited and not name.startswith(_EXCLUDED):
            visited.add(name)
            pending.extend(imported for imported in _imports(name) if (name, imported) not in unless)
    return visited


def _imports(importer: str) -> list[str]:
    """Modules of echotruth, and their packages, that a module imports anywhere in its source."""
    names = set(_source(importer).imports)
    if "pkgutil" in names and (path := _path(importer)):  # a package that imports all modules of its folder
        names |= {f"{importer}.{file.stem}" for file in path.parent.glob("*.py")} - {f"{importer}.__init__"}
    return sorted(name for name in names if name.startswith("echotruth.") and name != importer and _path(name))


@cache
def _path(name: str) -> Path | None:
    """File of a script or of a module of echotruth, without importing it."""
    if name.endswith(".py"):
        return Path(name)
    path = PACKAGE.joinpath(*name.split(".")[1:])
    files = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in files if file.is_file()), None)


class _Source(NamedTuple):
    """What is to be known of a source file."""

    digest: str
    """Hash of its statements, without docstrings."""
    imports: list[str]
    """Modules of echotruth that it imports, and pkgutil."""


@cache
def _source(name: str) -> _Source:
    path = _path(name)
    return _parse(path.read_bytes() if path else b"")


def _parse(text: bytes) -> _Source:
    tree = ast.parse(text)
    imports: set[str] = set()
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            imports |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imports |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    ours = sorted(name for name in imports if name == "pkgutil" or name.startswith("echotruth."))
    return _Source(sha256(_canonical(_without_docstrings(tree)).encode()).hexdigest(), ours)


def _canonical(tree: ast.AST) -> str:
    """Syntax tree as text, without positions and empty fields, so that it is the same in all versions of Python.

    Each node is followed by its fields, and a list by its length and its items.
    """
    text: list[str] = []
    pending: list[Any] = [tree]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.AST):
            fields = [(name, value) for name in node._fields if (value := getattr(node, name, None)) not in (None, [])]
            text.append(f"{type(node).__name__}({' '.join(name for name, _ in fields)})")
            pending.extend(value for _, value in reversed(fields))
        elif isinstance(node, list):
            text.append(f"[{len(node)}]")
            pending.extend(reversed(node))
        else:
            text.append(repr(node))
    return "\n".join(text)


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in [tree, *_statements(tree)]:
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [line for line in node.body if not _is_docstring(line)]
    return tree


def _statements(node: ast.AST) -> Iterator[Any]:
    """All statements in a node at any depth; expressions, most of a tree, are skipped."""
    for block in ("body", "orelse", "finalbody", "handlers", "cases"):
        for statement in getattr(node, block, ()):
            yield statement
            yield from _statements(statement)


def _is_docstring(line: ast.stmt) -> bool:
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
