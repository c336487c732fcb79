"""`echotruth cases`: the cases of a configuration as a table."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from echotruth.cli.command import add_configuration

if TYPE_CHECKING:
    import pandas as pd

    from echotruth.cases import Case


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth cases`."""
    add_configuration(parser)
    parser.add_argument("--all", action="store_true", help="also print the columns that are the same in all cases")


def cases(arguments: argparse.Namespace) -> int:
    """Print the cases of a configuration as CSV.

    There is a row for each case, with its id and the columns in which cases differ: keys, labels and
    notes.

    examples:
      echotruth cases config/sweep.yaml
      echotruth cases config/sweep.yaml --all > cases.csv

    exit status:
      0  they are printed
      1  the configuration is not valid
    """
    from echotruth.cases import table
    from echotruth.cli.configuration import load_cases

    _, found = load_cases(arguments.config)
    whole = table(found)
    shown = whole if arguments.all else whole[_differing(found, whole)]
    shown.to_csv(sys.stdout, index=False)
    if len(shown.columns) < len(whole.columns) and sys.stderr.isatty():
        number = len(whole.columns) - len(shown.columns)
        print(f"echotruth: {number} columns are the same in all cases: --all prints them", file=sys.stderr)
    return 0


def _differing(cases: list[Case], table: pd.DataFrame) -> list[str]:
    """The id, what the configuration sweeps, and the columns in which cases differ."""
    swept = {key for case in cases for key in case.parameters}
    differs = table.astype(str).nunique() > 1
    return [name for name in table if name == "case" or name in swept or differs[name]]
