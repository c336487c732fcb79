"""Rows of the table as values of swept keys, ids, labels and notes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from echotruth.cases import cells
from echotruth.cases.case import Combination, Label
from echotruth.cases.ids import GIVEN, GIVEN_LENGTH
from echotruth.config import Config
from echotruth.config.loading import ConfigError
from echotruth.config.reading import Errors
from echotruth.config.table import CASE, LABEL, NOTE, labels, swept
from echotruth.section import OF_ZARR, value_of

if TYPE_CHECKING:
    import pandas as pd

_LABEL = re.compile(r"label\.[A-Za-z][A-Za-z0-9_]{0,39}")


def source_of(config: Config) -> str:
    """What errors call the table: its file, or the key that holds it."""
    return config.cases.file or "cases.table"


def combinations(config: Config, source: str) -> list[Combination]:
    """Each row of the table; one empty row if there is no table.

    Parameters
    ----------
    config : Config
        The keys of the table are checked (see :mod:`echotruth.cases.checks`).
    source : str
        What errors name.

    Raises
    ------
    ConfigError
        With file, row and column of a cell that is not valid, or of an id that is given twice.
    """
    table, name = config.cases.rows, source_of(config)
    if table is None:
        return [Combination({})]
    place = f"{source}: {name}"
    carried = _labels(table, place)
    ids = _ids(table, place)
    parts = zip(_parameters(config, table, place), ids, table.index, carried, _column(table, NOTE), strict=True)
    return [
        Combination(values, id, frozenset(values), f"{name}, row {number}", labels, note)
        for values, id, number, labels, note in parts
    ]


def _parameters(config: Config, table: pd.DataFrame, place: str) -> list[dict[str, Any]]:
    """Dotted key -> value of the cells that are not empty, in each row."""
    parameters: list[dict[str, Any]] = [{} for _ in table.index]
    errors = Errors()
    for key in swept(table):
        section, _, name = key.rpartition(".")
        allowed = cells.types(value_of(config, section) if section else config, name)
        for number, values, cell in zip(table.index, parameters, table[key], strict=True):
            try:
                if cell:
                    values[key] = cells.value(cell, allowed)
            except ValueError as error:
                errors.messages.append(f"{place}, row {number}: {key} = {cell[:80]!r}: {error}")
    errors.raise_all(place)
    return parameters


def _ids(table: pd.DataFrame, place: str) -> list[str]:
    """Id of each row, empty if it has none."""
    rows: dict[str, int] = {}
    ids = _column(table, CASE)
    for number, id in zip(table.index, ids, strict=True):
        if id and (len(id) > GIVEN_LENGTH or not re.fullmatch(GIVEN, id)):
            remedy = "use at most 80 letters without accents, digits, _, - and ., and begin with a letter or digit"
            raise ConfigError(f"{place}, row {number}: case = {id[:80]!r}: {remedy}")
        if id in OF_ZARR:
            raise ConfigError(f"{place}, row {number}: case = {id}: {OF_ZARR[id]}")
        if id and rows.setdefault(id, number) != number:
            raise ConfigError(f"{place}, row {number}: case = {id} is the id of row {rows[id]} too: give it another")
    return ids


def _labels(table: pd.DataFrame, place: str) -> list[dict[str, Label]]:
    """Name -> value of the labels of each row."""
    found: dict[str, list[Label]] = {}
    for column in labels(table):
        if not _LABEL.fullmatch(column):
            remedy = "name it label. and at most 40 letters without accents, digits and _, such as label.group"
            raise ConfigError(f"{place}, column {column[:80]!r}: {remedy}")
        values: list[Label] = [cells.number(cell) for cell in table[column]]
        if any(cell and value is None for cell, value in zip(table[column], values, strict=True)):
            values = [cell or None for cell in table[column]]
        found[column.removeprefix(LABEL)] = values
    return [{name: values[row] for name, values in found.items()} for row in range(len(table))]


def _column(table: pd.DataFrame, name: str) -> list[str]:
    """Cells of a column; empty ones if there is no such column."""
    return table[name].tolist() if name in table else [""] * len(table)
