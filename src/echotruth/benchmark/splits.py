"""The two halves of the hearts of a benchmark, by the labels of their table."""

from __future__ import annotations

from echotruth.cases import Case

DEVELOP, TEST = "develop", "test"
"""Values of the label `split`: hearts on which trackers may be tuned, and those on which they are reported."""


def split_of(case: Case) -> str:
    """Half to which a case belongs; `test` without a label `split`: nobody has said that it was tuned on."""
    return str(case.labels.get("split") or TEST)
