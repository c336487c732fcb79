"""Read and check configuration files; errors name file, key, value and remedy in one sentence."""

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
from echotruth.section import Section, discriminator, variants


class ConfigError(ValueError):
    """Raised if a configuration cannot be run; the message names file, key, value and remedy."""


class _StrictLoader(yaml.SafeLoader):
    """YAML loader that refuses duplicate keys in a mapping."""


def _mapping(loader: _StrictLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    keys = [loader.construct_object(key, deep=True) for key, _ in node.value]
    for key in keys:
        if keys.count(key) > 1:
            raise yaml.MarkedYAMLError(problem=f"key {key!r} is given twice", problem_mark=node.start_mark)
    return dict(zip(keys, (loader.construct_object(value, deep=True) for _, value in node.value), strict=True))


_StrictLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)


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
    try:
        return Config.model_validate(_with_tuples(values))
    except ValidationError as error:
        raise ConfigError(f"{source}: {_message(error.errors()[0])}") from None


def override(config: Config, changes: dict[str, Any], source: str = "cases") -> Config:
    """Configuration with the values of some dotted keys (such as `fibres.endo_deg`) replaced."""
    values = config.model_dump()
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
    return validate(values, source)


def read_yaml(path: Path) -> dict[str, Any]:
    try:
        values = yaml.load(path.read_text(encoding="utf-8"), Loader=_StrictLoader)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}): give the path of a YAML file") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text: give the path of a YAML file") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "is not YAML"
        raise ConfigError(f"{path}{line}: {problem}: correct the YAML") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: contains a {type(values).__name__}: write a mapping of keys to values")
    return values


def _with_tuples(values: Any) -> Any:
    """Convert `bmode.downsampling` to the tuple that the strict model requires; YAML has only lists."""
    if isinstance(values, dict) and isinstance(values.get("bmode"), dict):
        bmode = values["bmode"]
        if isinstance(bmode.get("downsampling"), list):
            return values | {"bmode": bmode | {"downsampling": tuple(bmode["downsampling"])}}
    return values


def _message(error: ErrorDetails) -> str:
    context = error.get("ctx", {})
    keys, model, sections = _locate([part for part in error["loc"] if part != "[key]"])
    if error["type"] == "invalid":
        keys.append(context["key"])
    if error["type"] in _UNKNOWN_VARIANT:
        selector = discriminator(sections)
        return f"{'.'.join(keys)}.{selector} = {error['input'][selector]!r}: should be {_alternatives(sections)}"
    dotted_key = ".".join(str(part) for part in keys)
    if error["type"] == "extra_forbidden":
        return f"{dotted_key} is not a key{_variant(model, sections)}{_suggestion(keys, list(model.model_fields))}"
    value = context["value"] if error["type"] == "invalid" else error["input"]
    text = "null" if value is None else repr(value)
    return f"{dotted_key} = {text[:80]}: {_remedy(error, context)}"


def _variant(model: type[BaseModel], sections: dict[str, type[Section]]) -> str:
    """Names the variant of a section and the others; empty if the section has no variants."""
    if not sections:
        return ""
    selector = discriminator(sections)
    current = model.model_fields[selector].default
    return f" of the {selector} {current} (others: {', '.join(name for name in sections if name != current)})"


def _remedy(error: ErrorDetails, context: dict[str, Any]) -> str:
    message = _MESSAGES.get(error["type"], error["msg"])
    if error["type"] == "string_pattern_mismatch":
        return f"use letters, digits and underscores only (pattern {context['pattern']})"
    return message.removeprefix("Input ").removeprefix("Value error, ")


_MESSAGES = {
    "model_type": "must be a mapping of keys to values",
    "dict_type": "must be a mapping of names to settings",
    "list_type": "must be a list, such as [1, 2]",
    "tuple_type": "must be a list, such as [1, 2, 4]",
    "too_short": "must have at least one entry",
}
"""Error type of pydantic -> message in the terms of YAML."""


_UNKNOWN_VARIANT = ("union_tag_invalid", "union_tag_not_found")


def _suggestion(keys: list[Any], known: list[str]) -> str:
    close = get_close_matches(str(keys[-1]), known, n=1, cutoff=0.5)
    if close:
        return f": did you mean {'.'.join(map(str, [*keys[:-1], close[0]]))}?"
    return f": the keys here are {', '.join(known)}"


def _alternatives(names: Iterable[str]) -> str:
    *first, last = map(repr, names)
    return f"{', '.join(first)} or {last}"


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
        sections, model = variants(annotation), _section_of(annotation) or model
        # Views and trackers have names that the user chose; their section is that of the mapping.
        if get_origin(annotation) is dict and (name := next(parts, None)) is not None:
            keys.append(name)
        if sections and (variant := next(parts, None)) is not None:
            model = sections[variant]
    return keys, model, sections


def _section_of(annotation: Any) -> Any:
    """Section in an annotation such as `dict[str, View]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    sections = [_section_of(inner) for inner in get_args(annotation)]
    return next((section for section in sections if section is not None), None)
