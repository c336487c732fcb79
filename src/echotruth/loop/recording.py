"""A recorded cycle, read from a CSV file whose columns have their units in their names."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echotruth.arrays import Floats
from echotruth.section import UNITS

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
    header, rows = _table(_text(path))
    names = {quantity: _column(path, header, quantity) for quantity in (*needed, *optional)}
    for quantity in needed:
        if not names[quantity]:
            choice = " or ".join(f"{quantity}_{unit}" for unit in COLUMNS[quantity])
            need = f"there is no column of the {quantity}, which {purpose} needs"
            raise LoopError(f"{path}: {need}; add one and name it {choice}.")
    names = {quantity: name for quantity, name in names.items() if name}
    if len(rows) < _MIN_ROWS:
        raise LoopError(f"{path}: there are {len(rows)} rows; a cycle needs {_MIN_ROWS} or more.")
    columns = {
        quantity: np.array([_number(f"{path}, line {line}", name, row.get(name, "")) for line, row in rows.items()])
        for quantity, name in names.items()
    }
    return Recording(path, names, columns)


def _table(text: list[str]) -> tuple[list[str], dict[int, dict[str, str]]]:
    """Names of the columns, and number of each line with its cells by these names."""
    lines = {i: line for i, line in enumerate(text, 1) if line.strip() and not line.startswith("#")}
    delimiter = next((mark for mark in "\t;" if mark in next(iter(lines.values()), "")), ",")
    cells = dict(zip(lines, csv.reader(lines.values(), delimiter=delimiter), strict=True))
    cells = {i: [cell.strip() for cell in row] for i, row in cells.items()}
    # LabChart writes lines such as "ChannelTitle=", then rows of the time in seconds and the channels.
    about = {row[0]: row[1:] for row in cells.values() if row and row[0].endswith("=")}
    rows = {i: row for i, row in cells.items() if not (row and row[0].endswith("="))}
    if "ChannelTitle=" in about:
        units = [*about.get("UnitName=", []), *[""] * len(about["ChannelTitle="])]
        header = ["time_s", *(f"{title} ({unit})" for title, unit in zip(about["ChannelTitle="], units, strict=False))]
    else:
        header = rows.pop(min(rows)) if rows else []
    header = [_standard_name(name) for name in header]
    if delimiter != ",":
        rows = {i: [cell.replace(",", ".") for cell in row] for i, row in rows.items()}
    return header, {i: dict(zip(header, row, strict=False)) for i, row in rows.items()}


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
