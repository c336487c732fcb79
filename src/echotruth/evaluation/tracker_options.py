"""Who enters a trial: a tracker's name and settings, from what stands on the command line."""

from __future__ import annotations

import re
from pathlib import Path
from shlex import split
from typing import Any

import yaml

from echotruth.config.tracking import METHODS, Guest, name_of, numbers

OWN = tuple(name_of(method) for method in METHODS if method is not Guest)
"""Names of the methods of echotruth."""


SCRIPTS = (".py", ".jl", ".m", ".r", ".sh", ".pl", ".js", ".lua")
"""How the names of scripts end, which a program of another name reads."""


class CannotTry(ValueError):
    """A trial that cannot be held; the message says why, and what to do."""


def entrant(
    tracker: str | None, command: str | None, options: list[str], timeout: float | None = None
) -> tuple[str, dict[str, Any]]:
    """What a tracker is called and its settings, from what stands on the command line.

    Parameters
    ----------
    tracker : str or None
        A method of ours, `package.module:function`, or an entry point.
    command : str or None
        Where there is no `tracker`: a program and its arguments, as a shell would split them.
    options : list of str
        As `key=value`, the value in YAML.
    timeout : float, optional
        How long the program may take over a clip, s.

    Raises
    ------
    CannotTry
        If an option or the command cannot be read, or a limit of time is set for what is no program.
    """
    pairs = dict(map(_option, options))
    if tracker is not None and timeout is not None:
        raise CannotTry(f"--timeout {timeout:g}: {tracker} is not timed: leave it out, or give a program as --command")
    if tracker is None:
        try:
            words = split(command or "")
        except ValueError as error:
            raise CannotTry(f"--command {command}: {str(error).lower()}: mend the quotes") from None
        limit = {} if timeout is None else {"timeout_s": timeout}
        return _slug(_program(words)), {"method": "guest", "command": words, "options": pairs, **limit}
    if tracker in OWN:
        return tracker, {"method": tracker, **pairs}
    return _slug(tracker.removesuffix(":track")), {"method": "guest", "track": tracker, "options": pairs}


def _program(words: list[str]) -> str:
    """What a command runs: a script, if one is among its words, and not what reads it."""
    scripts = [word for word in words if Path(word).suffix.lower() in SCRIPTS]
    return Path([*scripts, *words, ""][0]).stem


def _slug(text: str) -> str:
    return re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_")


def _option(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals:
        raise CannotTry(f"--option {text}: has no value: write key=value")
    try:
        return key, numbers(yaml.safe_load(value))
    except yaml.YAMLError:
        raise CannotTry(f"--option {text}: the value is not YAML: quote it") from None
