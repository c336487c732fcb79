"""`echotruth completion`: the script that completes commands, options and paths in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from echotruth.cli.command import Commands, add_command, fail

SHELLS = ("bash", "zsh")

NOTES = """in this shell only (bash):
         eval "$(echotruth completion bash)"
in every new shell:
  bash:  mkdir -p ~/.local/share/bash-completion/completions
         echotruth completion bash > ~/.local/share/bash-completion/completions/echotruth
  zsh:   mkdir -p ~/.zfunc; echotruth completion zsh > ~/.zfunc/_echotruth
         and in ~/.zshrc: fpath+=~/.zfunc; autoload -Uz compinit; compinit"""

PATHS = ("config", "output", "repository", "folder")
"""Arguments that are text and name a file or a folder."""


def add(commands: Commands) -> None:
    """Add the parser of `echotruth completion`."""
    parser = add_command(
        commands,
        completion,
        "print a script that completes commands, options and paths in a shell",
        "",
        ["completion bash", "completion zsh"],
        {0: "it is printed", 2: "the package shtab is missing"},
        NOTES,
    )
    parser.add_argument("shell", choices=SHELLS, help="shell for which it is")


def completion(arguments: argparse.Namespace) -> int:
    """Print the script for a shell; return the exit status."""
    from echotruth.cli import parser

    try:
        import shtab
    except ImportError:
        return fail("completion needs the package shtab: pip install shtab")
    whole = parser()
    for action in _actions(whole):
        if action.type is Path or action.dest in PATHS:
            action.complete = shtab.FILE  # type: ignore[attr-defined]  # as shtab reads it
    print(shtab.complete(whole, shell=arguments.shell))
    return 0


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Arguments of a parser and of its commands; argparse has no public name for them."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
        else:
            yield action
