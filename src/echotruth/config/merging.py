"""Merging of configurations before validation, and what differs between them."""

from typing import Any

NAMED = ("views", "trackers", "cases", "prior")
"""Mappings of names that the user gives: one that is given replaces the other."""
VALUES = ("cases", "prior", "options", "delay_ms", "contractility", "stiffness")
"""Mappings that are one value of a dotted key, as a sweep gives it."""
OF_ALL_LAWS = ("stiffness_kPa",)
"""Keys that a material keeps when its law changes."""


def nested(keys: dict[str, Any]) -> dict[str, Any]:
    """The mapping of sections in which dotted keys have their values."""
    found: dict[str, Any] = {}
    for dotted_key, value in keys.items():
        *parents, key = dotted_key.split(".")
        section = found
        for parent in parents:
            section = section.setdefault(parent, {})
        section[key] = value
    return found


def merged(base: dict[str, Any], changes: dict[str, Any], whole: tuple[str, ...] = NAMED) -> dict[str, Any]:
    """A configuration with changes laid over it, section by section; neither is changed.

    Parameters
    ----------
    base, changes : dict
        Key -> value or section. A section that is a model replaces the other. Another law leaves out the parameters of
        the one before, so that its own take their defaults.
    whole : tuple of str
        Keys of mappings of which one replaces the other.
    """
    if "law" in base and changes.get("law", base["law"]) != base["law"]:
        base = {key: base[key] for key in OF_ALL_LAWS if key in base}
    found = dict(base)
    for key, value in changes.items():
        old: Any = base.get(key)
        merges = isinstance(value, dict) and isinstance(old, dict) and key not in whole
        found[key] = merged(old, value, whole) if merges else value
    return found


def difference(values: dict[str, Any], base: dict[str, Any]) -> dict[str, Any]:
    """The changes that make `values` of `base` by :func:`merged`."""
    found = {}
    for key, value in values.items():
        other: Any = base.get(key)
        are_sections = isinstance(value, dict) and isinstance(other, dict) and key not in NAMED
        if are_sections and value.get("law") == other.get("law"):
            if inner := difference(value, other):
                found[key] = inner
        elif value != other:
            found[key] = value
    return found
