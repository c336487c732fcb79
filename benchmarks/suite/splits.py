"""The two halves of the hearts of a benchmark, by the labels of their table."""

from __future__ import annotations

from collections.abc import Mapping

from echotruth.cases import Case
from echotruth.cases.labels import heart_of
from echotruth.evaluation.tracker_options import EvaluationError

DEVELOP, TEST = "develop", "test"
"""Values of the label `split`: hearts on which trackers may be tuned, and those on which they are reported."""


def split_of(case: Case) -> str:
    """Half to which a case belongs; EvaluationError if its label `split` names neither."""
    split = split_of_label(case.labels.get("split"))
    if split not in (DEVELOP, TEST):
        raise EvaluationError(f"case {case.id}: label.split = {split}: use {DEVELOP} or {TEST}")
    return split


def is_usual(case: Case, split: str) -> bool:
    """Whether the label `split` of a case names a half, and its clips are of no variation."""
    return case.labels.get("split") == split and case.labels.get("variation", "none") == "none"


def split_of_label(label: object) -> str:
    """Half that a label `split` names; without one it is `test`, lest anybody tunes on a heart by accident."""
    return ("" if label is None else str(label)) or TEST


def check_halves(cases: Mapping[str, Case]) -> None:
    """Check that each heart is in one half.

    Parameters
    ----------
    cases : mapping
        By their names.

    Raises
    ------
    EvaluationError
        If the label `split` of a case names neither half, or the cases of a heart are in both.
    """
    halves = {name: split_of(case) for name, case in cases.items()}
    first: dict[str, str] = {}
    for name, half in halves.items():
        heart = heart_of(cases[name])
        other = first.setdefault(heart, name)
        if half != halves[other]:
            both = f"{other}: {halves[other]}, {name}: {half}"
            raise EvaluationError(f"heart {heart} is in both halves ({both}): give its cases one label.split")
