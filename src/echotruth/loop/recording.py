"""A recorded cycle, read from a CSV file whose columns have their units in their names."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echotruth.arrays import Floats
from echotruth.units import UNITS

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {
    "time": ("ms", "s"),
    "pressure": ("mmHg", "kPa", "Pa"),
    "volume": ("uL", "mL", "m3"),
    "tension": ("kPa", "Pa"),
}
"""Quantity to the units that its column may have."""

_ABBREVIATIONS = {"t": "time", "lvp": "pressure", "lvv": "volume"}

_MIN_ROWS = 4


class LoopError(ValueError):
    """Raised if a cycle cannot drive a heart; the message names file, row, value and remedy."""


@dataclass(frozen=True)
class Recording:
    """Columns of a file in the units of the file.

    Attributes
    ----------
    path : Path
    names : dict of str
        Quantity to the name of its column.
    columns : dict of ndarray of shape (n_rows,)
        Quantity to its values, in the unit of the name.
    """

    path: Path
    names: dict[str, str]
    columns: dict[str, Floats]

    def si(self, quantity: str) -> Floats | None:
        """Values of a quantity in SI units, (n_rows,); None if the file has none."""
        if quantity not in self.names:
            return None
        return self.columns[quantity] * UNITS[self.names[quantity].removeprefix(f"{quantity}_")]


def read(path: Path, purpose: str, needed: tuple[str, ...], optional: tuple[str, ...] = ()) -> Recording:
    """Read columns of a file.

    Parameters
    ----------
    path : Path
        CSV, with commas, or with semicolons or tabs and then also decimal commas; blank lines and lines that begin
        with # are skipped, the first other line names the columns. Text that LabChart exports is read too.
    purpose : str
        Use of the columns, for errors.
    needed, optional : tuple of str
        Quantities that the file must have, and those that are read if it has them.

    Raises
    ------
    LoopError
        If the file cannot be read, lacks a column or gives a quantity twice, or a cell is no number.
    """
    table = _table(path)
    names = {quantity: _column(path, list(table), quantity) for quantity in (*needed, *optional)}
    for quantity in needed:
        if not names[quantity]:
            choice = " or ".join(f"{quantity}_{unit}" for unit in COLUMNS[quantity])
            need = f"there is no column of the {quantity}, which {purpose} needs"
            raise LoopError(f"{path}: {need}; add one and name it {choice}.")
    names = {quantity: name for quantity, name in names.items() if name}
    if len(table) < _MIN_ROWS:
        raise LoopError(f"{path}: there are {len(table)} rows; a cycle needs {_MIN_ROWS} or more.")
    columns = {
        quantity: np.array([_number(f"{path}, line {line}", name, cell) for line, cell in table[name].items()])
        for quantity, name in names.items()
    }
    return Recording(path, names, columns)


def _table(path: Path) -> pd.DataFrame:
    """Cells of the file by the names of its columns; the index is the number of each line."""
    import pandas as pd

    lines = {i: line for i, line in enumerate(_text(path), 1) if line.strip() and not line.startswith("#")}
    if not lines:
        raise LoopError(f"{path}: is empty; give a CSV file.")
    separator = next((mark for mark in "\t;" if mark in next(iter(lines.values()))), ",")
    columns = range(1 + max(line.count(separator) for line in lines.values()))
    text = io.StringIO("\n".join(lines.values()))
    try:
        cells = pd.read_csv(text, sep=separator, header=None, names=columns, dtype=str, keep_default_na=False)
    except pd.errors.ParserError as error:
        raise LoopError(f"{path}: is no table ({error}); give a CSV file.") from None
    cells = cells.set_axis(list(lines)[: len(cells)]).apply(lambda column: column.str.strip())
    # LabChart writes lines such as "ChannelTitle=", then rows of the time in seconds and the channels.
    is_about = cells[0].str.endswith("=")
    about, cells = cells[is_about].set_index(0).T, cells[~is_about]
    if "ChannelTitle=" in about:
        header = ["time_s", *(about["ChannelTitle="] + " (" + about.get("UnitName=", "") + ")")]
    else:
        header, cells = cells[:1].squeeze("index"), cells[1:]
    if separator != ",":
        cells = cells.replace(",", ".", regex=True)
    return cells.set_axis(map(_standard_name, header), axis="columns")


def _standard_name(name: str) -> str:
    """Name of a column as `COLUMNS` has it, of one such as "LVP [mmHg]"; another one as it is."""
    match = re.fullmatch(r"([^\W_]+)[\s_]*[\s_(\[]([^\W_]+)[)\]]?", name.replace("\u00b5", "u").replace("\u03bc", "u"))
    if match is None:
        return name
    quantity = _ABBREVIATIONS.get(match[1].lower(), match[1].lower())
    units = {unit.lower(): unit for unit in COLUMNS.get(quantity, ())}
    unit = units.get(match[2].lower())
    return name if unit is None else f"{quantity}_{unit}"


def _text(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise LoopError(f"{path}: is not UTF-8 text; give a CSV file.") from None
    except OSError as error:
        raise LoopError(f"{path}: cannot be read ({error.strerror}); give the path of a CSV file.") from None


def _column(path: Path, header: list[str], quantity: str) -> str:
    """Name of the one column of a quantity; empty if there is none."""
    known = [f"{quantity}_{unit}" for unit in COLUMNS[quantity]]
    names = [name for name in header if name in known]
    if len(names) > 1:
        raise LoopError(f"{path}: the columns {names[0]} and {names[1]} both give the {quantity}; keep one of them.")
    return names[0] if names else ""


def _number(line: str, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise LoopError(f"{line}: {name} is {cell!r}; give a finite number.")
    return value
