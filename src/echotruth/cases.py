"""The sweep: a configuration expanded into cases, one heart each, with ids that never change."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echotruth.config import Config, Loop, Section
from echotruth.config.loading import ConfigError, resolved
from echotruth.section import unit_of

if TYPE_CHECKING:
    import pandas as pd

SHAPES = (
    *("name", "cases", "views", "tracking", "geometry.shape", "fibres.layers", "loop.frames", "rf.keep"),
    *("bmode.field_of_view_mm", "bmode.size_px", "bmode.downsampling"),
)
"""Keys that may not be swept, nor `geometry.*_elements`: they shape the arrays that all cases share."""

FREE_OF_RF = ("probe.width_um", "probe.height_mm", "probe.elevation_focus_mm", "probe.attenuation_dB_per_cm_MHz")
"""Keys of the array that may be swept where its RF is kept: they change neither its length nor where a line is."""


@dataclass(frozen=True)
class Case:
    """One heart of the sweep.

    Attributes
    ----------
    id : str
        Readable and stable: made of the swept keys and this case's values alone.
    parameters : dict
        Swept key (dotted) to value.
    config : Config
        The whole configuration of this case, its sweep resolved.
    """

    id: str
    parameters: dict[str, Any]
    config: Config


def expand(config: Config, source: str = "configuration") -> list[Case]:
    """All combinations of the values under `cases`, checked, in the order written.

    Raises
    ------
    ConfigError
        Where a key cannot be swept or a combination cannot be run.
    """
    for key in config.cases:
        _check(config, key, source)
    cases = [_case(config, parameters, source) for parameters in _combinations(config)]
    if len({case.id for case in cases}) < len(cases):
        raise ConfigError(f"{source}: cases holds a value twice under one key: list each value once")
    for loop in {case.config.loop for case in cases}:
        _check_loop(loop, source)
    for file in {case.config.geometry.file for case in cases} - {None}:
        if not Path(file).is_file():
            raise ConfigError(f"{source}: geometry.file = {file!r}: there is no such file: give its path from here")
    return cases


def find(config: Config, id: str) -> Case:
    """The case of that id."""
    for parameters in _combinations(config):
        if case_id(parameters) == id:
            return _case(config, parameters, config.name)
    raise ConfigError(f"{id} is not a case of {config.name}: see out/{config.name}/cases.csv for the ids")


def case_id(parameters: dict[str, Any]) -> str:
    """Readable values of the swept keys, and a hash that settles what the readable part leaves open.

    >>> case_id({"fibres.endo_deg": 70.0, "seed": 2})
    'endo70_seed2_17059c'
    """
    if not parameters:
        return "heart"
    exact = {key: _plain(value) for key, value in sorted(parameters.items())}
    words = "_".join(f"{_leaf(key)}{_word(value)}" for key, value in exact.items())
    return f"{words[:80]}_{sha256(json.dumps(exact).encode()).hexdigest()[:6]}"


def table(cases: list[Case]) -> pd.DataFrame:
    """One row a case: its id, its seed, and a column for every key that any case could vary."""
    import pandas as pd

    rows = [{"case": case.id, "seed": case.config.seed, **_flat(case.config)} for case in cases]
    return pd.DataFrame(rows)


def generator(case: Case, view: str, stage: str) -> np.random.Generator:
    """Random numbers of one stage, the same whatever else is run, in whatever order."""
    key = json.dumps([case.config.seed, case.id, view, stage]).encode()
    return np.random.default_rng(np.frombuffer(sha256(key).digest(), np.uint32))


def _combinations(config: Config) -> Iterator[dict[str, Any]]:
    for values in itertools.product(*config.cases.values()):
        yield dict(zip(config.cases, values, strict=True))


def _case(config: Config, parameters: dict[str, Any], source: str) -> Case:
    single = config.model_copy(update={"cases": {}})
    return Case(case_id(parameters), parameters, resolved(single, parameters, f"{source}: cases"))


def _check(config: Config, key: str, source: str) -> None:
    section: Any = config
    for part in key.split("."):
        if not isinstance(section, Section) or part not in type(section).model_fields:
            raise ConfigError(f"{source}: cases.{key}: {key} is not a key: write it as fibres.endo_deg is written")
        section = getattr(section, part)
    if isinstance(section, Section | dict):
        raise ConfigError(f"{source}: cases.{key}: {key} is a section: sweep one of its keys")
    if key == "geometry.file" and not config.geometry.remesh:
        raise ConfigError(f"{source}: cases.{key}: meshes of two sizes share no arrays: set geometry.remesh: true")
    if key.startswith(SHAPES) or key.endswith("_elements"):
        raise ConfigError(f"{source}: cases.{key}: {key} cannot be swept, it is common to a repository: set it once")
    if config.rf.keep and key.startswith(("probe.", "rf.")) and key not in FREE_OF_RF:
        raise ConfigError(f"{source}: cases.{key}: {key} cannot be swept where RF is kept: leave rf.keep empty")


def _check_loop(loop: Loop, source: str) -> None:
    from echotruth.loop.cycle import LoopError, read_loop

    try:
        read_loop(loop)
    except LoopError as error:
        raise ConfigError(f"{source}: loop: {error}") from None


def _flat(section: Section, prefix: str = "") -> dict[str, Any]:
    """Dotted key to value of all keys that may be swept."""
    flat: dict[str, Any] = {}
    section = section.settled()
    for key in type(section).model_fields:
        dotted, value = f"{prefix}{key}", getattr(section, key)
        if isinstance(value, Section):
            flat |= _flat(value, f"{dotted}.")
        elif not (isinstance(value, dict) or dotted.startswith((*SHAPES, "seed")) or dotted.endswith("_elements")):
            # A list is one entry of the table.
            flat[dotted] = " ".join(map(str, value)) if isinstance(value, list) else value
    return flat


def _plain(value: Any) -> Any:
    """84 and 84.0 are one angle."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _leaf(key: str) -> str:
    leaf = key.rsplit(".", 1)[-1]
    return leaf.removesuffix(f"_{unit_of(leaf)}").replace("_", "")


def _word(value: Any) -> str:
    return "".join(letter if letter.isalnum() or letter in ".-" else "" for letter in str(value))
