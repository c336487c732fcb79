"""Refusal of a tracker that cannot run, before the first clip, with the likely right spelling."""

from __future__ import annotations

import inspect
import re
import shutil
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from difflib import get_close_matches
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from echotruth.config.tracking import TRACKER_ARGUMENTS, External
from echotruth.evaluation.tracker_options import BUILTIN, SCRIPTS, EvaluationError
from echotruth.section import Section
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.trackers.external import ENTRY_POINT_GROUP, load_callable


def check_name(tracker: str) -> None:
    """Check that text can be the name of a tracker.

    Parameters
    ----------
    tracker : str
        A method of echotruth, `package.module:function`, or an entry point.

    Raises
    ------
    EvaluationError
        With what was probably meant.
    """
    installed = entry_points(group=ENTRY_POINT_GROUP).names
    if tracker in BUILTIN or tracker in installed:
        return
    if meant := _meant(tracker, [*BUILTIN, *installed]):
        raise EvaluationError(f"--tracker {tracker}: {meant}")


def check_runs(settings: Section) -> None:
    """Check that an external tracker can be imported and takes its options, or that its program is there.

    Parameters
    ----------
    settings : Section
        Of the tracker; those of a method of echotruth are checked already.

    Raises
    ------
    EvaluationError
        With what was probably meant.
    """
    if not isinstance(settings, External):
        return
    if settings.command is not None:
        _check_program(settings.command)
        return
    name = settings.track or ""
    try:
        with redirect_stdout(sys.stderr):
            function = load_callable(name)
    except TrackerFailed as error:
        raise EvaluationError(f"--tracker {name} {error}{_near(name)}") from error.__cause__
    if not callable(function):
        raise EvaluationError(f"--tracker {name}: is no function but a {type(function).__name__}: name a function")
    _check_arguments(name, function, settings.options)


def _meant(tracker: str, known: list[str]) -> str:
    """What a name that is no method and no entry point may mean; "" if it may be right."""
    if "/" in tracker or "\\" in tracker or re.search(r"\.py(:|$)", tracker):
        path, _, function = tracker.partition(":")
        module = ".".join(part for part in re.split(r"[/\\]+", path.removesuffix(".py")) if part not in ("", "."))
        return f"is a path: did you mean {module}:{function or 'track'}?"
    if ":" in tracker:
        return ""
    module, dot, function = tracker.rpartition(".")
    if dot and _is_module(module):
        whole = f"{tracker}:track" if _is_module(tracker) else f"{module}:{function}"
        return f"has no colon between module and function: did you mean {whole}?"
    if close := get_close_matches(tracker.lower(), known, n=1, cutoff=0.6):
        return f"is not a tracker: did you mean {close[0]}?"
    if not dot and _is_module(tracker):
        return f"is a module: name its function, as {tracker}:track"
    return f"is not a tracker: write package.module:function, or use one of {', '.join(known)}"


def _is_module(name: str) -> bool:
    """Whether there is a module of this name, in the current folder or installed."""
    if not {"", str(Path.cwd())} & set(sys.path):
        sys.path.insert(0, str(Path.cwd()))
    try:
        return find_spec(name) is not None
    except (ImportError, ValueError, AttributeError):
        return False
    except Exception:  # what a package raises when it is imported is told when its function is
        return True


def _near(name: str) -> str:
    """The function of a module, or the module of this folder, whose name is nearest; "" if there is none."""
    module, colon, function = name.partition(":")
    if not colon:
        return ""
    if loaded := sys.modules.get(module):
        functions = [key for key, value in vars(loaded).items() if callable(value)]
        close = get_close_matches(function, functions, n=1)
        return f": did you mean {module}:{close[0]}?" if close else ""
    here = [path.stem for path in Path.cwd().glob("*.py")]
    close = get_close_matches(module, here, n=1)
    return f": did you mean {close[0]}:{function}?" if close and close[0] != module else ""


def _check_arguments(name: str, function: Callable[..., Any], options: dict[str, Any]) -> None:
    """Check that a function takes the arguments of every tracker, and its options."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # as of functions in C
        return
    known = _keywords(signature)
    takes_all = any(one.kind is one.VAR_KEYWORD for one in signature.parameters.values())
    for option in () if takes_all else sorted(options.keys() - set(known)):
        close = get_close_matches(option, known, n=1)
        remedy = f"did you mean {close[0]}?" if close else f"its options are {', '.join(known) or 'none'}"
        raise EvaluationError(f"--tracker {name}: has no option {option}: {remedy}")
    try:
        signature.bind(*TRACKER_ARGUMENTS, **options)
    except TypeError as error:
        missing = [key for key in known if key not in options and f"{key!r}" in str(error)]
        given = f"it gets {', '.join(TRACKER_ARGUMENTS)}, and its options"
        remedy = f"give --option {missing[0]}=..." if missing else given
        raise EvaluationError(f"--tracker {name}: {error}: {remedy}") from None


def _keywords(signature: inspect.Signature) -> list[str]:
    """Names of the options that a function takes."""
    own = list(signature.parameters.values())[len(TRACKER_ARGUMENTS) :]
    return [one.name for one in own if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)]


def _check_program(command: list[str]) -> None:
    """Check that a program, and the script that it is to run, are there."""
    program, *words = command
    if shutil.which(program) is None:
        raise EvaluationError(f"--command {program}: is not there or cannot be run: give its name or its path")
    script = words[0] if words else ""
    if Path(script).suffix.lower() in SCRIPTS and not Path(script).is_file():
        near = [path.name for path in Path(script).parent.glob(f"*{Path(script).suffix}")]
        close = get_close_matches(Path(script).name, near, n=1)
        remedy = f"did you mean {Path(script).parent / close[0]}?" if close else "give its path from this folder"
        raise EvaluationError(f"--command {program} {script}: {script} is not there: {remedy}")
