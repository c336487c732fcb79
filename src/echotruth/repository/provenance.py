"""What a result was made from: code, settings, packages."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import echotruth

PACKAGES = ("numpy", "scipy", "numba", "scikit-image", "pypardiso", "mkl", "meshio", "vtk", "xarray", "zarr")
"""Packages whose version may show in the numbers, beside OpenCV, which is installed under several names."""

_APART = ("echotruth.config", "echotruth.cases", "echotruth.repository.provenance", "echotruth.repository")
"""Modules that carry settings and results but make none: their change reruns nothing."""


@cache
def code_version(*modules: str) -> str:
    """Hash of the parsed source of modules and of all of echotruth that they import.

    Comments, layout and docstrings do not enter it.

    Parameters
    ----------
    *modules : str
        As "echotruth.mechanics", or the path of a script.
    """
    digest = sha256()
    for name in sorted(_closure(modules)):
        digest.update(_plain(name))
    return digest.hexdigest()[:16]


def settings_version(*settings: Any) -> str:
    """Hash of settings: sections, or plain values."""
    plain = [item.model_dump(mode="json") if hasattr(item, "model_dump") else item for item in settings]
    return sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:16]


def packages() -> dict[str, str]:
    """Name to version of the packages whose version may show in the numbers, and of echotruth."""
    found = {"echotruth": echotruth.__version__}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found | _opencv()


def _opencv() -> dict[str, str]:
    """OpenCV's own version: some packages of it leave no name to ask for."""
    try:
        import cv2
    except ImportError:
        return {}
    return {"opencv": cv2.__version__}


def _closure(modules: tuple[str, ...]) -> set[str]:
    found: set[str] = set()
    open_names = list(modules)
    while open_names:
        name = open_names.pop()
        if name not in found and not name.startswith(_APART):
            found.add(name)
            open_names.extend(_imports(name))
    return found


@cache
def _imports(importer: str) -> list[str]:
    """Modules of echotruth that a module imports, anywhere in it, their packages included."""
    names: set[str] = set()
    for node in _statements(_tree(importer)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
            names |= _discovered(importer) if node.module == "pkgutil" else set()
    return sorted(name for name in names if name.startswith("echotruth.") and name != importer and _path(name))


def _discovered(package: str) -> set[str]:
    """Modules of a package that imports whatever stands in its folder."""
    path = _path(package)
    return {f"{package}.{file.stem}" for file in path.parent.glob("*.py")} - {f"{package}.__init__"} if path else set()


@cache
def _path(name: str) -> Path | None:
    """File of a script or of a module of echotruth, found without importing it."""
    if name.endswith(".py"):
        return Path(name)
    place = Path(echotruth.__file__).parent.joinpath(*name.split(".")[1:])
    files = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in files if file.is_file()), None)


@cache
def _tree(name: str) -> ast.Module:
    path = _path(name)
    return ast.parse(path.read_text(encoding="utf-8") if path else "")


@cache
def _plain(name: str) -> bytes:
    """The parsed source of a script or module, as text without docstrings."""
    return ast.dump(_without_docstrings(_tree(name))).encode()


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in [tree, *_statements(tree)]:
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [line for line in node.body if not _is_text(line)]
    return tree


def _statements(node: ast.AST) -> Iterator[Any]:
    """All statements in a node, however deep, and no expressions, which are most of a tree."""
    for block in ("body", "orelse", "finalbody", "handlers", "cases"):
        for statement in getattr(node, block, ()):
            yield statement
            yield from _statements(statement)


def _is_text(line: ast.stmt) -> bool:
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
