"""Refusal of a tracker that cannot run, before the first clip."""

import inspect
import shutil
import sys
from contextlib import redirect_stdout
from difflib import get_close_matches
from importlib.metadata import entry_points

from echotruth.config.tracking import TRACKER_ARGUMENTS, External, Onnx
from echotruth.evaluation.tracker_options import BUILTIN, EvaluationError
from echotruth.section import Section
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.trackers.external import ENTRY_POINT_GROUP, load_callable
from echotruth.tracking.trackers.onnx import Model


def check_name(tracker: str) -> None:
    """Check that text can be the name of a tracker.

    Parameters
    ----------
    tracker : str
        A method of echotruth, `package.module:function`, an entry point, or the file of a model in ONNX.

    Raises
    ------
    EvaluationError
        With what was probably meant.
    """
    known = [*BUILTIN, *entry_points(group=ENTRY_POINT_GROUP).names]
    if tracker in known or ":" in tracker or tracker.endswith(".onnx"):
        return
    close = get_close_matches(tracker.lower(), known, n=1)
    remedy = f"write package.module:function or MODEL.onnx, or use one of {', '.join(known)}"
    raise EvaluationError(f"--tracker {tracker}: is not a tracker: {f'did you mean {close[0]}?' if close else remedy}")


def check_runs(settings: Section) -> None:
    """Check that an external tracker can be imported and takes its options, or that its program or model is there.

    Parameters
    ----------
    settings : Section
        Of the tracker; those of a method of echotruth are checked already.

    Raises
    ------
    EvaluationError, TrackerFailed, ConfigError
        With what is wrong.
    """
    if isinstance(settings, Onnx):
        Model(settings)
    if not isinstance(settings, External):
        return
    if settings.command is not None:
        if shutil.which(settings.command[0]) is None:
            remedy = "is not there or cannot be run: give its name or its path"
            raise EvaluationError(f"--command {settings.command[0]}: {remedy}")
        return
    name = settings.track or ""
    try:
        with redirect_stdout(sys.stderr):
            function = load_callable(name)
    except TrackerFailed as error:
        raise EvaluationError(f"--tracker {name} {error}") from error.__cause__
    try:
        inspect.signature(function).bind(*TRACKER_ARGUMENTS, **settings.options)
    except TypeError as error:
        given = f"it gets {', '.join(TRACKER_ARGUMENTS)}, and those given as --option key=value"
        raise EvaluationError(f"--tracker {name}: {error}: {given}") from None
    except ValueError:  # a function in C may have no signature
        return
