"""Refusal of a tracker that cannot run, before the first clip."""

import inspect
import shutil
import sys
from contextlib import redirect_stdout

from echotruth.config.tracking import TRACKER_ARGUMENTS, External, Onnx
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.extras import explained
from echotruth.section import Section
from echotruth.tracking import trackers
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.trackers.external import load_callable
from echotruth.tracking.trackers.onnx import Model


def check_runs(settings: Section) -> None:
    """Check that an external tracker can be imported and takes its options, or that its program or model is there.

    Parameters
    ----------
    settings : Section
        Of the tracker; those of a method of echotruth are checked already, but for the packages that it needs.

    Raises
    ------
    EvaluationError, TrackerFailed, ConfigError
        With what is wrong.
    """
    if isinstance(settings, Onnx):
        Model(settings)
        return
    if not isinstance(settings, External):
        method = settings.method  # type: ignore[attr-defined]  # every tracker has one
        with explained(f"the tracker {method}"):
            trackers.function(method)
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
