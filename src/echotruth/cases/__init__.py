"""Expand the sweep of a configuration into cases, each a heart and its imaging, with stable ids.

A sweep is a grid of values, the rows of a table, random draws, and conditions on them (docs/cases.md).
"""

from echotruth.cases.case import Case
from echotruth.cases.expansion import all_cases, expand, find_case
from echotruth.cases.ids import case_id
from echotruth.cases.labels import diagnosis
from echotruth.cases.tabulation import table

__all__ = [
    "Case",
    "all_cases",
    "case_id",
    "diagnosis",
    "expand",
    "find_case",
    "table",
]
