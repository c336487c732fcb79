"""The table of hearts as it is written: the cells of a CSV text, whose columns are named by its first row."""

import csv
import io
from dataclasses import dataclass
from functools import lru_cache

from echotruth.config.limits import MAX_CASES, MAX_CELL, MAX_TABLE_COLUMNS

CASE, NOTE, LABEL = "case", "note", "label."
"""Columns of the id and of a note, and how the names of labels begin."""


class TableError(ValueError):
    """Raised if a text is not a table of hearts; the message names row, column and remedy."""


@dataclass(frozen=True)
class Table:
    """Cells of a table."""

    columns: tuple[str, ...]
    """Their names."""
    cells: list[tuple[str, ...]]
    """Cells of each row, without blanks around them; rows without any are left out."""
    numbers: list[int]
    """Number of each row in the file: 1 is the first below the names of the columns."""

    @property
    def keys(self) -> list[str]:
        """Columns that are dotted keys."""
        return [name for name in self.columns if name not in (CASE, NOTE) and not name.startswith(LABEL)]

    @property
    def labels(self) -> list[str]:
        """Columns that are labels."""
        return [name for name in self.columns if name.startswith(LABEL)]


@lru_cache(maxsize=4)
def parse(text: str) -> Table:
    """Split a CSV text into cells.

    Parameters
    ----------
    text : str
        Comma-separated values as RFC 4180 describes them.

    Raises
    ------
    TableError
        If it has no columns or rows, or a row has not as many cells as there are columns.
    """
    lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    numbers: list[int] = []
    cells: list[tuple[str, ...]] = []
    try:
        columns = tuple(name.strip() for name in next(lines, []))
        _check_columns(columns)
        for number, line in enumerate(lines, 1):
            row = tuple(cell.strip() for cell in line)
            if any(row):
                _check_row(number, row, columns)
                numbers.append(number)
                cells.append(row)
            if len(cells) > MAX_CASES:
                raise TableError(f"has more than {MAX_CASES} rows, as many as a repository has cases: give fewer")
    except csv.Error as error:
        raise TableError(f"is not a table of comma-separated values ({error}): save it as CSV") from None
    if not cells:
        raise TableError("has no rows: write a row for each heart below the names of the columns")
    return Table(columns, cells, numbers)


def _check_columns(columns: tuple[str, ...]) -> None:
    if not any(columns):
        raise TableError("has no columns: begin with a row of their names, such as case,fibres.endo_deg,note")
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(columns) == 1 and separator in columns[0]:
            raise TableError(f"has its columns separated by {name}: separate them by commas")
    if len(columns) > MAX_TABLE_COLUMNS:
        raise TableError(f"has {len(columns)} columns: give at most {MAX_TABLE_COLUMNS}")
    for number, name in enumerate(columns, 1):
        if not name:
            raise TableError(f"column {number} has no name: name it in the first row")
        if name in columns[: number - 1]:
            raise TableError(f"column {name[:80]!r} is given twice: give it once")


def _check_row(number: int, row: tuple[str, ...], columns: tuple[str, ...]) -> None:
    if len(row) != len(columns):
        remedy = "leave cells empty rather than out, and put text with commas in quotes"
        raise TableError(f"row {number} has {len(row)} cells and not {len(columns)}, as many as columns: {remedy}")
    for name, cell in zip(columns, row, strict=True):
        if len(cell) > MAX_CELL:
            raise TableError(f"row {number}, column {name}: has {len(cell)} characters: write at most {MAX_CELL}")
