"""Read and check configuration files; errors name file, key, value and remedy in one sentence."""

import re
from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from echotruth.config.merging import VALUES, merged, nested
from echotruth.config.reading import MAX_ERRORS, ConfigError, check_size, joined, read_yaml, shown_key
from echotruth.config.sections import Config
from echotruth.section import Section, discriminator, section_in, variants

Checked = TypeVar("Checked", bound=Section)

__all__ = ["ConfigError", "beside", "checked", "load", "override", "read_yaml", "validate"]


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
    return validate(beside(read_yaml(path), path), str(path))


def beside(values: dict[str, Any], *paths: Path) -> dict[str, Any]:
    """Values of configuration files, with the table in `cases.file` sought beside the file that names it, the last one.

    A table that none of the files names, as an option of Snakemake may, is sought in the working folder.
    """
    name = _table(values)
    folder = next((path.parent for path in reversed(paths) if name and _table(read_yaml(path)) == name), None)
    return values | {"cases": values["cases"] | {"file": str(folder / name)}} if name and folder else values


def _table(values: dict[str, Any]) -> str | None:
    """Value of `cases.file`, if it may be that of a file."""
    cases = values.get("cases")
    name = cases.get("file") if isinstance(cases, dict) else None
    return name if isinstance(name, str) else None


def validate(values: dict[str, Any], source: str) -> Config:
    """Check the values of a configuration; errors name their `source`."""
    return checked(values, source, Config)


def checked(values: dict[str, Any], source: str, section: type[Checked]) -> Checked:
    """Check the values of a section that has a file of its own, as :func:`validate` does."""
    if isinstance(values, dict):
        check_size(values, source)
    try:
        return section.model_validate(_without_empty(values, section))
    except ValidationError as error:
        enough = _distinct(error.errors())[: 10 * MAX_ERRORS]
        raise joined([f"{source}: {_message(each, section)}" for each in enough], source) from None


def override(config: Config, changes: dict[str, Any], source: str = "cases") -> Config:
    """Configuration with the values of some dotted keys (such as `fibres.endo_deg`) replaced."""
    return validate(merged(config.given(), nested(changes), VALUES), source)


def _without_empty(values: Any, model: type[BaseModel]) -> Any:
    """Leave out sections of which nothing is given, as YAML has them if all their keys are commented out."""
    if not isinstance(values, dict):
        return values
    sections = {key: type(field.default) for key, field in model.model_fields.items()}
    sections = {key: section for key, section in sections.items() if issubclass(section, Section)}
    return {
        key: _without_empty(value, sections[key]) if key in sections else value
        for key, value in values.items()
        if value is not None or key not in sections
    }


def _distinct(errors: list[ErrorDetails]) -> list[ErrorDetails]:
    """One error of each value: pydantic gives one for each type that it may have."""
    found: dict[Any, ErrorDetails] = {}
    for number, error in enumerate(errors):
        found.setdefault(number if error["type"] == "invalid" else tuple(_without_type(error["loc"])), error)
    # A key that is not one explains what else is wrong.
    return sorted(found.values(), key=lambda error: error["type"] != "extra_forbidden")


def _without_type(location: tuple[Any, ...]) -> list[Any]:
    """Location without the type that follows the number of an entry of a list, if it may have several."""
    *place, last = location or [None]
    return place if last in ("int", "str") and place and isinstance(place[-1], int) else list(location)


def _message(error: ErrorDetails, root: type[BaseModel]) -> str:
    kind, context, value = error["type"], error.get("ctx", {}), error["input"]
    keys, model, sections = _locate([part for part in _without_type(error["loc"]) if part != "[key]"], root)
    if kind == "invalid":
        keys, value = [*keys, context["key"]], context["value"]
    dotted_key = shown_key(keys)
    if kind.startswith("union_tag"):
        selector = discriminator(sections)
        names = _either([repr(name) for name in sections])
        return f"{dotted_key}.{selector} = {_shown_value(value[selector])}: should be {names}"
    if kind == "extra_forbidden":
        remedy = _RENAMED.get(dotted_key) or _suggestion(keys, model, bool(sections))
        return f"{dotted_key} is not a key{_variant(model, sections)}{remedy}"
    if kind == "missing":
        return f"{dotted_key} is missing: it must be given"
    given = f"{dotted_key} = {_shown_value(value)}" if keys else _shown_value(value)
    if kind.startswith("string_") and error["loc"][-1:] == ("[key]",):
        given = f"{shown_key(keys[:-1])}: the name {_shown_value(value)}"
    return f"{given}: {_remedy(kind, context, error['msg'])}"


