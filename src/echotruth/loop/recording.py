"""A recorded cycle, read from a CSV file whose columns have their units in their names."""

import csv
import re
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from echotruth.arrays import Floats
from echotruth.units import UNITS

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
    header, rows = _table(path)
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
        quantity: np.array([_number(f"{path}, line {i}", name, row[header.index(name)]) for i, row in rows.items()])
        for quantity, name in names.items()
    }
    return Recording(path, names, columns)


def _table(path: Path) -> tuple[list[str], dict[int, list[str]]]:
    """Names of the columns of the file, and the cells of each row by the number of its line."""
    lines = {i: line for i, line in enumerate(_text(path), 1) if line.strip() and not line.startswith("#")}
    if not lines:
        raise LoopError(f"{path}: is empty; give a CSV file.")
    separator = next((mark for mark in "\t;" if mark in next(iter(lines.values()))), ",")
    try:
        cells = {i: next(csv.reader([line], delimiter=separator, strict=True)) for i, line in lines.items()}
    except csv.Error as error:
        raise LoopError(f"{path}: is no table ({error}); give a CSV file.") from None
    cells = {i: [cell.strip() for cell in row] for i, row in cells.items()}
    # LabChart writes lines such as "ChannelTitle=", then rows of the time in seconds and the channels.
    about = {name: others for name, *others in cells.values() if name.endswith("=")}
    rows = {i: row for i, row in cells.items() if not row[0].endswith("=")}
    if "ChannelTitle=" in about:
        channels = zip_longest(about["ChannelTitle="], about.get("UnitName=", []), fillvalue="")
        header = ["time_s", *(f"{title} ({unit})" for title, unit in channels)]
    else:
        header = rows.pop(min(rows, default=0), [])
    if separator != ",":
        rows = {i: [cell.replace(",", ".") for cell in row] for i, row in rows.items()}
    missing = {i: [""] * (len(header) - len(row)) for i, row in rows.items()}
    return [_standard_name(name) for name in header], {i: row + missing[i] for i, row in rows.items()}


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
