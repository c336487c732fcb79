"""What a key may be, in words, from the JSON schema of its section."""

from functools import cache
from typing import Any

from pydantic import BaseModel

UNBOUNDED = 1e12
"""Largest number of :data:`echotruth.section.Positive`, which only guards against overflow."""


def allowed(model: type[BaseModel], key: str) -> str:
    """What a key of a section may be: its choices or its limits; "" if its type says it all.

    Parameters
    ----------
    model : type
        The section.
    key : str
        One of its keys.

    Examples
    --------
    >>> from echotruth.config import Geometry
    >>> allowed(Geometry, "transmural_elements")
    'whole number from 1 to 20'
    """
    options = _schema(model)["properties"][key]
    parts = [_words(option) for option in options.get("anyOf", [options])]
    return " or ".join(part for part in parts if part)


@cache
def _schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def _words(schema: dict[str, Any]) -> str:
    if "enum" in schema:
        return f"one of {', '.join(map(str, schema['enum']))}"
    kind = schema.get("type")
    if kind == "boolean":
        return "true or false"
    if kind in ("integer", "number"):
        return " ".join(filter(None, ["whole number" if kind == "integer" else "number", _limits(schema)]))
    if kind == "array":
        return _list(schema)
    return ""


def _limits(schema: dict[str, Any]) -> str:
    low, high = schema.get("minimum"), schema.get("maximum")
    above, below = schema.get("exclusiveMinimum"), schema.get("exclusiveMaximum")
    high, below = (limit if limit is None or abs(limit) < UNBOUNDED else None for limit in (high, below))
    parts = [f"from {low:.12g} to {high:.12g}"] if low is not None and high is not None else []
    if not parts:
        words = (("above", above), ("not below", low), ("not above", high))
        parts = [f"{word} {limit:.12g}" for word, limit in words if limit is not None]
    if below is not None:
        parts.append(f"below {below:.12g}")
    if "multipleOf" in schema:
        parts.append(f"a multiple of {schema['multipleOf']}")
    return ", ".join(parts)


def _list(schema: dict[str, Any]) -> str:
    """A list, how many entries it has, and what they are."""
    least, most = schema.get("minItems", 0), schema.get("maxItems")
    number = f" of {most}" if least == most else f" of {least} or more" if least else ""
    items = schema.get("items") or {}
    inner = _words(items) if isinstance(items, dict) and "anyOf" not in items else ""
    return f"list{number}" + (f", each {inner}" if inner else "")
