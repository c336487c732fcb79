"""The table of cases: a row for each heart, with all keys that can be swept."""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING, Any

from echotruth.cases import labels
from echotruth.cases.case import Case
from echotruth.cases.checks import can_be_swept
from echotruth.config import Config, Section
from echotruth.section import dotted_values

if TYPE_CHECKING:
    import pandas as pd


def table(cases: list[Case]) -> pd.DataFrame:
    """Table with one row per case: its id, its seed, diagnosis, labels and note, and every key that can be swept.

    Keys of views are left out where all cases have the same value: a view may leave a repository and return.
    """
    import pandas as pd

    columns: dict[str, list[Any]] = {"case": [case.id for case in cases], "seed": [case.config.seed for case in cases]}
    columns |= labels.columns(cases)
    for name in Config.model_fields:
        if name == "views":
            for view in cases[0].config.views:
                keys = _columns(f"views.{view}", [case.config.views[view] for case in cases])
                columns |= {key: values for key, values in keys.items() if len(set(values)) > 1}
        elif isinstance(getattr(cases[0].config, name), Section) and name != "cases":
            columns |= _columns(name, [getattr(case.config, name) for case in cases])
    return pd.DataFrame(columns)


def _columns(name: str, sections: list[Section]) -> dict[str, list[Any]]:
    """Dotted key -> value in every case, of all keys of a section that can be swept."""
    distinct = {id(section): section for section in sections}
    values = {number: _sweepable(section, f"{name}.") for number, section in distinct.items()}
    keys = dict.fromkeys(key for each in values.values() for key in each)
    order = [id(section) for section in sections]
    return {key: [values[section].get(key, nan) for section in order] for key in keys}


def _sweepable(section: Section, prefix: str) -> dict[str, Any]:
    """Dotted key -> value of all keys that can be swept; a list is one entry of the table."""
    values = {key: value for key, value in dotted_values(section.resolved(), prefix) if can_be_swept(key)}
    return {
        key: " ".join(map(str, value)) if isinstance(value, list | tuple) else value
        for key, value in values.items()
        if not isinstance(value, dict)
    }
