"""Labels of hearts: the diagnosis that a configuration gives, and those that a table carries along."""

from math import nan
from typing import Any

from echotruth.cases.case import Case, Label
from echotruth.cases.ids import integer_if_whole
from echotruth.config.diagnosis import diagnosis
from echotruth.config.table import LABEL


def columns(cases: list[Case]) -> dict[str, list[Any]]:
    """Columns of the table of cases: `diagnosis`, each label as `label.NAME`, and `note` if there are any.

    A case without a label has NaN, or "" if the label is text; a label that no case has is left out.
    """
    found: dict[str, list[Any]] = {"diagnosis": [diagnosis(case.config) for case in cases]}
    for name in dict.fromkeys(name for case in cases for name in case.labels):
        values = [case.labels.get(name) for case in cases]
        if all(value is None for value in values):
            continue
        empty = "" if any(isinstance(value, str) for value in values) else nan
        found[f"{LABEL}{name}"] = [empty if value is None else value for value in values]
    if any(case.note for case in cases):
        found["note"] = [case.note for case in cases]
    return found


def heart_of(case: Case) -> str:
    """Heart of a case: its label `heart`, or the id of its heart if it has none."""
    return label_text(case.labels.get("heart")) or case.heart


def label_text(label: Label) -> str:
    """A label as text, a whole number without a decimal point; "" if there is none."""
    return "" if label is None else str(integer_if_whole(label))