def _shown_value(value: Any) -> str:
    """The value in one line of at most 80 characters, as it is in the file."""
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    text = repr(list(value) if isinstance(value, tuple) else value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _variant(model: type[BaseModel], sections: dict[str, type[Section]]) -> str:
    """Names the variant of a section and the others; empty if the section has no variants."""
    if not sections:
        return ""
    selector = discriminator(sections)
    current = model.model_fields[selector].default
    return f" of the {selector} {current} (others: {', '.join(name for name in sections if name != current)})"


def _remedy(kind: str, context: dict[str, Any], message: str) -> str:
    """What would be right, given what pydantic says of a value."""
    if kind == "string_pattern_mismatch":
        return _NAMES[".-]" in context["pattern"]]
    message = _MESSAGES.get(context.get("class_name", "")) or _MESSAGES.get(kind, message)
    return re.sub(r"^(Input|String|List|Dictionary|Value error,) ", "", message)


_MESSAGES = {
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "bool_type": "must be true or false",
    "string_type": "must be text: put it in quotes",
    "model_type": "must be a mapping of keys to values",
    "Distribution": "must be a distribution, such as {uniform: [1, 2]}",
    "dict_type": "must be a mapping of names to settings",
    "list_type": "must be a list, such as [1, 2]",
    "tuple_type": "must be a list, such as [1, 2, 4]",
    "invalid_key": "is not a key: keys are text",
}
"""Error type of pydantic, or the section that it is not -> message in the terms of YAML."""

_NAMES = (
    "use letters, digits and underscores only, and begin with a letter",
    "use letters, digits, `_`, `.` and `-` only, and begin with a letter or digit",
)
"""What names are made of, and those of files."""

_RENAMED = {"tracking.grid_px": ": write tracking.grid, over the side of the image: 0.01 for 5 px of 512"}
"""Key of earlier versions -> what to write in its place."""

MAX_SUGGESTIONS = 5
"""Largest number of keys of other sections that are named in place of one that is not known."""


def _suggestion(keys: list[Any], model: type[BaseModel], is_variant: bool) -> str:
    known = list(model.model_fields)
    key, place = str(keys[-1])[:200], "".join(f"{part}." for part in keys[:-1])
    close = get_close_matches(key, known, n=1, cutoff=0.6)
    found = [name for name in close if name.startswith(f"{key}_") or get_close_matches(key, close, cutoff=0.8)]
    if not found and not is_variant:
        # It may be a key of another section, one in this section before others.
        elsewhere = [dotted for dotted in _all_keys() if dotted.rpartition(".")[2] == key]
        elsewhere = [dotted for dotted in elsewhere if dotted.startswith(place)] or elsewhere
        if 0 < len(elsewhere) <= MAX_SUGGESTIONS:
            return f": did you mean {_either(elsewhere)}?"
    return f": did you mean {place}{close[0]}?" if close else f": the keys here are {', '.join(known)}"


@cache
def _all_keys() -> list[str]:
    return list(dict.fromkeys(_dotted_keys(Config, "")))


def _dotted_keys(model: type[BaseModel], prefix: str) -> Iterator[str]:
    """Dotted keys of a section, of those in it, and of their variants; NAME stands for a name that the user chooses."""
    for key, field in model.model_fields.items():
        yield f"{prefix}{key}"
        name = "NAME." if get_origin(field.annotation) is dict else ""
        section = section_in(field.annotation)
        for inner in variants(field.annotation).values() or ([section] if section else []):
            yield from _dotted_keys(inner, f"{prefix}{key}.{name}")


def _either(names: list[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last


def _locate(location: list[Any], model: type[BaseModel]) -> tuple[list[Any], type[BaseModel], dict[str, type[Section]]]:
    """Keys as the user writes them, the section that contains the last one, and the variants of that section.

    The location that pydantic reports also contains the name of the variant: between `material` and its key, or after
    the name of a tracker.
    """
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
