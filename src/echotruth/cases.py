"""Expand the sweep of a configuration into cases, one heart each, with stable ids."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from echotruth.config import Config, Loop, Section
from echotruth.config.loading import ConfigError, override, replace_values
from echotruth.section import unit_of

if TYPE_CHECKING:
    import pandas as pd

NOT_SWEPT = (
    *("name", "cases", "views", "tracking", "geometry.shape", "fibres.layers", "loop.frames", "rf.keep"),
    *("bmode.field_of_view_mm", "bmode.size_px", "bmode.downsampling"),
)
"""Keys that cannot be swept (nor can `geometry.*_elements`), because they set the sizes of arrays over all cases."""

RF_INDEPENDENT = ("probe.width_um", "probe.height_mm", "probe.elevation_focus_mm", "probe.attenuation_dB_per_cm_MHz")
"""Keys of the probe that can be swept even if RF is kept: they change neither its length nor the scan lines."""


READABLE_LENGTH = 80
"""Longest readable part of an id, letters."""


@dataclass(frozen=True)
class Case:
    """One heart of the sweep.

    Attributes
    ----------
    id : str
        Readable and stable: it depends only on the swept keys whose value is not the one they have without the sweep.
    parameters : dict
        Swept dotted key -> value.
    config : Config
        Configuration of this case, without a sweep; cases share the sections in which they do not differ.
    """

    id: str
    parameters: dict[str, Any]
    config: Config


def expand(config: Config, source: str = "configuration") -> list[Case]:
    """Cases for all combinations of the values under `cases`, in their order.

    Raises
    ------
    ConfigError
        If a key cannot be swept or a combination is not valid.
    """
    for key, values in config.cases.items():
        _check_swept_key(config, key, source)
        _check_distinct(key, values, source)
    sweep = Sweep(config, source)
    cases = [sweep.case(parameters) for parameters in _combinations(config)]
    _check_ids(cases, source)
    for loop in _distinct(case.config.loop for case in cases):
        _check_loop(loop, source)
    series = {motion.file.path for motion in _distinct(case.config.motion for case in cases) if motion.kind == "file"}
    for path in series:
        _check_series(path, source)
    for file in {geometry.file for geometry in _distinct(case.config.geometry for case in cases)} - series:
        if file is not None and not Path(file).is_file():
            raise ConfigError(f"{source}: geometry.file = {file!r}: file not found: give its path from this folder")
    return cases


def find_case(config: Config, id: str) -> Case:
    """Case with an id."""
    sweep = Sweep(config, config.name)
    for parameters in _combinations(config):
        if sweep.id(parameters) == id:
            return sweep.case(parameters)
    raise ConfigError(f"{id} is not a case of {config.name}: the ids are in out/{config.name}/cases.csv")


class Sweep:
    """Makes the cases of a configuration; each combination of values within a section is validated once.

    Parameters
    ----------
    config : Config
    source : str
        What errors name.
    """

    def __init__(self, config: Config, source: str) -> None:
        self._config = config.model_copy(update={"cases": {}})
        self._source = f"{source}: cases"
        self._values = {name: getattr(self._config, name) for name in type(config).model_fields}
        self._sections: dict[tuple[str, str], _Changed] = {}

    def case(self, parameters: dict[str, Any]) -> Case:
        """The case with some values of the swept keys.

        Raises
        ------
        ConfigError
            If they are not valid together.
        """
        try:
            changed = self._changed(parameters)
            config = Config.model_validate(self._values | {name: part.value for name, part in changed.items()})
        except ValidationError:
            override(self._config, parameters, self._source)  # its error names the key as the user writes it
            raise
        return Case(_id(parameters, changed), parameters, config)

    def id(self, parameters: dict[str, Any]) -> str:
        """Id of the case with some values of the swept keys."""
        return _id(parameters, self._changed(parameters))

    def _changed(self, parameters: dict[str, Any]) -> dict[str, _Changed]:
        """Name of each swept section, or of a swept key outside of sections -> its value, and the keys that differ."""
        by_section: dict[str, dict[str, Any]] = {}
        for key, value in parameters.items():
            by_section.setdefault(key.partition(".")[0], {})[key] = value
        return {name: self._section(name, changes) for name, changes in by_section.items()}

    def _section(self, name: str, changes: dict[str, Any]) -> _Changed:
        known = (name, repr(changes))
        if known not in self._sections:
            self._sections[known] = _change(name, self._values[name], changes)
        return self._sections[known]


@dataclass(frozen=True)
class _Changed:
    """Section (or key outside of sections) of a case, and those of its swept keys whose value differs."""

    value: Any
    differing: frozenset[str]


def _id(parameters: dict[str, Any], changed: dict[str, _Changed]) -> str:
    differing = frozenset[str]().union(*(part.differing for part in changed.values()))
    return case_id({key: value for key, value in parameters.items() if key in differing})


def _change(name: str, value: Any, changes: dict[str, Any]) -> _Changed:
    """Replace keys of a section.

    A key differs if its value is not the one it would have if it were not swept: that of the configuration, unless it
    follows other swept keys, as the parameters of a law and the lengths of a preset do.
    """
    if not isinstance(value, Section):
        return _Changed(changes[name], frozenset(changes if _exact(changes[name]) != _exact(value) else ()))
    keys = {key.removeprefix(f"{name}."): new for key, new in changes.items()}
    section = type(value).model_validate(replace_values(value.model_dump(), keys))
    return _Changed(section, frozenset(f"{name}.{key}" for key in keys if _differs(value, section, keys, key)))


def _differs(base: Section, section: Section, changes: dict[str, Any], key: str) -> bool:
    others = {other: value for other, value in changes.items() if other != key}
    try:
        without = type(base).model_validate(replace_values(base.model_dump(), others))
        return _exact(_value(without, key)) != _exact(_value(section, key))
    except (ValidationError, AttributeError, KeyError):
        return True  # without the key there is no such section


def _value(section: Section, dotted_key: str) -> Any:
    value: Any = section
    for part in dotted_key.split("."):
        value = getattr(value.resolved(), part)
    return value.model_dump(mode="json") if isinstance(value, Section) else value


def case_id(parameters: dict[str, Any]) -> str:
    """Id of a case: readable values of the swept keys in which it differs, and a hash of the exact ones.

    The hash is longer if not all of the readable part fits.

    >>> case_id({"fibres.endo_deg": 70.0, "seed": 2})
    'endo70_seed2_17059c'
    """
    if not parameters:
        return "heart"
    exact = {key: _integer_if_whole(value) for key, value in sorted(parameters.items())}
    readable = "_".join(f"{_short_key(key)}{_short_value(value)}" for key, value in exact.items())
    digits = 6 if len(readable) <= READABLE_LENGTH else 16
    return f"{readable[:READABLE_LENGTH]}_{sha256(json.dumps(exact).encode()).hexdigest()[:digits]}"


def table(cases: list[Case]) -> pd.DataFrame:
    """Table with one row per case: its id, its seed, and every key that can be swept."""
    import pandas as pd

    columns: dict[str, list[Any]] = {"case": [case.id for case in cases], "seed": [case.config.seed for case in cases]}
    for name in Config.model_fields:
        if isinstance(getattr(cases[0].config, name), Section):
            columns |= _columns(name, [getattr(case.config, name) for case in cases])
    return pd.DataFrame(columns)


def _columns(name: str, sections: list[Section]) -> dict[str, list[Any]]:
    """Dotted key -> value in every case, of all keys of a section that can be swept."""
    values = {id(section): _sweepable(section, f"{name}.") for section in _distinct(sections)}
    keys = dict.fromkeys(key for each in values.values() for key in each)
    order = [id(section) for section in sections]
    return {key: [values[section].get(key, nan) for section in order] for key in keys}


def _distinct(sections: Iterable[Any]) -> list[Any]:
    """Sections without those that occur again; cases share the sections in which they do not differ."""
    return list({id(section): section for section in sections}.values())


def _combinations(config: Config) -> Iterator[dict[str, Any]]:
    for values in itertools.product(*config.cases.values()):
        yield dict(zip(config.cases, values, strict=True))


def _check_distinct(key: str, values: list[Any], source: str) -> None:
    seen: set[str] = set()
    for value in values:
        if (exact := _exact(value)) in seen:
            raise ConfigError(f"{source}: cases.{key} gives a value twice, {value}: list each value once")
        seen.add(exact)


def _check_ids(cases: list[Case], source: str) -> None:
    known: dict[str, Case] = {}
    for case in cases:
        other = known.setdefault(case.id, case)
        if other is not case:
            given = f"{other.parameters} and {case.parameters}"
            raise ConfigError(f"{source}: cases: {given} are the same heart, {case.id}: leave one of them out")


def _check_swept_key(config: Config, key: str, source: str) -> None:
    value: Any = config
    for part in key.split("."):
        if not isinstance(value, Section) or part not in type(value).model_fields:
            raise ConfigError(f"{source}: cases.{key}: {key} is not a key: write it in full, such as fibres.endo_deg")
        value = getattr(value, part)
    if isinstance(value, Section | dict):
        raise ConfigError(f"{source}: cases.{key}: {key} is a section: sweep one of its keys")
    if key == "geometry.file" and not config.geometry.remesh:
        raise ConfigError(f"{source}: cases.{key}: the meshes may differ in size: set geometry.remesh: true")
    if key.startswith(NOT_SWEPT) or key.endswith("_elements"):
        raise ConfigError(f"{source}: cases.{key}: {key} cannot be swept, all cases share it: set it once")
    if config.rf.keep and key.startswith(("probe.", "rf.")) and key not in RF_INDEPENDENT:
        raise ConfigError(f"{source}: cases.{key}: {key} cannot be swept if RF is kept: leave rf.keep empty")


def _check_loop(loop: Loop, source: str) -> None:
    from echotruth.loop.cycle import LoopError, read_loop

    try:
        read_loop(loop)
    except LoopError as error:
        raise ConfigError(f"{source}: loop: {error}") from None


def _check_series(path: str | None, source: str) -> None:
    from echotruth.mechanics.motion_file.files import series_files
    from echotruth.mechanics.prescribed import MotionError

    try:
        series_files(str(path))
    except MotionError as error:
        raise ConfigError(f"{source}: {error}") from None


def _sweepable(section: Section, prefix: str = "") -> dict[str, Any]:
    """Dotted key -> value of all keys that can be swept."""
    values: dict[str, Any] = {}
    section = section.resolved()
    for key in type(section).model_fields:
        dotted, value = f"{prefix}{key}", getattr(section, key)
        if isinstance(value, Section):
            values |= _sweepable(value, f"{dotted}.")
        elif not (isinstance(value, dict) or dotted.startswith((*NOT_SWEPT, "seed")) or dotted.endswith("_elements")):
            # A list is one entry of the table.
            values[dotted] = " ".join(map(str, value)) if isinstance(value, list) else value
    return values


def _exact(value: Any) -> str:
    """Text that is the same for all spellings of a value, and for no other value."""
    return json.dumps(_integer_if_whole(value), sort_keys=True, default=repr)


def _integer_if_whole(value: Any) -> Any:
    """Convert 84.0 to 84, also within lists and mappings, so that both spellings give the same id."""
    if isinstance(value, dict):
        return {key: _integer_if_whole(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_integer_if_whole(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


@cache
def _short_key(key: str) -> str:
    name = key.rsplit(".", 1)[-1]
    return name.removesuffix(f"_{unit_of(name)}").replace("_", "")


def _short_value(value: Any) -> str:
    return "".join(letter for letter in str(value) if letter.isalnum() or letter in ".-")
