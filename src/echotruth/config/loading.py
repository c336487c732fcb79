"""Read and check configuration files; errors name file, key, value and remedy in one sentence."""

import re
from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from reprlib import Repr
from typing import Any, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from echotruth.config.reading import ConfigError, Errors, check_size, read_yaml, shown_key
from echotruth.config.sections import Config
from echotruth.materials import Material
from echotruth.section import Section, discriminator, section_in, variants

__all__ = ["ConfigError", "load", "override", "read_yaml", "replace_values", "validate"]


def load(path: str | Path) -> Config:
    """Read and check a configuration file.

    Parameters
    ----------
    path : str or Path
        YAML file; keys that it does not give take their defaults.

    Raises
    ------
    ConfigError
        If the file cannot be read or its configuration is not valid.
    """
    path = Path(path)
    return validate(read_yaml(path), str(path))


def validate(values: dict[str, Any], source: str) -> Config:
    """Check the values of a configuration; errors name their `source`."""
    if isinstance(values, dict):
        check_size(values, source)
    try:
        return Config.model_validate(_without_empty(values, Config))
    except ValidationError as error:
        errors = Errors()
        for each in _distinct(error.errors()):
            errors.add(f"{source}: {_message(each)}")
        raise errors.joined(source) from None


def override(config: Config, changes: dict[str, Any], source: str = "cases") -> Config:
    """Configuration with the values of some dotted keys (such as `fibres.endo_deg`) replaced."""
    return validate(replace_values(config.given(), changes), source)


