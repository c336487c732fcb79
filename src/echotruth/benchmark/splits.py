"""The two halves of the hearts of a benchmark, by the labels of their table."""

from __future__ import annotations

from echotruth.cases import Case

DEVELOP, TEST = "develop", "test"
"""Values of the label `split`: hearts on which trackers may be tuned, and those on which they are reported."""


def split_of(case: Case) -> str:
    """Half to which a case belongs."""
    return split_of_label(case.labels.get("split"))


def split_of_label(label: object) -> str:
    """Half that a label `split` names; without one it is `test`, lest anybody tunes on a heart by accident."""
    return str(label or TEST)
