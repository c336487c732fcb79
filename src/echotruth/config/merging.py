"""Merging of sections before validation: of what is given with defaults or other keys, and what differs from them."""

from typing import Any

NAMED = ("views", "trackers", "cases", "prior")
"""Mappings of names that the user gives: one that is given replaces the other."""
KINDS = ("law", "method")
"""Keys that decide which other keys a section has."""


def nested(dotted_key: str, value: Any) -> dict[str, Any]:
    """The mapping in which a dotted key has a value."""
    for key in reversed(dotted_key.split(".")):
        value = {key: value}
    return value


def merged(values: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    """Values with those given in place of theirs, section by section; a section that is a model replaces the other."""
    found = dict(values)
    for key, value in given.items():
        old: Any = values.get(key)
        merges = isinstance(value, dict) and isinstance(old, dict) and key not in NAMED
        if merges and all(old.get(kind) == value.get(kind, old.get(kind)) for kind in KINDS):
            found[key] = merged(old, value)
        else:
            found[key] = value
    return found


def difference(values: dict[str, Any], default: dict[str, Any]) -> dict[str, Any]:
    """Keys of values that differ from the default, section by section; a section of another kind is whole."""
    found = {}
    for key, value in values.items():
        other = default.get(key)
        if isinstance(value, dict) and isinstance(other, dict) and key not in NAMED:
            if any(value.get(kind) != other.get(kind) for kind in KINDS):
                found[key] = value
            elif inner := difference(value, other):
                found[key] = inner
        elif value != other:
            found[key] = value
    return found
