"""Merging of sections before they are validated: of what is given with defaults, or with other keys."""

from typing import Any

NAMED = ("views", "trackers", "cases")
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
