"""Reading a configuration file, and saying in one sentence what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args, get_origin

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from echotruth.config.sections import Config
from echotruth.materials import Material
from echotruth.section import Section, chooser, kinds


class ConfigError(ValueError):
    """A configuration that cannot be run; the message names file, key, value and remedy."""


class _StrictLoader(yaml.SafeLoader):
    """YAML in which a key may stand only once in a mapping."""


def _mapping(loader: _StrictLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    keys = [loader.construct_object(key, deep=True) for key, _ in node.value]
    for key in keys:
        if keys.count(key) > 1:
            raise yaml.MarkedYAMLError(problem=f"key {key!r} stands twice", problem_mark=node.start_mark)
    return dict(zip(keys, (loader.construct_object(value, deep=True) for _, value in node.value), strict=True))


_StrictLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)


def load(path: str | Path) -> Config:
    """Read and check a configuration file.

    Parameters
    ----------
    path : str or Path
        A YAML file; keys not given take their defaults.

    Raises
    ------
    ConfigError
        Where the file cannot be read or holds what cannot be run.
    """
    path = Path(path)
    return validate(_read(path), str(path))


def validate(values: dict[str, Any], source: str) -> Config:
    """Check the values of a configuration; `source` names them in errors."""
    try:
        return Config.model_validate(_tuples(values))
    except ValidationError as error:
        raise ConfigError(f"{source}: {_sentence(error.errors()[0])}") from None


def resolved(config: Config, changes: dict[str, Any], source: str = "cases") -> Config:
    """The configuration with the values of some dotted keys (as `fibres.endo_deg`) replaced."""
    values = config.model_dump()
    # The law first: it settles which other keys there are.
    for dotted, value in sorted(changes.items(), key=lambda change: not change[0].endswith(".law")):
        *parents, leaf = dotted.split(".")
        section = values
        for parent in parents:
            section = section[parent]
        if leaf == "law" and value != section[leaf]:
            for own in set(section) - set(Material.model_fields):
                del section[own]
        section[leaf] = value
    return validate(values, source)


def _read(path: Path) -> dict[str, Any]:
    try:
        values = yaml.load(path.read_text(encoding="utf-8"), Loader=_StrictLoader)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}): give the path of a YAML file") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text: give the path of a YAML file") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "is not YAML"
        raise ConfigError(f"{path}{place}: {problem}: mend the YAML") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: holds {type(values).__name__}, where a mapping of keys to values is needed")
    return values


def _tuples(values: Any) -> Any:
    """YAML knows no tuples; the strict models ask for one under `downsampling`."""
    if isinstance(values, dict) and isinstance(values.get("bmode"), dict):
        bmode = values["bmode"]
        if isinstance(bmode.get("downsampling"), list):
            return values | {"bmode": bmode | {"downsampling": tuple(bmode["downsampling"])}}
    return values


def _sentence(error: ErrorDetails) -> str:
    context = error.get("ctx", {})
    place, model, choices = _walked([part for part in error["loc"] if part != "[key]"])
    if error["type"] == "impossible":
        place.append(context["key"])
    if error["type"] in _NO_SUCH_KIND:
        by = chooser(choices)
        return f"{'.'.join(place)}.{by} = {error['input'][by]!r}: should be {_either(choices)}"
    key = ".".join(str(part) for part in place)
    if error["type"] == "extra_forbidden":
        return f"{key} is not a key{_of_kind(model, choices)}{_nearest(place, list(model.model_fields))}"
    value = context["value"] if error["type"] == "impossible" else error["input"]
    text = "null" if value is None else repr(value)
    return f"{key} = {text[:80]}: {_remedy(error, context)}"


def _of_kind(model: type[BaseModel], choices: dict[str, type[Section]]) -> str:
    """Which kind a section is of, and which others there are; empty where there is but one."""
    if not choices:
        return ""
    by = chooser(choices)
    mine = model.model_fields[by].default
    return f" of the {by} {mine} (others: {', '.join(name for name in choices if name != mine)})"


def _remedy(error: ErrorDetails, context: dict[str, Any]) -> str:
    message = _PLAIN.get(error["type"], error["msg"])
    if error["type"] == "string_pattern_mismatch":
        return f"use letters, digits and underscores only (pattern {context['pattern']})"
    return message.removeprefix("Input ").removeprefix("Value error, ")


_PLAIN = {
    "model_type": "must be a mapping of keys to values",
    "dict_type": "must be a mapping of names to settings",
    "list_type": "must be a list, as [1, 2]",
    "tuple_type": "must be a list, as [1, 2, 4]",
    "too_short": "must hold at least one entry",
}
"""Words for what pydantic says in the terms of Python."""


_NO_SUCH_KIND = ("union_tag_invalid", "union_tag_not_found")


def _nearest(place: list[Any], keys: list[str]) -> str:
    close = get_close_matches(str(place[-1]), keys, n=1, cutoff=0.5)
    if close:
        return f": did you mean {'.'.join(map(str, [*place[:-1], close[0]]))}?"
    return f": the keys here are {', '.join(keys)}"


def _either(names: Iterable[str]) -> str:
    *first, last = map(repr, names)
    return f"{', '.join(first)} or {last}"


def _walked(place: list[Any]) -> tuple[list[Any], type[BaseModel], dict[str, type[Section]]]:
    """The place as the user writes it, the section it lies in, and the kinds of section that could stand there.

    Pydantic puts the name of the kind in the place, between `material` and its key, or after the name of a tracker.
    """
    model, written, choices = Config, [], {}
    parts = iter(place)
    for part in parts:
        written.append(part)
        if part not in model.model_fields:
            continue
        annotation = model.model_fields[part].annotation
        choices, model = kinds(annotation), _section_of(annotation) or model
        # The name of a view or tracker is the user's own: its section is that of the mapping.
        if get_origin(annotation) is dict and (name := next(parts, None)) is not None:
            written.append(name)
        if choices and (kind := next(parts, None)) is not None:
            model = choices[kind]
    return written, model, choices


def _section_of(annotation: Any) -> Any:
    """The section inside an annotation such as `dict[str, View]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    sections = [_section_of(inner) for inner in get_args(annotation)]
    return next((section for section in sections if section is not None), None)
