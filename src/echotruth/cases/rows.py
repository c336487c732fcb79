"""Rows of the table as values of swept keys, ids, labels and notes; and hearts as such a table."""

import csv
import io
import re
from typing import Any

from echotruth.cases import cells
from echotruth.cases.case import Case, Combination, Label
from echotruth.cases.ids import GIVEN, GIVEN_LENGTH, LONGEST, integer_if_whole
from echotruth.config import Config
from echotruth.config.loading import ConfigError
from echotruth.config.reading import Errors
from echotruth.config.table import CASE, LABEL, NOTE, Table
from echotruth.section import value_of

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
    table = config.cases.rows
    if table is None:
        return [Combination({})]
    name = source_of(config)
    labels = _labels(table, f"{source}: {name}")
    # A table that stands alone may hold the ids that another one's draws gave, as that of merged repositories does.
    is_extended = config.cases.draw is not None or bool(config.cases.grid)
    ids = _ids(table, f"{source}: {name}", GIVEN_LENGTH if is_extended else LONGEST)
    notes = _column(table, NOTE)
    parameters = _parameters(config, table, f"{source}: {name}")
    return [
        Combination(values, ids[i], frozenset(values), f"{name}, row {table.numbers[i]}", labels[i], notes[i])
        for i, values in enumerate(parameters)
    ]


def as_table(cases: list[Case]) -> str:
    """The text of a table that makes the same hearts of the configuration without its sweep, under their ids.

    Parameters
    ----------
    cases : list of Case
    """
    keys = list(dict.fromkeys(key for case in cases for key in case.parameters))
    labels = list(dict.fromkeys(name for case in cases for name in case.labels))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([CASE, *keys, *(f"{LABEL}{name}" for name in labels), NOTE])
    for case in cases:
        values = [cells.written(case.parameters[key]) if key in case.parameters else "" for key in keys]
        carried = [_written_label(case.labels.get(name)) for name in labels]
        writer.writerow([case.id, *values, *carried, case.note])
    return text.getvalue()


def _written_label(label: Label) -> str:
    """Cell with a label; a whole number without a decimal point, as it stays so among labels that are text."""
    return "" if label is None else cells.written(integer_if_whole(label))


def _parameters(config: Config, table: Table, source: str) -> list[dict[str, Any]]:
    """Dotted key -> value of the cells that are not empty, in each row."""
    parameters: list[dict[str, Any]] = [{} for _ in table.cells]
    errors = Errors()
    for key in table.keys:
        allowed = _types(config, key)
        for number, values, cell in zip(table.numbers, parameters, _column(table, key), strict=True):
            if cell:
                with errors.collecting():
                    values[key] = _cell(cell, allowed, f"{source}, row {number}: {key}")
    errors.raise_all(source)
    return parameters


def _cell(text: str, allowed: frozenset[type], place: str) -> Any:
    try:
        return cells.value(text, allowed)
    except cells.CellError as error:
        raise ConfigError(f"{place} = {text[:80]!r}: {error}") from None


def _types(config: Config, dotted_key: str) -> frozenset[type]:
    section, _, key = dotted_key.rpartition(".")
    return cells.types(value_of(config, section) if section else config, key)


def _ids(table: Table, source: str, longest: int) -> list[str]:
    """Id of each row, empty if it has none; of so many letters at most."""
    rows: dict[str, int] = {}
    ids = _column(table, CASE)
    for number, id in zip(table.numbers, ids, strict=True):
        if id and (len(id) > longest or not re.fullmatch(GIVEN, id)):
            remedy = "use at most 80 letters without accents, digits, _, - and ., and begin with a letter or digit"
            raise ConfigError(f"{source}, row {number}: case = {id[:80]!r}: {remedy}")
        if id and rows.setdefault(id, number) != number:
            raise ConfigError(f"{source}, row {number}: case = {id} is the id of row {rows[id]} too: give it another")
    return ids


def _labels(table: Table, source: str) -> list[dict[str, Label]]:
    """Name -> value of the labels of each row."""
    labels: list[dict[str, Label]] = [{} for _ in table.cells]
    for column in table.labels:
        if not _LABEL.fullmatch(column):
            remedy = "name it label. and at most 40 letters without accents, digits and _, such as label.group"
            raise ConfigError(f"{source}, column {column[:80]!r}: {remedy}")
        texts = _column(table, column)
        numbers = [cells.number(text) for text in texts]
        numeric = all(number is not None or not text for number, text in zip(numbers, texts, strict=True))
        for row, number, text in zip(labels, numbers, texts, strict=True):
            row[column.removeprefix(LABEL)] = (number if numeric else text) if text else None
    return labels


def _column(table: Table, name: str) -> list[str]:
    """Cells of a column; empty ones if there is no such column."""
    if name not in table.columns:
        return [""] * len(table.cells)
    index = table.columns.index(name)
    return [row[index] for row in table.cells]
