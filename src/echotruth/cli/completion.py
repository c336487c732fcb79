"""`echotruth completion`: the script that completes commands, options and paths in a shell."""

import argparse
from collections.abc import Iterator
from pathlib import Path

SHELLS = ("bash", "zsh")

PATHS = ("config", "output", "path", "repository", "folder")
"""Arguments that are text and name a file or a folder."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth completion`."""
    parser.add_argument("shell", choices=SHELLS, help="shell for which it is")


def completion(arguments: argparse.Namespace) -> int:
    """Print a script that completes commands, options and paths in a shell.

    in this shell only (bash):
             eval "$(echotruth completion bash)"
    in every new shell:
      bash:  mkdir -p ~/.local/share/bash-completion/completions
             echotruth completion bash > ~/.local/share/bash-completion/completions/echotruth
      zsh:   mkdir -p ~/.zfunc; echotruth completion zsh > ~/.zfunc/_echotruth
             and in ~/.zshrc: fpath+=~/.zfunc; autoload -Uz compinit; compinit

    examples:
      echotruth completion bash
      echotruth completion zsh

    exit status:
      0  it is printed
    """
    import shtab

    from echotruth.cli import parser

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
