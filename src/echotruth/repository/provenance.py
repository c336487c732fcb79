"""Versions of the code, settings and packages from which a result was made."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

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
def code_version(*modules: str) -> str:
    """Hash of the parsed source of modules and of all modules of echotruth that they import.

    It does not depend on comments, layout and docstrings.

    Parameters
    ----------
    *modules : str
        Names such as "echotruth.mechanics", or paths of scripts.
    """
    digest = sha256()
    for name in sorted(_dependencies(modules)):
        digest.update(_canonical_source(name))
    return digest.hexdigest()[:16]


def settings_version(*settings: Any) -> str:
    """Hash of settings: sections or plain values."""
    values = [item.model_dump(mode="json") if hasattr(item, "model_dump") else item for item in settings]
    return sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()[:16]


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


def _dependencies(modules: tuple[str, ...]) -> set[str]:
    """The modules and all modules of echotruth that they import, directly or not."""
    visited: set[str] = set()
    pending = list(modules)
    while pending:
        name = pending.pop()
        if name not in visited and not name.startswith(_EXCLUDED):
            visited.add(name)
            pending.extend(_imports(name))
    return visited


@cache
def _imports(importer: str) -> list[str]:
    """Modules of echotruth, and their packages, that a module imports anywhere in its source."""
    names: set[str] = set()
    for node in _statements(_tree(importer)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
            names |= _discovered(importer) if node.module == "pkgutil" else set()
    return sorted(name for name in names if name.startswith("echotruth.") and name != importer and _path(name))


def _discovered(package: str) -> set[str]:
    """Modules of a package that imports all modules of its folder."""
    path = _path(package)
    return {f"{package}.{file.stem}" for file in path.parent.glob("*.py")} - {f"{package}.__init__"} if path else set()


@cache
def _path(name: str) -> Path | None:
    """File of a script or of a module of echotruth, without importing it."""
    if name.endswith(".py"):
        return Path(name)
    path = PACKAGE.joinpath(*name.split(".")[1:])
    files = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in files if file.is_file()), None)


@cache
def _tree(name: str) -> ast.Module:
    path = _path(name)
    return ast.parse(path.read_text(encoding="utf-8") if path else "")


@cache
def _canonical_source(name: str) -> bytes:
    """Syntax tree of a script or module, without docstrings, as text."""
    return ast.dump(_without_docstrings(_tree(name))).encode()


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
