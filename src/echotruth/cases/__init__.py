"""Expand the sweep of a configuration into cases, one heart each, with stable ids.

A sweep is a grid of values, the rows of a table, random draws, and conditions on them (docs/cases.md).
"""

from echotruth.cases.case import Case, Combination
from echotruth.cases.checks import NOT_SWEPT, RF_INDEPENDENT
from echotruth.cases.expansion import all_cases, combinations, expand, find_case
from echotruth.cases.ids import READABLE_LENGTH, case_id
from echotruth.cases.labels import diagnosis
from echotruth.cases.rows import as_table
from echotruth.cases.sections import Sweep
from echotruth.cases.tabulation import table

__all__ = [
    "NOT_SWEPT",
    "READABLE_LENGTH",
    "RF_INDEPENDENT",
    "Case",
    "Combination",
    "Sweep",
    "all_cases",
    "as_table",
    "case_id",
    "combinations",
    "diagnosis",
    "expand",
    "find_case",
    "table",
]
