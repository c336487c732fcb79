"""Opening the repositories of the benchmark."""

from __future__ import annotations

from pathlib import Path

from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository.reader import Repository


def opened(folder: Path) -> Repository:
    """A repository, given its folder or its store; EvaluationError if it is none."""
    try:
        return Repository(folder)
    except FileNotFoundError as error:
        raise EvaluationError(str(error)) from None
