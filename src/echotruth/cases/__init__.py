"""Expand the sweep of a configuration into cases, each a heart and its imaging, with stable ids.

A sweep is a grid of values, the rows of a table, random draws, and conditions on them (docs/cases.md).
"""

from echotruth.cases.case import Case as Case
from echotruth.cases.expansion import all_cases as all_cases
from echotruth.cases.expansion import expand as expand
from echotruth.cases.expansion import find_case as find_case
from echotruth.cases.ids import case_id as case_id
from echotruth.cases.tabulation import table as table
from echotruth.config.diagnosis import diagnosis as diagnosis
