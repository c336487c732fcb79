"""A part of the configuration.

Keys carry their unit; :meth:`Section.si` gives the values in SI units.
"""

from __future__ import annotations

from math import log, pi
from types import SimpleNamespace
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, StringConstraints, Tag
from pydantic_core import PydanticCustomError

UNITS: dict[str, float] = {
    "um": 1e-6,
    "mm": 1e-3,
    "per_mm3": 1e9,
    "dB_per_cm_MHz": log(10) / 20 / 1e-2 / 1e6,  # nepers per metre and hertz
    "uL": 1e-9,
    "mL": 1e-6,
    "m3": 1.0,
    "ms": 1e-3,
    "s": 1.0,
    "per_min": 1 / 60,
    "mmHg": 133.322387415,
    "kPa": 1e3,
    "Pa": 1.0,
    "kPa_per_mm": 1e6,
    "Pa_s": 1.0,
    "MHz": 1e6,
    "m_per_s": 1.0,
    "deg": pi / 180,
    "dB": 1.0,
}
"""Suffix of a key to the factor that makes its value SI (mmHg: NIST SP 811, appendix B.8; dB: to nepers)."""

Positive = Annotated[FiniteFloat, Field(gt=0)]
Angle = Annotated[FiniteFloat, Field(ge=-90, le=90)]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40)]


def impossible(key: str, value: object, remedy: str) -> PydanticCustomError:
    """An error about one key of a section whose value cannot stand beside its neighbours."""
    return PydanticCustomError("impossible", "{remedy}", {"key": key, "value": value, "remedy": remedy})


def unit_of(key: str) -> str:
    """Unit suffix of a configuration key, or an empty string."""
    return max((unit for unit in UNITS if key.endswith(f"_{unit}")), key=len, default="")


def kinds(annotation: Any) -> dict[str, type[Section]]:
    """Name to section of the kinds of which a key takes one, as the laws of a material, or each entry of a mapping,
    as the methods of trackers; empty for any other key."""
    if get_origin(annotation) is dict:
        return kinds(get_args(annotation)[1])
    if get_origin(annotation) is Annotated:
        return kinds(annotation.__origin__)
    choices = [choice for choice in get_args(annotation) if hasattr(choice, "__metadata__")]
    return {note.tag: each.__origin__ for each in choices for note in each.__metadata__ if isinstance(note, Tag)}


def chooser(choices: dict[str, type[Section]]) -> str:
    """The key that names the kind, as `law` or `method`: in every kind its default is the name of that kind."""
    name, section = next(iter(choices.items()))
    return next(key for key, field in section.model_fields.items() if field.default == name)


class Section(BaseModel):
    """A part of the configuration: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True)

    def si(self) -> SimpleNamespace:
        """Values in SI units under their names without the unit (`pitch_um` becomes `pitch`, m)."""
        values: dict[str, Any] = {}
        for key in type(self).model_fields:
            value, unit = getattr(self, key), unit_of(key)
            if isinstance(value, Section):
                value = value.si()
            elif value is not None and unit:
                value = _scaled(value, UNITS[unit])
            values[key.removesuffix(f"_{unit}")] = value
        return SimpleNamespace(**values)

    def settled(self) -> Section:
        """The same with every value written out that another key of the section decides."""
        return self


def _scaled(value: Any, factor: float) -> Any:
    if isinstance(value, dict):
        return {key: each * factor for key, each in value.items()}
    return [each * factor for each in value] if isinstance(value, list) else value * factor
