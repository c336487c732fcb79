"""Names of the library that autodoc documents: short signatures of settings, and links in place of names of pages."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from sphinx.application import Sphinx

PAGE = re.compile(r"(?<![\w/`])((?:docs|config)/\w+)\.md")


def shorten(
    app: Sphinx, what: str, name: str, found: object, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None] | None:
    """Signature of a section of a configuration: its keys are listed in the reference of the configuration."""
    if isinstance(found, type) and issubclass(found, BaseModel):
        return "(**keys)", None
    return None


def link(app: Sphinx, what: str, name: str, found: object, options: Any, lines: list[str]) -> None:
    """Make a link of each page of the project that a docstring names."""
    root = Path(app.srcdir)

    def replaced(page: re.Match[str]) -> str:
        return f":doc:`/{page[1]}`" if (root / page[0]).exists() else page[0]

    lines[:] = [PAGE.sub(replaced, line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the handlers."""
    app.connect("autodoc-process-signature", shorten)
    app.connect("autodoc-process-docstring", link)
    return {"parallel_read_safe": True}
