"""Base class of the sections of the configuration."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import pairwise
from textwrap import dedent
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    GetJsonSchemaHandler,
    StringConstraints,
    Tag,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError

Positive = Annotated[FiniteFloat, Field(gt=0, le=1e12)]
"""Bounded, so that no product of a few of them overflows."""
Fraction = Annotated[FiniteFloat, Field(ge=0, le=1)]
Angle = Annotated[FiniteFloat, Field(ge=-90, le=90)]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40)]


OF_ZARR = dict.fromkeys(("c", "zarr.json"), "is the name of a file or folder of Zarr: choose another")
"""Names that no group may have, and so no view, tracker or heart: readers would take it for chunks or metadata."""


def invalid(key: str, value: object, remedy: str) -> PydanticCustomError:
    """Validation error of a key whose value conflicts with other keys of its section."""
    return PydanticCustomError("invalid", "{remedy}", {"key": key, "value": value, "remedy": remedy})


Check = TypeVar("Check", bound=Callable[[Any], object])
_CHECK = "is_check"


def check(method: Check) -> Check:
    """Mark a method of a section that raises :func:`invalid` if its keys conflict; all that fail are shown at once."""
    setattr(method, _CHECK, True)
    return method


@cache
def _checks(section: type[Section]) -> list[Callable[[Section], object]]:
    """The checks of a section, in the order in which they are written."""
    return [method for kind in reversed(section.mro()) for method in vars(kind).values() if hasattr(method, _CHECK)]


@cache
def docstrings(section: type[BaseModel]) -> dict[str, str]:
    """Key -> the text below it. pydantic would read all sources at each import, which takes a third of its time."""
    found: dict[str, str] = {}
    for kind in reversed(section.mro()[: section.mro().index(BaseModel)]):
        (definition,) = ast.parse(dedent(inspect.getsource(kind))).body
        for field, text in pairwise(definition.body):  # type: ignore[attr-defined]
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                found[ast.unparse(field.target)] = inspect.cleandoc(str(text.value.value))
    return found


def section_in(annotation: Any) -> Any:
    """Section in an annotation such as `dict[str, View]`; None if there is none."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    sections = [section_in(inner) for inner in get_args(annotation)]
    return next((section for section in sections if section is not None), None)


def dotted_values(section: Section, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted key and value of every key of a section and of the sections in it."""
    for key in type(section).model_fields:
        value = getattr(section, key)
        if isinstance(value, Section):
            yield from dotted_values(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def value_of(section: Any, dotted_key: str) -> Any:
    """Value of a dotted key of a section, in which names of views or trackers may be parts of the key.

    Raises
    ------
    KeyError, TypeError, ValueError
        If there is no such key.
    """
    value = section
    for part in dotted_key.split("."):
        value = dict(value)[part]
    return value


def as_tuple(value: Any) -> Any:
    """Convert a list, which YAML has, to the tuple that the strict model requires."""
    return tuple(value) if isinstance(value, list) else value


def variants(annotation: Any) -> dict[str, type[Section]]:
    """Name -> section of the variants in a tagged union (laws of a material) or in a mapping to one (trackers)."""
    if get_origin(annotation) is dict:
        return variants(get_args(annotation)[1])
    if get_origin(annotation) is Annotated:
        return variants(annotation.__origin__)
    members = [member for member in get_args(annotation) if hasattr(member, "__metadata__")]
    return {tag.tag: member.__origin__ for member in members for tag in member.__metadata__ if isinstance(tag, Tag)}


def tagged(key: str, default: str, sections: Mapping[str, type[Section]]) -> Any:
    """Union of the variants of a section, by the name that a key has in each; without the key, the default one."""

    def name_of(values: Any) -> Any:
        return values.get(key, default) if isinstance(values, dict) else getattr(values, key, default)

    members = tuple(Annotated[section, Tag(name)] for name, section in sections.items())
    return Annotated[Union[members], Discriminator(name_of)]  # noqa: UP007


def discriminator(sections: dict[str, type[Section]]) -> str:
    """Key that selects the variant, such as `law` or `method`; its default in every variant is the variant's name."""
    name, section = next(iter(sections.items()))
    return next(key for key, field in section.model_fields.items() if field.default == name)


class Section(BaseModel):
    """A section of the configuration; it is immutable and refuses unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        schema, texts = handler(core_schema), docstrings(cls)
        for key, options in handler.resolve_ref_schema(schema).get("properties", {}).items():
            if key in texts and handler.resolve_ref_schema(options).get("description") != texts[key]:
                options.setdefault("description", texts[key])
        return schema

    def given(self) -> dict[str, Any]:
        """Keys and values from which the section can be made again with some of them changed."""
        sections = {key: value for key in type(self).model_fields if isinstance(value := getattr(self, key), Section)}
        return self.model_dump() | {key: section.given() for key, section in sections.items()}

    def require(self, holds: object, key: str, remedy: str) -> None:
        """Raise :func:`invalid` of a dotted key, with its value, unless a condition holds."""
        if not holds:
            raise invalid(key, value_of(self, key), remedy)

    def resolved(self) -> Section:
        """The section with every value filled in that follows from a preset."""
        return self

    @model_validator(mode="after")
    def _run_checks(self) -> Section:
        errors: list[PydanticCustomError] = []
        for run in _checks(type(self)):
            try:
                run(self)
            except PydanticCustomError as error:
                errors.append(error)
        if errors:
            details = [InitErrorDetails(type=error, input=None) for error in errors]
            raise ValidationError.from_exception_data(type(self).__name__, details)
        return self
