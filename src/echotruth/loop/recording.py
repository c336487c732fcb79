"""A recorded cycle: the columns of a CSV file, each with its unit in its name."""

from __future__ import annotations

import csv
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
"""Quantity to the units in which a column may give it."""

_LEAST_ROWS = 4


class LoopError(ValueError):
    """A cycle that cannot drive a heart; the message names file, place, value and remedy."""


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
        """Values of a quantity in SI units, (n_rows,); None where the file has none."""
        if quantity not in self.names:
            return None
        return self.columns[quantity] * UNITS[self.names[quantity].removeprefix(f"{quantity}_")]


def read(path: Path, purpose: str, needed: tuple[str, ...], welcome: tuple[str, ...] = ()) -> Recording:
    """Read columns of a file.

    Parameters
    ----------
    path : Path
        CSV; blank lines and lines that begin with # are passed over, the first other line names the columns.
    purpose : str
        What the columns are needed for, in errors.
    needed, welcome : tuple of str
        Quantities that the file must have, and those that are read where it has them.

    Raises
    ------
    LoopError
        Where the file cannot be read, lacks a column or gives a quantity twice, or a cell is no number.
    """
    lines = [(i, line) for i, line in enumerate(_text(path), 1) if line.strip() and not line.startswith("#")]
    head = [name.strip() for name in lines[0][1].split(",")] if lines else []
    found = {quantity: _column(path, head, quantity) for quantity in (*needed, *welcome)}
    for quantity in needed:
        if not found[quantity]:
            choice = " or ".join(f"{quantity}_{unit}" for unit in COLUMNS[quantity])
            need = f"there is no column of the {quantity}, which {purpose} needs"
            raise LoopError(f"{path}: {need}; add one and name it {choice}.")
    names = {quantity: name for quantity, name in found.items() if name}
    cells = list(csv.reader(line for _, line in lines[1:]))
    if len(cells) < _LEAST_ROWS:
        raise LoopError(f"{path}: there are {len(cells)} rows; a cycle needs {_LEAST_ROWS} or more.")
    columns = {
        quantity: np.array(
            [_number(f"{path}, line {line}", row, head, name) for (line, _), row in zip(lines[1:], cells, strict=True)]
        )
        for quantity, name in names.items()
    }
    return Recording(path, names, columns)


def _text(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise LoopError(f"{path}: is not UTF-8 text; give a CSV file.") from None
    except OSError as error:
        raise LoopError(f"{path}: cannot be read ({error.strerror}); give the path of a CSV file.") from None


def _column(path: Path, head: list[str], quantity: str) -> str:
    """Name of the one column of a quantity; empty where there is none."""
    known = [f"{quantity}_{unit}" for unit in COLUMNS[quantity]]
    names = [name for name in head if name in known]
    if len(names) > 1:
        raise LoopError(f"{path}: the columns {names[0]} and {names[1]} both give the {quantity}; keep one of them.")
    return names[0] if names else ""


def _number(place: str, row: list[str], head: list[str], name: str) -> float:
    column = head.index(name)
    text = row[column].strip() if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise LoopError(f"{place}: {name} is {text!r}; give a finite number.")
    return value
