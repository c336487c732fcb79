"""Stable ids of hearts."""

import json
from functools import cache
from hashlib import sha256
from typing import Any

from echotruth.units import unit_of

READABLE_LENGTH = 40
"""Longest readable part of an id, letters."""
GIVEN_LENGTH = 80
"""Longest id in a table, letters; names of files have room for it and for what a grid or draws add."""
GIVEN = r"[A-Za-z0-9][A-Za-z0-9_.-]*"
"""What an id in a table looks like: it is part of the names of files."""


def case_id(parameters: dict[str, Any]) -> str:
    """Id of a case: readable values of the swept keys in which it differs, and a hash of the exact ones.

    Numbers have four digits. Keys that do not fit are left out, and then the hash is longer.

    >>> case_id({"fibres.endo_deg": 70.0, "seed": 2})
    'endo70_seed2_17059c'
    """
    if not parameters:
        return "heart"
    values = {key: integer_if_whole(value) for key, value in sorted(parameters.items())}
    parts = [f"{_short_key(key)}{_short_value(value)}" for key, value in values.items()]
    fitting: list[str] = []
    for part in parts:
        if len("_".join([*fitting, part])) <= READABLE_LENGTH:
            fitting.append(part)
    digits = 6 if fitting == parts else 16
    readable = fitting or [parts[0][:READABLE_LENGTH]]
    return "_".join([*readable, sha256(json.dumps(values).encode()).hexdigest()[:digits]])


def extended_id(given: str, parameters: dict[str, Any]) -> str:
    """Id of a row of the table with values of the grid or of a draw: its own, and theirs if they differ.

    >>> extended_id("patient7", {"seed": 2})
    'patient7_seed2_b105c5'
    """
    return f"{given}_{case_id(parameters)}" if parameters else given


def exact(value: Any) -> str:
    """Text that is the same for all spellings of a value, and for no other value."""
    return json.dumps(integer_if_whole(value), sort_keys=True, default=repr)


def integer_if_whole(value: Any) -> Any:
    """Convert 84.0 to 84, also within lists and mappings, so that both spellings give the same id."""
    if isinstance(value, dict):
        return {key: integer_if_whole(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [integer_if_whole(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


@cache
def _short_key(key: str) -> str:
    name = key.rsplit(".", 1)[-1]
    return name.removesuffix(f"_{unit_of(name)}").replace("_", "")


def _short_value(value: Any) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return "".join(letter for letter in text if letter.isalnum() or letter in ".-")
