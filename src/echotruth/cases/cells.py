"""Values in the cells of a table, which has text alone: each is read as what its key takes."""

import json
import re
from contextlib import suppress
from math import isfinite
from typing import Any, Literal, get_args, get_origin

from echotruth.config import Section

_WORDS = {"true": True, "false": False, "TRUE": True, "FALSE": False, "True": True, "False": False, "null": None}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")


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
    ValueError
        If it begins a list or a mapping that does not end.
    """
    takes_text = str in allowed and not allowed & {int, float}
    words = {"null": None} if takes_text else _WORDS
    if takes_text or cell in words:
        return words.get(cell, cell)
    if cell[0] in "[{":
        try:
            return json.loads(cell)
        except (ValueError, RecursionError):
            raise ValueError("must be a list or a mapping as JSON writes it, such as [7, 8]") from None
    found = number(cell)
    if found is None:
        return cell
    with suppress(ValueError):
        return int(cell)
    # A column of whole numbers in which cells are empty is often saved with decimal points.
    return int(found) if found.is_integer() and float not in allowed else found


def number(cell: str) -> float | None:
    """The finite number in a cell; None if there is none."""
    found = float(cell) if len(cell) < 400 and _NUMBER.fullmatch(cell) else None
    return found if found is not None and isfinite(found) else None


def _types(annotation: Any) -> list[type]:
    if get_origin(annotation) is Literal:
        return [type(item) for item in get_args(annotation)]
    if isinstance(annotation, type):
        return [annotation]
    if get_origin(annotation) in (list, tuple, dict):
        return []
    return [found for inner in get_args(annotation) for found in _types(inner)]
