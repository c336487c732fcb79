"""Links of the project's pages to its folders and scripts lead to the pages of the site that show them."""

from __future__ import annotations

import re

from sphinx.application import Sphinx

SHOWN = {"examples": "docs/examples.md"}
"""Folder or file of the project to the page of the site that shows it, both from the root of the project."""
LINK = re.compile(r"\]\((?P<path>(?:\.\./)*)(?P<target>[\w./-]+)\)")


def replace(app: Sphinx, page: str, source: list[str]) -> None:
    """Replace the targets of links in the text of a page."""
    source[0] = LINK.sub(
        lambda found: f"]({found['path']}{SHOWN.get(found['target'], found['target'])})",
        source[0],
    )


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the replacement."""
    app.connect("source-read", replace)
    return {"parallel_read_safe": True}
