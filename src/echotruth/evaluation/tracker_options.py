"""Name and settings of a tracker from the arguments of `echotruth evaluate`."""

import re
from pathlib import Path
from shlex import split
from typing import Any

import yaml

from echotruth.config.building import tracker_values
from echotruth.config.tracking import BUILTIN, parse_numbers

SCRIPTS = (".py", ".jl", ".m", ".r", ".sh", ".pl", ".js", ".lua")
"""Suffixes of scripts; a program is named after its script rather than the interpreter."""


class EvaluationError(ValueError):
    """Raised if a tracker cannot be evaluated; the message says why, and what to do."""


def parse_tracker(
    tracker: str | None, command: str | None, options: list[str], timeout: float | None = None
) -> tuple[str, dict[str, Any]]:
    """Name and settings of a tracker from the arguments of the command line.

    Parameters
    ----------
    tracker : str or None
        A method of echotruth, `package.module:function`, an entry point, or the file of a model in ONNX.
    command : str or None
        If there is no `tracker`: a program and its arguments, as a shell splits them.
    options : list of str
        As `key=value`, the value in YAML.
    timeout : float, optional
        Longest time that the program or model may take for a clip, s.

    Raises
    ------
    EvaluationError
        If an option or the command cannot be read, or a timeout is given for a method or a callable.
    ConfigError
        If there is no such tracker.
    """
    pairs = dict(map(_option, options))
    limit = {} if timeout is None else {"timeout_s": timeout}
    if tracker is None:
        try:
            words = split(command or "")
        except ValueError as error:
            raise EvaluationError(f"--command {command}: {str(error).lower()}: fix the quotes") from None
        script = next((word for word in words if Path(word).suffix.lower() in SCRIPTS), (words or [""])[0])
        return _identifier(Path(script).stem), {"method": "external", "command": words, "options": pairs, **limit}
    values = tracker_values(tracker, pairs)
    if values["method"] == "onnx":
        return _identifier(Path(tracker).stem), values | limit
    if limit:
        remedy = "leave it out, or give a program as --command"
        raise EvaluationError(f"--timeout {timeout:g}: {tracker} is not timed: {remedy}")
    return tracker if tracker in BUILTIN else _identifier(tracker.removesuffix(":track")), values


def _identifier(text: str) -> str:
    return re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_")


def _option(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals:
        raise EvaluationError(f"--option {text}: has no value: write key=value")
    try:
        return key, parse_numbers(yaml.safe_load(value))
    except yaml.YAMLError:
        raise EvaluationError(f"--option {text}: the value is not YAML: quote it") from None