def replace_values(values: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Replace the values of some dotted keys in a dumped section, in place.

    Another law leaves out the parameters of the present one, so that its own take their defaults.
    """
    # The law comes first, because it determines which other keys the section has.
    for dotted_key, value in sorted(changes.items(), key=lambda change: not change[0].endswith(".law")):
        *parents, key = dotted_key.split(".")
        section = values
        for parent in parents:
            section = section[parent]
        if key == "law" and value != section[key]:
            for parameter in set(section) - set(Material.model_fields):
                del section[parameter]
        section[key] = value
    return values


def _without_empty(values: Any, model: type[BaseModel]) -> Any:
    """Leave out sections of which nothing is given, as YAML has them if all their keys are commented out."""
    if not isinstance(values, dict):
        return values
    found = {}
    for key, value in values.items():
        annotation = model.model_fields[key].annotation if key in model.model_fields else None
        section = annotation if isinstance(annotation, type) and issubclass(annotation, Section) else None
        if value is not None or not (section or (variants(annotation) and get_origin(annotation) is not dict)):
            found[key] = _without_empty(value, section) if section else value
    return found


def _distinct(errors: list[ErrorDetails]) -> list[ErrorDetails]:
    """One error of each value: pydantic tells one for each type that it may have."""
    found: dict[tuple[Any, ...], ErrorDetails] = {}
    for number, error in enumerate(errors):
        location = _without_type(list(error["loc"]))
        found.setdefault((number,) if error["type"] == "invalid" else tuple(location), error)
    # A key that is not one explains what else is wrong.
    return sorted(found.values(), key=lambda error: error["type"] != "extra_forbidden")


def _without_type(location: list[Any]) -> list[Any]:
    """Location without the type that follows the number of an entry of a list, if it may have several."""
    *place, last = location or [None]
    return place if last in ("int", "str") and place and isinstance(place[-1], int) else location


def _message(error: ErrorDetails) -> str:
    context = error.get("ctx", {})
    keys, model, sections = _locate([part for part in _without_type(list(error["loc"])) if part != "[key]"])
    if error["type"] == "invalid":
        keys.append(context["key"])
    if error["type"] in _UNKNOWN_VARIANT:
        selector = discriminator(sections)
        value = _shown_value(error["input"][selector])
        return f"{shown_key(keys)}.{selector} = {value}: should be {_joined([repr(name) for name in sections])}"
    dotted_key = shown_key(keys)
    if error["type"] == "extra_forbidden":
        return f"{dotted_key} is not a key{_variant(model, sections)}{_suggestion(keys, model, bool(sections))}"
    if error["type"] == "missing":
        return f"{dotted_key} is missing: it must be given"
    value = context["value"] if error["type"] == "invalid" else error["input"]
    given = f"{dotted_key} = {_shown_value(value)}" if keys else _shown_value(value)
    if error["type"].startswith("string_") and error["loc"][-1:] == ("[key]",):
        given = f"{shown_key(keys[:-1])}: the name {_shown_value(value)}"
    return f"{given}: {_remedy(error, context)}"


def _shown_value(value: Any) -> str:
    """The value in one line of at most 80 characters, as it is in the file."""
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    text = _REPR.repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _variant(model: type[BaseModel], sections: dict[str, type[Section]]) -> str:
    """Names the variant of a section and the others; empty if the section has no variants."""
    if not sections:
        return ""
    selector = discriminator(sections)
    current = model.model_fields[selector].default
    return f" of the {selector} {current} (others: {', '.join(name for name in sections if name != current)})"


def _remedy(error: ErrorDetails, context: dict[str, Any]) -> str:
    message = _MESSAGES.get(context.get("class_name", "")) or _MESSAGES.get(error["type"], error["msg"])
    if error["type"] in ("int_type", "float_type", "bool_type", "string_type"):
        return f"{message}{_written(error['type'], error['input'])}"
    if error["type"] == "list_type" and isinstance(error["input"], str | int | float):
        return f"must be a list, such as [{_shown_value(error['input'])}]"
    if error["type"] == "string_pattern_mismatch":
        is_file_name = ".-]" in context["pattern"]
        signs, first = ("`_`, `.` and `-`", "letter or digit") if is_file_name else ("underscores", "letter")
        return f"use letters, digits{',' if is_file_name else ' and'} {signs} only, and begin with a {first}"
    if error["type"] == "too_long":
        return f"must have at most {context['max_length']} entries"
    if error["type"] == "too_short" and context["min_length"] > 1:
        return f"must have {context['min_length']} entries or more"
    return message.removeprefix("Input ").removeprefix("String ").removeprefix("Value error, ")


def _written(wanted: str, value: Any) -> str:
    """How YAML writes what was probably meant by a value of the wrong type; "" if that is not known."""
    if wanted == "string_type" and isinstance(value, bool | int | float):
        return ": put it in quotes"
    text = value.strip() if isinstance(value, str) else ""
    if wanted == "int_type" and _NUMBER.fullmatch(text) and float(text).is_integer():
        return f": write {float(text):.0f} without quotes"
    quoted = (wanted == "float_type" and _NUMBER.fullmatch(text)) or (wanted == "bool_type" and text in _BOOLEANS)
    return f": write {text} without quotes" if quoted else ""


_BOOLEANS = ("true", "false")
_NUMBER = re.compile(r"[-+]?\d{1,15}(\.\d{0,15})?([eE][-+]?\d{1,2})?")
"""Text that people read as a number."""

_REPR = Repr()
_REPR.maxlevel, _REPR.maxlist, _REPR.maxdict, _REPR.maxtuple = 4, 12, 12, 12
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 80

_MESSAGES = {
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "model_type": "must be a mapping of keys to values",
    "Distribution": "must be a distribution, such as {uniform: [1, 2]}",
    "dict_type": "must be a mapping of names to settings",
    "list_type": "must be a list, such as [1, 2]",
    "tuple_type": "must be a list, such as [1, 2, 4]",
    "too_short": "must have at least one entry",
    "invalid_key": "is not a key: keys are text",
}
"""Error type of pydantic, or the section that it is not -> message in the terms of YAML."""


_UNKNOWN_VARIANT = ("union_tag_invalid", "union_tag_not_found")


def _suggestion(keys: list[Any], model: type[BaseModel], is_variant: bool) -> str:
    known = list(model.model_fields)
    key, place = str(keys[-1])[:200], "".join(f"{part}." for part in keys[:-1])
    close = get_close_matches(key, known, n=1, cutoff=0.6)
    if close and (close[0].startswith(f"{key}_") or get_close_matches(key, close, cutoff=0.8)):
        return f": did you mean {place}{close[0]}?"
    # It may be a key of another section, one in this section before others; or of another variant, which were named.
    elsewhere = [] if is_variant else _places().get(key, [])
    elsewhere = [found for found in elsewhere if found.startswith(place)] or elsewhere
    if 0 < len(elsewhere) <= MAX_SUGGESTIONS:
        return f": did you mean {_joined(elsewhere)}?"
    return f": did you mean {place}{close[0]}?" if close else f": the keys here are {', '.join(known)}"


MAX_SUGGESTIONS = 5
"""Largest number of keys of other sections that are named in place of one that is not known."""


@cache
def _places() -> dict[str, list[str]]:
    """Last part of every dotted key -> the keys that end in it."""
    found: dict[str, list[str]] = {}
    for dotted in dict.fromkeys(_dotted_keys(Config, "")):
        found.setdefault(dotted.rpartition(".")[2], []).append(dotted)
    return found


def _dotted_keys(model: type[BaseModel], prefix: str) -> Iterator[str]:
    """Dotted keys of a section, of those in it, and of their variants; NAME stands for a name that the user chooses."""
    for key, field in model.model_fields.items():
        yield f"{prefix}{key}"
        name = "NAME." if get_origin(field.annotation) is dict else ""
        section = section_in(field.annotation)
        for inner in variants(field.annotation).values() or ([section] if section else []):
            yield from _dotted_keys(inner, f"{prefix}{key}.{name}")


def _joined(names: list[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last


def _locate(location: list[Any]) -> tuple[list[Any], type[BaseModel], dict[str, type[Section]]]:
    """Keys as the user writes them, the section that contains the last one, and the variants of that section.

    The location that pydantic reports also contains the name of the variant: between `material` and its key, or after
    the name of a tracker.
    """
    model: type[BaseModel] = Config
    keys, sections = [], {}
    parts = iter(location)
    for part in parts:
        keys.append(part)
        if part not in model.model_fields:
            continue
        annotation = model.model_fields[part].annotation
        sections, model = variants(annotation), section_in(annotation) or model
        # Views and trackers have names that the user chose; their section is that of the mapping.
        if get_origin(annotation) is dict and (name := next(parts, None)) is not None:
            keys.append(name)
        if sections and (variant := next(parts, None)) is not None:
            model = sections[variant]
    return keys, model, sections
