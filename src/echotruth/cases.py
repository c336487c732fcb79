"""Expand the sweep of a configuration into cases, one heart each, with stable ids."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echotruth.config import Config, Loop, Section
from echotruth.config.loading import ConfigError, override
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


@dataclass(frozen=True)
class Case:
    """One heart of the sweep.

    Attributes
    ----------
    id : str
        Readable and stable: it depends only on the swept keys and their values in this case.
    parameters : dict
        Swept dotted key -> value.
    config : Config
        Configuration of this case, without a sweep.
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
    for key in config.cases:
        _check_swept_key(config, key, source)
    cases = [_case(config, parameters, source) for parameters in _combinations(config)]
    if len({case.id for case in cases}) < len(cases):
        raise ConfigError(f"{source}: cases gives a value twice for one key: list each value once")
    for loop in {case.config.loop for case in cases}:
        _check_loop(loop, source)
    series = {case.config.motion.file.path for case in cases if case.config.motion.kind == "file"}
    for path in series:
        _check_series(path, source)
    for file in {case.config.geometry.file for case in cases} - series:
        if file is not None and not Path(file).is_file():
            raise ConfigError(f"{source}: geometry.file = {file!r}: file not found: give its path from this folder")
    return cases


def find_case(config: Config, id: str) -> Case:
    """Case with an id."""
    for parameters in _combinations(config):
        if case_id(parameters) == id:
            return _case(config, parameters, config.name)
    raise ConfigError(f"{id} is not a case of {config.name}: the ids are in out/{config.name}/cases.csv")


def case_id(parameters: dict[str, Any]) -> str:
    """Id of a case: readable values of the swept keys, and a hash of the exact ones.

    >>> case_id({"fibres.endo_deg": 70.0, "seed": 2})
    'endo70_seed2_17059c'
    """
    if not parameters:
        return "heart"
    exact = {key: _integer_if_whole(value) for key, value in sorted(parameters.items())}
    readable = "_".join(f"{_short_key(key)}{_short_value(value)}" for key, value in exact.items())
    return f"{readable[:80]}_{sha256(json.dumps(exact).encode()).hexdigest()[:6]}"


def table(cases: list[Case]) -> pd.DataFrame:
    """Table with one row per case: its id, its seed, and every key that can be swept."""
    import pandas as pd

    rows = [{"case": case.id, "seed": case.config.seed, **_sweepable(case.config)} for case in cases]
    return pd.DataFrame(rows)


def _combinations(config: Config) -> Iterator[dict[str, Any]]:
    for values in itertools.product(*config.cases.values()):
        yield dict(zip(config.cases, values, strict=True))


def _case(config: Config, parameters: dict[str, Any], source: str) -> Case:
    single = config.model_copy(update={"cases": {}})
    return Case(case_id(parameters), parameters, override(single, parameters, f"{source}: cases"))


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


def _integer_if_whole(value: Any) -> Any:
    """Convert 84.0 to 84, so that both spellings give the same id."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _short_key(key: str) -> str:
    name = key.rsplit(".", 1)[-1]
    return name.removesuffix(f"_{unit_of(name)}").replace("_", "")


def _short_value(value: Any) -> str:
    return "".join(letter for letter in str(value) if letter.isalnum() or letter in ".-")
