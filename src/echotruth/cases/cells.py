"""Values in the cells of a table, which has text alone: each is read as what its key takes."""

import json
import re
from math import isfinite
from typing import Any, Literal, get_args, get_origin

from echotruth.config import Section

_INTEGER = re.compile(r"[+-]?\d{1,18}")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")
_WORDS = {"true": True, "false": False, "TRUE": True, "FALSE": False, "True": True, "False": False, "null": None}


class CellError(ValueError):
    """Raised if a cell has no value; the message says what would be right."""


def types(section: Section, key: str) -> frozenset[type]:
    """Types of the values that a key takes, without those in lists.

    Parameters
    ----------
    section : Section
    key : str
        A key in it.
    """
    return frozenset(_types(type(section).model_fields[key].annotation))


def value(cell: str, allowed: frozenset[type]) -> Any:
    """Value of a cell that is not empty.

    Parameters
    ----------
    cell : str
    allowed : frozenset of type
        Types of the values that the key takes, as :func:`types` gives them.

    Returns
    -------
    object
        Of a key that takes text and no numbers, the text. Otherwise a number, `true`, `false`, `null`, a list or a
        mapping as JSON writes them, or else the text, which the key then refuses.

    Raises
    ------
    CellError
        If it begins a list or a mapping that does not end.
    """
    if cell == "null":
        return None
    if str in allowed and not allowed & {int, float}:
        return cell
    if cell in _WORDS:
        return _WORDS[cell]
    return _nested(cell) if cell[0] in "[{" else _number_or_text(cell, allowed)


def number(cell: str) -> float | None:
    """The finite number in a cell; None if there is none."""
    found = float(cell) if len(cell) < 400 and _NUMBER.fullmatch(cell) else None
    return found if found is not None and isfinite(found) else None


def written(value: Any) -> str:
    """Cell with a value, which is read back as the same."""
    return value if isinstance(value, str) else json.dumps(value)


def _number_or_text(cell: str, allowed: frozenset[type]) -> int | float | str:
    if _INTEGER.fullmatch(cell):
        return int(cell)
    found = number(cell)
    if found is None:
        return cell
    # A column of whole numbers in which cells are empty is often saved with decimal points.
    return int(found) if found.is_integer() and float not in allowed else found


def _nested(cell: str) -> Any:
    try:
        return json.loads(cell, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise CellError("must be a list or a mapping as JSON writes it, such as [7, 8]") from None


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _types(annotation: Any) -> list[type]:
    if get_origin(annotation) is Literal:
        return [type(item) for item in get_args(annotation)]
    if isinstance(annotation, type):
        return [annotation]
    if get_origin(annotation) in (list, tuple, dict):
        return []
    return [found for inner in get_args(annotation) for found in _types(inner)]
