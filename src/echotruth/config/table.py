"""The table of hearts as it is written: the cells of a CSV text, whose columns are named by its first row."""

from __future__ import annotations

import io
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

CASE, NOTE, LABEL = "case", "note", "label."
"""Columns of the id and of a note, and how the names of labels begin."""
MAX_CASES = 100_000
"""Largest number of cases of a repository, also of those that conditions leave out."""
MAX_BYTES = 2 * 2**20
"""Size of the largest table of hearts: 10 000 rows of 200 characters."""
MAX_COLUMNS = 256
"""Largest number of columns of a table; each may become an array of the repository."""
MAX_CELL = 4000
"""Longest cell of a table, as a note may be, characters."""


class TableError(ValueError):
    """Raised if a text is not a table of hearts; the message names row, column and remedy."""


@lru_cache(maxsize=4)
def parse(text: str) -> pd.DataFrame:
    """Cells of a CSV text.

    Parameters
    ----------
    text : str
        Comma-separated values as RFC 4180 describes them.

    Returns
    -------
    DataFrame of str
        Cells without blanks around them; rows without any are left out. The index is the number of each row in the
        file: 1 is the first below the names of the columns.

    Raises
    ------
    TableError
        If it has no columns or rows, or a row has not as many cells as there are columns.
    """
    import pandas as pd

    # The engine of Python alone tells a cell that is missing, which is NaN, from an empty one.
    how = {"dtype": str, "keep_default_na": False, "skip_blank_lines": False, "engine": "python", "header": None}
    try:
        table = pd.read_csv(io.StringIO(text, newline=""), nrows=MAX_CASES + 2, **how)
    except pd.errors.EmptyDataError:
        raise TableError("has no columns: begin with a row of their names, such as case,fibres.endo_deg,note") from None
    except pd.errors.ParserError as error:
        remedy = "save it as CSV, with text that has commas in quotes"
        raise TableError(f"is not a table of comma-separated values ({error}): {remedy}") from None
    table = table.apply(lambda column: column.str.strip())
    names = table.iloc[0].fillna("").tolist()
    _check_columns(names)
    table = table[1:].set_axis(names, axis="columns")
    table = table[(table.fillna("") != "").any(axis="columns")]
    if table.empty:
        raise TableError("has no rows: write a row for each heart below the names of the columns")
    if len(table) > MAX_CASES:
        raise TableError(f"has more than {MAX_CASES} rows, as many as a repository has cases: give fewer")
    _check_cells(table)
    return table


def swept(table: pd.DataFrame) -> list[str]:
    """Columns of a table that are dotted keys."""
    return [name for name in table if name not in (CASE, NOTE) and not name.startswith(LABEL)]


def labels(table: pd.DataFrame) -> list[str]:
    """Columns of a table that are labels."""
    return [name for name in table if name.startswith(LABEL)]


def _check_columns(names: list[str]) -> None:
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and separator in names[0]:
            raise TableError(f"has its columns separated by {name}: separate them by commas")
    if len(names) > MAX_COLUMNS:
        raise TableError(f"has {len(names)} columns: give at most {MAX_COLUMNS}")
    for number, name in enumerate(names, 1):
        if not name:
            raise TableError(f"column {number} has no name: name it in the first row")
        if name in names[: number - 1]:
            raise TableError(f"column {name[:80]!r} is given twice: give it once")


def _check_cells(table: pd.DataFrame) -> None:
    for number in table.index[table.isna().any(axis="columns")]:
        row = f"row {number} has {table.loc[number].count()} cells and not {len(table.columns)}, as many as columns"
        raise TableError(f"{row}: leave cells empty rather than out, and put text with commas in quotes")
    for name in table:
        lengths = table[name].str.len()
        if lengths.max() > MAX_CELL:
            row = f"row {lengths.idxmax()}, column {name}"
            raise TableError(f"{row}: has {lengths.max()} characters: write at most {MAX_CELL}")
