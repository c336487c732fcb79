"""Directive `command-reference`: a section for each command of echotruth, with the help that its parser prints."""

from __future__ import annotations

import argparse
import os

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from echotruth.cli import parser

COLUMNS = "100"
"""Width of the help; argparse otherwise takes that of the terminal."""


def commands() -> dict[str, argparse.ArgumentParser]:
    """Parser of each command, by its name, in the order of `echotruth --help`."""
    groups = [action for action in parser()._actions if isinstance(action, argparse._SubParsersAction)]
    return dict(groups[0].choices) if groups else {}


def text() -> str:
    """The sections in MyST."""
    os.environ["COLUMNS"] = COLUMNS
    helps = {"echotruth": parser().format_help()}
    helps |= {f"echotruth {name}": command.format_help() for name, command in commands().items()}
    return "\n".join(f"## {name}\n\n```text\n{found}```\n" for name, found in helps.items())


class CommandReference(SphinxDirective):
    """Help of all commands."""

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(text(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("command-reference", CommandReference)
    return {"parallel_read_safe": True}
